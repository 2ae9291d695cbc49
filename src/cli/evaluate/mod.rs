//! `divmerge evaluate`

mod arguments;
mod folders;
mod recording;
mod scores;

use anyhow::Result;

use crate::evaluate::MetricSet;

pub use arguments::Arguments;

use crate::cli::arguments::objects::taxonomy;
use crate::cli::exit::Outcome;
use crate::cli::output::Outputs;

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let mut outputs = Outputs::new(arguments.files(), arguments.force);
    let json = outputs.optional(arguments.json.as_deref())?;
    let taxonomy = taxonomy(arguments.taxonomy.as_deref())?;
    let metrics = MetricSet {
        taxonomy: &taxonomy,
        min_points: arguments.min_points,
        entropy: arguments.entropy,
        over_time: arguments.over_time,
    };
    match (&arguments.input, &arguments.truth, &arguments.predictions) {
        (Some(input), ..) => recording::run(arguments, input, &metrics, json.as_ref())?,
        (None, Some(truth), Some(predictions)) => {
            folders::run(arguments, [truth, predictions], &metrics, json.as_ref())?;
        }
        _ => unreachable!("clap requires one of the two"),
    }
    Ok(Outcome::Done)
}
