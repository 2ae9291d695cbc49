//! `divmerge params`

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};

use crate::Taxonomy;
use crate::cli::arguments::method::{METHODS, PRESETS};
use crate::cli::arguments::parameters::ParameterArguments;
use crate::cli::arguments::values::one_of;
use crate::cli::exit::{NotThere, Outcome};
use crate::comparison::DIVIDE_AND_MERGE;
use crate::comparison::methods;
use crate::error::spelling::did_you_mean;
use crate::parameter_file::explained_toml;
use crate::parameters::{Parameter, ParameterSet};
use crate::pipeline::Preset;

/// List every parameter of the method
///
/// With meaning, unit, limits, source and the value of a preset, as TOML that `--config` reads
/// back. What is off in the preset stands there as a comment.
#[derive(Args)]
pub struct Arguments {
    /// Only parameters whose path contains this
    #[arg(value_name = "TEXT")]
    part: Option<String>,

    /// The preset whose values are shown
    #[arg(long, default_value = "best", value_parser = one_of(PRESETS))]
    preset: Preset,

    /// Also the parameters of another clustering method
    #[arg(long, value_name = "METHOD", default_value = DIVIDE_AND_MERGE)]
    #[arg(value_parser = one_of(METHODS))]
    method: &'static str,

    #[command(flatten)]
    parameters: ParameterArguments,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let other_method = methods::named(arguments.method, &Taxonomy::default());
    let mut parameters = arguments.parameters.start(arguments.preset, other_method)?;
    arguments.parameters.set(&mut parameters)?;
    let part = arguments.part.as_deref().unwrap_or_default();
    let is_shown = |parameter: &Parameter| parameter.path.contains(part);
    let all = parameters.parameters();
    if !all.iter().any(is_shown) {
        let paths = all.iter().map(|parameter| parameter.path.as_str());
        let words: Vec<&str> = paths.flat_map(|path| path.split('.').chain([path])).collect();
        let near = did_you_mean(part, &words);
        return Err(NotThere(format!("no parameter has `{part}` in its path{near}")).into());
    }
    match arguments.json {
        true => println!("{}", serde_json::to_string_pretty(&list(&parameters, is_shown))?),
        false => print!("{}", explained_toml(&parameters, is_shown)),
    }
    Ok(Outcome::Done)
}

/// The parameters with their values and those of the preset.
fn list(parameters: &ParameterSet, is_shown: impl Fn(&Parameter) -> bool) -> Vec<Value> {
    let usual = ParameterSet::of_preset(parameters.preset.parse().unwrap_or_default());
    let value = |set: &ParameterSet, path: &str| set.get(path).ok().flatten();
    let shown = parameters.parameters().into_iter().filter(is_shown);
    let row = |parameter: Parameter| {
        let mut row = json!(parameter);
        row["value"] = json!(value(parameters, &parameter.path));
        row["preset_value"] = json!(value(&usual, &parameter.path));
        row
    };
    shown.map(row).collect()
}
