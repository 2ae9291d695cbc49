//! Arguments that set any parameter of a run.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, Error};
use serde_json::Value;

use crate::Method;
use crate::annotate::read_run;
use crate::cli::exit::{WrongUsage, nearest_file};
use crate::comparison::ContenderSetting;
use crate::parameter_file::ParameterFile;
use crate::parameters::{ParameterKind, ParameterSet, SettingError, registry};
use crate::pipeline::Preset;

/// Any parameter of a run.
#[derive(Args, Default)]
pub struct ParameterArguments {
    /// Set any parameter, as in cluster.condition.angle=8deg; may be repeated. `divmerge params`
    /// lists them with meaning, unit and default
    #[arg(long, value_name = "PATH=VALUE", value_parser = SettingParser)]
    #[arg(allow_hyphen_values = true, hide_possible_values = true)]
    set: Vec<Setting>,

    /// Take parameters and options from a TOML file (`divmerge params` prints one) or from a
    /// recording that `annotate` wrote; options given here go before those
    #[arg(long, value_name = "FILE", value_parser = config_file)]
    config: Option<ConfigFile>,
}

/// Any parameter of methods that are compared.
#[derive(Args)]
pub struct ContenderParameterArguments {
    /// Set a parameter of each method that has it, as in cluster.voxel=0.3, or of one, as in
    /// paper:cluster.voxel=0.3 or dbscan:method.reach=0.7; may be repeated. `divmerge params
    /// --method M` lists those of a method
    #[arg(long, value_name = "PATH=VALUE", value_parser = ContenderSettingParser)]
    #[arg(allow_hyphen_values = true, hide_possible_values = true)]
    pub set: Vec<ContenderSetting>,
}

/// A parameter and its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    path: String,
    value: Value,
}

/// The file of `--config`.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfigFile {
    pub path: PathBuf,
    pub file: ParameterFile,
}

fn config_file(text: &str) -> Result<ConfigFile, String> {
    let path = PathBuf::from(text);
    let missing = || if path.exists() { String::new() } else { nearest_file(&path) };
    let file = read_run(&path).map_err(|error| format!("{error}{}", missing()))?;
    Ok(ConfigFile { path, file })
}

impl ParameterArguments {
    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.config.iter().map(|config| config.path.as_path())
    }

    /// The parameters to start from: those of a preset and a method, and those of the file.
    pub fn start(
        &self,
        preset: Preset,
        other_method: Option<Arc<dyn Method>>,
    ) -> Result<ParameterSet, WrongUsage> {
        let mut parameters = ParameterSet { other_method, ..ParameterSet::of_preset(preset) };
        let Some(ConfigFile { path, file }) = &self.config else { return Ok(parameters) };
        let wrong = |problem: String| {
            WrongUsage(
                ErrorKind::ValueValidation,
                format!("--config {}: {problem}", path.display()),
            )
        };
        if let Some(other) = file.preset.filter(|&other| other != preset) {
            return Err(wrong(format!(
                "its parameters start from preset {}, not from {}; leave out --preset",
                other.name(),
                preset.name()
            )));
        }
        let method = parameters.other_method.as_ref().map(|method| method.name());
        let is_same = method == file.method.as_deref();
        let values = file.values.iter().filter(|(path, _)| is_same || !path.starts_with("method."));
        let values = values.map(|(path, value)| (path.as_str(), value));
        parameters.set_all(values).map_err(|error| wrong(error.to_string()))?;
        Ok(parameters)
    }

    /// Sets what `--set` asks for.
    pub fn set(&self, parameters: &mut ParameterSet) -> Result<(), WrongUsage> {
        let settings = self.set.iter().map(|setting| (setting.path.as_str(), &setting.value));
        parameters
            .set_all(settings)
            .map_err(|error| WrongUsage(ErrorKind::ValueValidation, format!("--set: {error}")))
    }

    /// The parameters of preset and file, with what `--set` asks for.
    pub fn of_preset(&self, preset: Preset) -> Result<ParameterSet, WrongUsage> {
        let mut parameters = self.start(preset, None)?;
        self.set(&mut parameters)?;
        Ok(parameters)
    }
}

/// Reads `PATH=VALUE`, and knows the paths for completion.
#[derive(Clone)]
struct SettingParser;

impl TypedValueParser for SettingParser {
    type Value = Setting;

    fn parse_ref(
        &self,
        command: &Command,
        arg: Option<&Arg>,
        value: &OsStr,
    ) -> Result<Setting, Error> {
        TypedValueParser::parse_ref(&setting, command, arg, value)
    }

    /// Each parameter with a value: that of the default preset, or each of its choices.
    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let usual = ParameterSet::with_all_parts();
        let values = registry().iter().flat_map(move |parameter| {
            let values = match &parameter.kind {
                ParameterKind::Switch | ParameterKind::Flag => {
                    vec!["true".to_owned(), "false".to_owned()]
                }
                ParameterKind::Choice { choices } => {
                    choices.iter().map(|choice| choice.name.clone()).collect()
                }
                _ => {
                    let value = usual.get(&parameter.path).ok().flatten().unwrap_or_default();
                    vec![value.as_str().map_or_else(|| value.to_string(), str::to_owned)]
                }
            };
            values.into_iter().map(|value| {
                PossibleValue::new(format!("{}={value}", parameter.path))
                    .help(parameter.doc.as_str())
            })
        });
        Some(Box::new(values))
    }
}

/// Reads `[METHOD:]PATH=VALUE`, and knows the paths for completion.
#[derive(Clone)]
struct ContenderSettingParser;

impl TypedValueParser for ContenderSettingParser {
    type Value = ContenderSetting;

    fn parse_ref(
        &self,
        command: &Command,
        arg: Option<&Arg>,
        value: &OsStr,
    ) -> Result<ContenderSetting, Error> {
        TypedValueParser::parse_ref(&contender_setting, command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        SettingParser.possible_values()
    }
}

/// Reads a setting of methods that are compared.
fn contender_setting(text: &str) -> Result<ContenderSetting, String> {
    let Some((path, value)) = text.split_once('=') else {
        return Err("use PATH=VALUE, as in cluster.voxel=0.3".to_owned());
    };
    ContenderSetting::new(path.trim(), value.trim().into())
}

/// Reads a setting. Parameters of other methods are checked when the method is known.
fn setting(text: &str) -> Result<Setting, String> {
    let Some((path, value)) = text.split_once('=') else {
        return Err("use PATH=VALUE, as in cluster.voxel=0.3".to_owned());
    };
    let (path, value) = (path.trim().to_owned(), Value::from(value.trim()));
    if !path.starts_with("method.") {
        match ParameterSet::with_all_parts().set(&path, &value) {
            Ok(()) | Err(SettingError::Contradiction { .. } | SettingError::Off { .. }) => {}
            Err(error) => return Err(error.to_string()),
        }
    }
    Ok(Setting { path, value })
}

/// The parameters that are not those of the preset, with those.
pub fn changes(parameters: &ParameterSet) -> Vec<String> {
    let usual = ParameterSet::of_preset(parameters.preset.parse().unwrap_or_default());
    let all = parameters.parameters();
    let changed = all.iter().filter_map(|parameter| {
        let path = parameter.path.as_str();
        let value = parameters.get(path).ok().flatten()?;
        let preset = usual.get(path).ok().flatten();
        let of_preset = preset.as_ref().map_or("none".to_owned(), ToString::to_string);
        (preset.as_ref() != Some(&value))
            .then(|| format!("{path} = {value} (preset {}: {of_preset})", parameters.preset))
    });
    changed.collect()
}
