//! `divmerge join`

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;

use crate::annotate::slices::{Plan, files_of};
use crate::annotate::{AnnotationReport, JoinOptions, SliceFile, by_recording, join};
use crate::cli::dry_run::{DryRun, DryRunArgument};
use crate::cli::exit::{Outcome, contradict};
use crate::cli::layout::{Layout, WantedLayouts};
use crate::cli::output::{OutputFile, Outputs, is_recording, make_parent, metadata_in};
use crate::cli::progress::RecordingProgress;
use crate::cli::{interrupt, report};
use crate::datasets::bag::{Bag, METADATA_FILE};
use crate::recording::STANDARD_STREAM;

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

    #[command(flatten)]
    dry_run: DryRunArgument,

    /// Print the reports as JSON
    #[arg(long, conflicts_with = "dry_run")]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    let plan = arguments.plan.as_deref().map(Plan::read).transpose()?;
    let recordings = by_recording(slices(&arguments.slices)?, plan.as_ref())?;
    if recordings.is_empty() {
        contradict!("no slices found; name slices or folders of them");
    }
    if recordings.len() > 1 && arguments.input.is_some() {
        contradict!("--input is for slices of one recording; these are of {}", recordings.len());
    }
    let output = arguments.output.as_path();
    if output == STANDARD_STREAM {
        contradict!("cannot join to standard output; name a file");
    }
    let is_file = is_recording(output) && !output.is_dir();
    if is_file && recordings.len() > 1 {
        let (output, count) = (output.display(), recordings.len());
        contradict!("{output}: is one recording for the slices of {count}; name a folder");
    }
    let joins = joins(arguments, &recordings, !is_file)?;
    let bags = if is_file { Vec::new() } else { bags(arguments, &recordings, &joins)? };
    if arguments.dry_run.dry_run {
        return dry_run(arguments, &recordings, (&joins, &bags));
    }
    let mut reports = Vec::new();
    for (join, slices) in joins.iter().zip(&recordings) {
        match join {
            Join { files: Some(files), .. } => {
                reports.push(one(arguments, slices, files)?);
            }
            Join { output, files: None } => println!("{} already exists", output.display()),
        }
    }
    let made: Vec<PathBuf> = joins.into_iter().map(|join| join.output).collect();
    for (bag, file) in &bags {
        if let Some(path) = file.write_metadata(bag, &made)? {
            println!("wrote {}", path.display());
        }
    }
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&reports)?);
    }
    Ok(Outcome::of(reports.iter().all(AnnotationReport::is_complete)))
}

/// A recording to write.
struct Join {
    output: PathBuf,
    /// The recording and the layout beside it; `None` if it exists and is kept.
    files: Option<(OutputFile, Layout)>,
}

/// Says what would be done.
fn dry_run(
    arguments: &Arguments,
    recordings: &[Vec<SliceFile>],
    (joins, bags): (&[Join], &[(Bag, OutputFile)]),
) -> Result<Outcome> {
    for (join, slices) in joins.iter().zip(recordings) {
        let planned = slices[0].slice.input.as_path();
        let (mut plan, _) = DryRun::of_recording(arguments.input.as_deref().unwrap_or(planned))?;
        slices.iter().for_each(|slice| plan.line(format_args!("  with {}", slice.path.display())));
        match &join.files {
            None => plan.line(format_args!("and keep {}, which exists", join.output.display())),
            Some(_) => {
                plan.writes(join.output.display());
                let layouts = wanted(arguments).paths(&join.output);
                layouts.iter().flatten().for_each(|layout| plan.writes(layout.display()));
            }
        }
        plan.print();
    }
    bags.iter().for_each(|(_, file)| println!("and write {}", file.path().display()));
    Ok(Outcome::Done)
}

fn wanted(arguments: &Arguments) -> WantedLayouts {
    WantedLayouts { json: !arguments.no_layout, rerun: false }
}

/// The files that are read.
fn inputs<'a>(
    arguments: &'a Arguments,
    recordings: &'a [Vec<SliceFile>],
) -> impl Iterator<Item = &'a Path> {
    let slices = recordings.iter().flatten();
    let files = slices.flat_map(|file| [file.path.as_path(), file.slice.input.as_path()]);
    files.chain(arguments.plan.as_deref()).chain(arguments.input.as_deref())
}

/// What is written for each recording.
fn joins(
    arguments: &Arguments,
    recordings: &[Vec<SliceFile>],
    is_folder: bool,
) -> Result<Vec<Join>> {
    let mut outputs = Outputs::new(inputs(arguments, recordings), arguments.force);
    let wanted = wanted(arguments);
    let mut joins = Vec::new();
    for slices in recordings {
        let output = match is_folder {
            true => arguments.output.join(&slices[0].slice.name),
            false => arguments.output.clone(),
        };
        let is_kept = arguments.resume && output.exists();
        let files = match is_kept {
            true => None,
            false => Some((
                outputs.file_in_made_folder(&output)?,
                Layout::beside(&output, wanted, &mut outputs)?,
            )),
        };
        joins.push(Join { output, files });
    }
    Ok(joins)
}

/// The rosbag2 folders that the recordings are from, each with its `metadata.yaml` beside the
/// outputs.
fn bags(
    arguments: &Arguments,
    recordings: &[Vec<SliceFile>],
    joins: &[Join],
) -> Result<Vec<(Bag, OutputFile)>> {
    let mut outputs = Outputs::new(inputs(arguments, recordings), arguments.force);
    let folders = recordings.iter().zip(joins).filter_map(|(slices, join)| {
        Some((slices[0].slice.input.parent()?, join.output.parent()?))
    });
    let folders: BTreeSet<(&Path, &Path)> = folders.collect();
    let bags = folders.into_iter().filter(|(input, _)| input.join(METADATA_FILE).is_file());
    let bag = |(input, output): (&Path, &Path)| {
        Ok((Bag::open(input)?, outputs.file_again(&metadata_in(output))?))
    };
    bags.map(bag).collect()
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

fn one(
    arguments: &Arguments,
    slices: &[SliceFile],
    (file, layout): &(OutputFile, Layout),
) -> Result<AnnotationReport> {
    make_parent(file.path())?;
    let options = JoinOptions {
        input: arguments.input.clone(),
        force: file.force(),
        threads: arguments.threads.map_or(0, usize::from),
    };
    let progress = RecordingProgress::new("joining", &slices[0].slice.input);
    let report = join(slices, file.path(), &options, &mut |event| {
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
