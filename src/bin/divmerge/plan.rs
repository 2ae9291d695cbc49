//! `divmerge plan`

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use divmerge::annotate::slices::{Plan, Slice, plan, recordings};
use divmerge::io::write_file;

use crate::Outcome;
use crate::arguments::at_least_one;
use crate::table::Table;
use crate::terminal::grouped;

/// Cut recordings into slices that many machines can annotate
///
/// A slice is a stretch of a recording between two of its chunks. It is found by the recording's
/// index, and nothing else is read. Every slice can be annotated by itself, in any order, on any
/// machine that sees the recording:
///
///   divmerge plan drive.mcap --shards 8 -o plan.json
///   divmerge annotate --slice plan.json:0 -o slices     (and so on, up to 7)
///   divmerge join slices --plan plan.json -o annotated.mcap
///
/// What `join` writes is what one run over the whole recording writes, byte for byte.
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub struct Arguments {
    /// The recordings (MCAP), folders of rosbag2, or other folders, of which every .mcap file is meant
    #[arg(value_name = "IN", required = true)]
    inputs: Vec<PathBuf>,

    /// How many slices, all recordings together; each gets at least one, and the others where most clouds are
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    shards: usize,

    /// The plan (JSON) [default: standard output]
    #[arg(short, long, value_name = "PLAN")]
    output: Option<PathBuf>,

    /// Share out the clouds of this topic alone; may be given several times [default: all]
    #[arg(long = "topic", value_name = "T")]
    topics: Vec<String>,

    /// Replace an existing plan
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    if let Some(output) = &arguments.output {
        crate::refuse_existing(output, arguments.force)?;
    }
    let slices = plan(&recordings(&arguments.inputs)?, arguments.shards, &arguments.topics)?;
    let made = Plan::new(slices);
    match &arguments.output {
        None => print!("{}", made.to_json()),
        Some(output) => {
            write_file(output, made.to_json().as_bytes(), arguments.force)?;
            let head = ["recording", "slice", "clouds", "MB", "seconds"];
            print!("{}", Table::new(&head, made.slices.iter().enumerate().map(row)).markdown());
            let (all, asked) = (made.slices.len(), arguments.shards);
            if all < asked {
                println!(
                    "{all} slices and not {asked}: there are no more chunks with clouds to cut at"
                );
            }
            println!("wrote {}", output.display());
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
