//! `divmerge join`

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use divmerge::annotate::slices::{Plan, files_of};
use divmerge::annotate::{AnnotationReport, JoinOptions, SliceFile, by_recording, join};
use divmerge::datasets::bag::{Bag, METADATA_FILE};
use divmerge::recording::STANDARD_STREAM;

use crate::exit::Outcome;
use crate::layout::Layout;
use crate::output::{make_parent, refuse_existing, write_metadata};
use crate::progress::RecordingProgress;
use crate::{interrupt, report};

/// Join annotated slices into one recording
///
/// Reads the recording again and takes the annotations from the slices (`divmerge annotate
/// --slice`). The result has the same bytes as `divmerge annotate` of the whole recording with the
/// same arguments. A slice that is missing, given twice, or made from another recording or with
/// other arguments is an error that names it.
#[derive(Args)]
pub struct Arguments {
    /// The slices, or folders of them, of one or more recordings
    #[arg(value_name = "SLICES", required = true)]
    slices: Vec<PathBuf>,

    /// The annotated recording. For slices of several recordings, or if the name does not end in
    /// .mcap, a folder in which each recording has its name from the plan; recordings of a rosbag2
    /// folder also get a metadata.yaml
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// The plan, to check that no recording is missing
    #[arg(long)]
    plan: Option<PathBuf>,

    /// Where the recording is, if it has moved since it was planned; only for slices of one
    /// recording
    #[arg(long, value_name = "IN")]
    input: Option<PathBuf>,

    /// Do not write a layout for Lichtblick and Foxglove beside the output
    #[arg(long)]
    no_layout: bool,

    /// Skip recordings whose output exists
    #[arg(long, conflicts_with = "force")]
    resume: bool,

    /// Replace an existing output
    #[arg(long)]
    force: bool,

    /// Threads that decompress and compress, beside the one that reads and writes [default: the
    /// number of cores, at most 8]
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
        bail!("no slices found; name slices or folders of them");
    }
    if recordings.len() > 1 && arguments.input.is_some() {
        bail!("--input is for slices of one recording; these are of {}", recordings.len());
    }
    let output = arguments.output.as_path();
    if output == STANDARD_STREAM {
        bail!("cannot join to standard output; name a file");
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
            true => println!("{} already exists", output.display()),
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
    Ok(Outcome::of(reports.iter().all(AnnotationReport::is_complete)))
}

/// Writes a `metadata.yaml` beside outputs whose inputs are in a rosbag2 folder, and returns their
/// names.
fn metadata_of_bags(made: &[(PathBuf, PathBuf)]) -> Result<Vec<PathBuf>> {
    let folders =
        made.iter().filter_map(|(input, output)| Some((input.parent()?, output.parent()?)));
    let folders: BTreeSet<(&Path, &Path)> = folders.collect();
    let outputs: Vec<PathBuf> = made.iter().map(|(_, output)| output.clone()).collect();
    let bags = folders.into_iter().filter(|(input, _)| input.join(METADATA_FILE).is_file());
    let written = bags.map(|(input, output)| write_metadata(&Bag::open(input)?, output, &outputs));
    Ok(written.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

/// The named slices, and those in named folders.
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

fn one(arguments: &Arguments, slices: &[SliceFile], output: &Path) -> Result<AnnotationReport> {
    refuse_existing(output, arguments.force)?;
    let layout = Layout::beside(output, !arguments.no_layout, arguments.force)?;
    make_parent(output)?;
    let options = JoinOptions {
        input: arguments.input.clone(),
        force: arguments.force,
        threads: arguments.threads.map_or(0, usize::from),
    };
    let progress = RecordingProgress::new("joining", &slices[0].slice.input);
    let report = join(slices, output, &options, &mut |event| {
        progress.show(&event);
        interrupt::check()
    })?;
    drop(progress);
    layout.write(&report)?;
    if !arguments.json {
        print!("{}", report::text(&report));
    }
    Ok(report)
}
