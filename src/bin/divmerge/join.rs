//! `divmerge join`

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use divmerge::annotate::slices::{Plan, files_of};
use divmerge::annotate::{Event, JoinOptions, Report, SliceFile, by_recording, join};
use divmerge::io::bag::METADATA_FILE;
use divmerge::io::{Bag, STANDARD_STREAM};

use crate::annotate::tasks::write_metadata;
use crate::annotate::{Layout, outcome, print};
use crate::terminal::byte_bar;
use crate::{Outcome, interrupt};

/// Put annotated slices back into one recording
///
/// The recording is read once more, and what was made of its clouds is taken from the slices (`divmerge annotate --slice`).
/// The result is what `divmerge annotate` makes of the whole recording with the same arguments, byte for byte. A slice that
/// is missing, there twice, or made of another recording or with other arguments is an error that names it.
#[derive(Args)]
pub struct Arguments {
    /// The slices, or folders that hold them; of several recordings, too
    #[arg(value_name = "SLICES", required = true)]
    slices: Vec<PathBuf>,

    /// The annotated recording. For slices of several recordings, or if the name does not end in .mcap, a folder, in which
    /// each goes where the plan says, with a metadata.yaml beside those of a rosbag2 folder
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// The plan: makes sure that no recording is missing with all its slices
    #[arg(long)]
    plan: Option<PathBuf>,

    /// Where the recording is, if not where it was planned; only for slices of one
    #[arg(long, value_name = "IN")]
    input: Option<PathBuf>,

    /// Write no layout for Lichtblick and Foxglove beside the output
    #[arg(long)]
    no_layout: bool,

    /// Leave out recordings whose output is there already
    #[arg(long, conflicts_with = "force")]
    resume: bool,

    /// Replace an existing output
    #[arg(long)]
    force: bool,

    /// Threads that unpack and compress, besides the one that reads and writes [default: one for each core, 8 at most]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// Print the reports as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    let plan = arguments.plan.as_deref().map(Plan::read).transpose()?;
    let recordings = by_recording(slices(&arguments.slices)?, plan.as_ref())?;
    if recordings.is_empty() {
        bail!("no slice there");
    }
    if recordings.len() > 1 && arguments.input.is_some() {
        bail!("--input is where one recording is; these are slices of {}", recordings.len());
    }
    let output = arguments.output.as_path();
    if output == STANDARD_STREAM {
        bail!("joined recordings go into files: name one");
    }
    let is_file = output.extension().is_some_and(|end| end == "mcap") && !output.is_dir();
    let is_folder = recordings.len() > 1 || !is_file;
    let (mut reports, mut made) = (Vec::new(), Vec::new());
    for slices in &recordings {
        let output = match is_folder {
            true => arguments.output.join(&slices[0].slice.name),
            false => arguments.output.clone(),
        };
        match arguments.resume && output.exists() {
            true => println!("{} is there already", output.display()),
            false => reports.push(one(arguments, slices, &output)?),
        }
        made.push((slices[0].slice.input.clone(), output));
    }
    if is_folder {
        for path in metadata_of_bags(&made)? {
            println!("wrote {}", path.display());
        }
    }
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&reports)?);
    }
    let outcomes = reports.iter().map(outcome);
    Ok(outcomes
        .fold(Outcome::Done, |all, one| if matches!(one, Outcome::Done) { all } else { one }))
}

/// Writes a `metadata.yaml` beside the recordings that were made of those of a rosbag2 folder, and returns their names.
fn metadata_of_bags(made: &[(PathBuf, PathBuf)]) -> Result<Vec<PathBuf>> {
    let folders =
        made.iter().filter_map(|(input, output)| Some((input.parent()?, output.parent()?)));
    let folders: BTreeSet<(&Path, &Path)> = folders.collect();
    let outputs: Vec<PathBuf> = made.iter().map(|(_, output)| output.clone()).collect();
    let bags = folders.into_iter().filter(|(input, _)| input.join(METADATA_FILE).is_file());
    let written = bags.map(|(input, output)| write_metadata(&Bag::open(input)?, output, &outputs));
    Ok(written.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

/// The slices that are named, and those in folders that are.
fn slices(paths: &[PathBuf]) -> Result<Vec<SliceFile>> {
    let mut slices = Vec::new();
    for path in paths {
        let files = match path.is_dir() {
            true => files_of(path)?.into_iter().map(|file| path.join(file)).collect(),
            false => vec![path.clone()],
        };
        for file in files {
            slices.push(SliceFile::open(&file)?);
        }
    }
    Ok(slices)
}

fn one(arguments: &Arguments, slices: &[SliceFile], output: &Path) -> Result<Report> {
    crate::refuse_existing(output, arguments.force)?;
    let layout = Layout::beside(output, !arguments.no_layout, arguments.force)?;
    if let Some(folder) = output.parent() {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let options = JoinOptions {
        input: arguments.input.clone(),
        force: arguments.force,
        threads: arguments.threads.map_or(0, usize::from),
    };
    let bar = byte_bar("joining");
    let report = join(slices, output, &options, &mut |event| {
        match event {
            Event::Progress { bytes, total } => {
                bar.set_length(total.max(bytes));
                bar.set_position(bytes);
            }
            Event::Warning(warning) => bar.suspend(|| eprintln!("warning: {warning}")),
            Event::Frame(_) => {}
        }
        interrupt::wish()
    });
    bar.finish_and_clear();
    let report = report?;
    layout.write(&report)?;
    if !arguments.json {
        print(&report);
    }
    Ok(report)
}
