//! `divmerge plan`

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::annotate::slices::{Plan, Slice, plan, recordings};
use crate::cli::arguments::values::at_least_one;
use crate::cli::exit::Outcome;
use crate::cli::output::Outputs;
use crate::cli::table::Table;
use crate::cli::text::{counted, grouped};

/// Cut recordings into slices that many machines can annotate
///
/// A slice is a range of a recording's chunks. Only the recording's index is read. Every slice can
/// be annotated on its own, in any order, on any machine that can read the recording:
///
///   divmerge plan drive.mcap --shards 8 -o plan.json
///   divmerge annotate --slice plan.json:0 -o slices     (and so on, up to 7)
///   divmerge join slices --plan plan.json -o annotated.mcap
///
/// `join` writes the same bytes as one run over the whole recording.
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub struct Arguments {
    /// Recordings (MCAP), rosbag2 folders, or other folders, of which every .mcap file is taken
    #[arg(value_name = "IN", required = true)]
    inputs: Vec<PathBuf>,

    /// Number of slices of all recordings together; each recording gets at least one
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    shards: usize,

    /// The plan (JSON) [default: standard output]
    #[arg(short, long, value_name = "PLAN")]
    output: Option<PathBuf>,

    /// Divide the clouds of this topic only; may be repeated [default: all]
    #[arg(long = "topic", value_name = "T")]
    topics: Vec<String>,

    /// Replace an existing plan
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let recordings = recordings(&arguments.inputs)?;
    let inputs = recordings.iter().map(|planned| planned.input.as_path());
    let output = Outputs::new(inputs, arguments.force).optional(arguments.output.as_deref())?;
    let slices = plan(&recordings, arguments.shards, &arguments.topics)?;
    let made = Plan::new(slices);
    match output {
        None => print!("{}", made.to_json()),
        Some(output) => {
            output.write(made.to_json().as_bytes())?;
            let head = ["recording", "slice", "clouds", "MB", "seconds"];
            print!("{}", Table::new(&head, made.slices.iter().enumerate().map(row)).markdown());
            let (all, requested) = (made.slices.len() as u64, arguments.shards);
            if all < requested as u64 {
                let slices = counted(all, "slice");
                println!("{slices} instead of {requested}: there are no more chunks with clouds");
            }
            println!("wrote {}", output.path().display());
        }
    }
    Ok(Outcome::Done)
}

fn row((number, slice): (usize, &Slice)) -> Vec<String> {
    let times = slice.from_ns.zip(slice.to_ns);
    vec![
        slice.name.display().to_string(),
        number.to_string(),
        grouped(slice.clouds),
        format!("{:.1}", (slice.end - slice.start) as f64 * 1e-6),
        times.map_or(String::new(), |(from, to)| format!("{:.1}", (to - from) as f64 * 1e-9)),
    ]
}
