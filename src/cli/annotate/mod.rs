//! `divmerge annotate`

mod plan;
mod profile;
mod tasks;
mod types;

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use clap::Args;

use tasks::{CheckedTask, CheckedTasks, Tasks};
use types::{FLAVORS, OBJECT_CHOICES, ObjectChoice, message_types};

use crate::annotate::time_spec::TimeSpec;
use crate::annotate::{
    AnnotateOptions, AnnotationReport, Flavor, Form, Slice, annotate, slices::Plan,
};
use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::selection::window;
use crate::cli::arguments::tracks::TrackArguments;
use crate::cli::arguments::truth::SourceArguments;
use crate::cli::arguments::values::{COMPRESSIONS, one_of};
use crate::cli::dry_run::DryRunArgument;
use crate::cli::exit::{Outcome, contradict, error_chain};
use crate::cli::layout::{Layout, WantedLayouts};
use crate::cli::output::{Outputs, make_parent};
use crate::cli::progress::RecordingProgress;
use crate::cli::text::counted;
use crate::cli::viewer::{self, Watcher};
use crate::cli::{interrupt, report, terminal};
use crate::recording::{Compression, STANDARD_STREAM};
use crate::view::Target;

/// Write a recording again with object instances
///
/// Keeps every message, channel, schema, attachment and metadata record as it is. Each cloud topic
/// T gains T/instances (the same clouds in the same message type, with the additional fields
/// instance, component, semantic, reason and colours) and T/objects (a numbered box for each
/// object, in the type of --objects). Chunks with the output's compression are copied byte for
/// byte; annotations are written to chunks of their own.
#[derive(Args)]
pub struct Arguments {
    /// Recordings (MCAP), or rosbag2 folders with a metadata.yaml; they are never changed. `-`
    /// reads one from standard input. With --slice: where the recording is, if it has moved since
    /// it was planned
    #[arg(value_name = "IN", required_unless_present = "slice")]
    inputs: Vec<PathBuf>,

    /// The annotated recording; it appears when it is complete. For several recordings and for a
    /// rosbag2 folder, a folder in which each recording keeps its name; a rosbag2 folder also gets
    /// a metadata.yaml. With --slice, a folder; the slice has a name of its own. `-` writes to
    /// standard output
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Annotate only this cloud topic; may be repeated [default: all]
    #[arg(long = "topic", value_name = "T")]
    topics: Vec<String>,

    #[command(flatten)]
    method: MethodArguments,

    #[command(flatten)]
    tracks: TrackArguments,

    #[command(flatten)]
    truth: SourceArguments,

    /// Boxes on T/objects: their type, `all` for those of background too, or both (detection3d,all)
    /// [default: objects alone, in what viewers draw: markers, or a SceneUpdate beside Foxglove's
    /// clouds]. Without classes, background is what looks like no person and no vehicle; with
    /// classes every instance is an object
    #[arg(long, value_name = "TYPE|all", value_parser = one_of(OBJECT_CHOICES))]
    #[arg(value_delimiter = ',')]
    objects: Vec<ObjectChoice>,

    /// Message types of T/instances and T/objects. `foxglove` is for recordings without ROS: in a
    /// recording with the profile ros1 or ros2, ROS readers fail on other messages
    #[arg(long, default_value = "auto", value_parser = one_of(FLAVORS))]
    flavor: Flavor,

    /// Compression of the output [default: that of most input chunks, which are then copied]
    #[arg(long, value_parser = one_of(COMPRESSIONS))]
    compression: Option<Compression>,

    /// Copy chunks without clouds, by the recording's index, without checking them. This is faster
    /// if clouds are a small part of the recording; but a damaged chunk is copied as it is, and
    /// only a reader that verifies checksums notices
    #[arg(long)]
    unchecked: bool,

    /// Leave out messages before this log time: seconds from the start (12.5), since 1970
    /// (@1317384506.4), a date (2011-09-30T12:28:26Z), or that of a cloud (frame:100, of the first
    /// annotated topic). With a sound index, the rest of the recording is not read
    #[arg(long, value_name = "T", value_parser = TimeSpec::from_str)]
    from: Option<TimeSpec>,

    /// Leave out messages from this log time on
    #[arg(long, value_name = "T", value_parser = TimeSpec::from_str)]
    to: Option<TimeSpec>,

    /// Annotate one slice of a plan (`divmerge plan`), numbered from 0: plan.json:3. `divmerge
    /// join` puts slices together
    #[arg(long, value_name = "PLAN:N", value_parser = slice)]
    #[arg(conflicts_with_all = ["assemble", "dry_run"])]
    slice: Option<PlannedSlice>,

    /// Do not write OUT.layout.json, a layout for Lichtblick and Foxglove that shows clouds and
    /// boxes in colour
    #[arg(long)]
    no_layout: bool,

    /// Also write OUT.rbl, a blueprint for `rerun OUT OUT.rbl`, with which Rerun shows the
    /// instances in colour and not the clouds over them. It is in a binary form that Rerun's own
    /// library writes: needs a divmerge built with `--features rerun`
    #[arg(long, conflicts_with = "slice")]
    blueprint: bool,

    /// Write only T/instances and T/objects: a small recording to open beside the input
    #[arg(long, conflicts_with = "in_place_fields")]
    only: bool,

    /// Add the fields to the clouds of T instead of writing T/instances
    #[arg(long)]
    in_place_fields: bool,

    /// Continue a run that was interrupted (Ctrl-C, killed, power failure) with the same output.
    /// Finished clouds are not clustered again, and the output is that of an uninterrupted run.
    /// With several recordings, those whose output exists are skipped
    #[arg(long, conflicts_with_all = ["force", "assemble"])]
    resume: bool,

    /// Replace an existing output
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    dry_run: DryRunArgument,

    /// Threads that decompress, cluster and compress, beside the one that reads and writes; with 1,
    /// one thread does everything. The output does not depend on it; each thread takes about 40 MB
    /// [default: the number of cores, at most 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// Print the time of each stage, and the slowest frames
    #[arg(long)]
    profile: bool,

    /// Show every frame in the Rerun viewer as it is annotated, with the truth where clouds have
    /// it: write to a file (F.rrd), send to a running viewer
    /// (rerun+http://127.0.0.1:9876/proxy), or start one (spawn); needs a divmerge built with
    /// `--features rerun`
    #[arg(long, value_name = "TARGET", value_parser = viewer::target)]
    rerun: Option<Target>,

    /// Print the report as JSON
    #[arg(long, conflicts_with = "dry_run")]
    json: bool,
}

/// A slice of a plan.
#[derive(Clone)]
struct PlannedSlice {
    plan: PathBuf,
    number: usize,
}

/// Reads `plan.json:3`.
fn slice(text: &str) -> Result<PlannedSlice, String> {
    let (plan, number) = text.rsplit_once(':').unwrap_or_default();
    match (plan, number.parse()) {
        ("", _) | (_, Err(_)) => Err("use the plan and a number from 0, as in plan.json:3".into()),
        (plan, Ok(number)) => Ok(PlannedSlice { plan: plan.into(), number }),
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    if let Some(planned) = &arguments.slice {
        return one_slice(arguments, planned);
    }
    let mut tasks = Tasks::new(&arguments.inputs, &arguments.output)?;
    let done = if arguments.resume { tasks.skip_finished() } else { Vec::new() };
    let read = tasks.inputs();
    let inputs = read.iter().map(PathBuf::as_path).chain(arguments.method.files());
    let mut outputs = Outputs::new(inputs, arguments.force);
    check_stream(arguments, &mut outputs)?;
    let tasks = tasks.check(&mut outputs, layouts(arguments))?;
    if arguments.dry_run.dry_run {
        for task in &tasks.tasks {
            print!("{}", plan_of(arguments, task)?);
        }
        return Ok(Outcome::Done);
    }
    tasks.make_folders()?;
    match tasks.tasks.as_slice() {
        [task] if !tasks.has_folder => {
            let report = one(arguments, task, None)?;
            print_json(arguments, task, &report)?;
            let is_seen = !arguments.json && !terminal::is_quiet();
            if is_seen && task.output.path() != STANDARD_STREAM {
                eprintln!("to look at it: {}", task.layout.how_to_look(&report));
            }
            Ok(Outcome::of(report.is_complete()))
        }
        _ => several(arguments, &tasks, done),
    }
}

/// What would be done to a recording.
fn plan_of(arguments: &Arguments, task: &CheckedTask) -> Result<String> {
    let options = options(arguments, &task.input)?;
    plan::text(task, &options, layouts(arguments))
}

fn layouts(arguments: &Arguments) -> WantedLayouts {
    WantedLayouts { json: !arguments.no_layout, rerun: arguments.blueprint }
}

/// Annotates a slice of a plan.
fn one_slice(arguments: &Arguments, planned: &PlannedSlice) -> Result<Outcome> {
    let mut slices = Plan::read(&planned.plan)?.slices;
    if planned.number >= slices.len() {
        let (plan, count) = (planned.plan.display(), counted(slices.len() as u64, "slice"));
        contradict!("{plan}: no slice {}; it has {count}, numbered from 0", planned.number);
    }
    let slice = slices.swap_remove(planned.number);
    let input = match arguments.inputs.as_slice() {
        [] => slice.input.clone(),
        [input] => input.clone(),
        _ => contradict!("--slice takes one recording at most"),
    };
    let output = arguments.output.join(slice.file_name());
    if arguments.resume && output.exists() {
        println!("{} already exists", output.display());
        return Ok(Outcome::Done);
    }
    let inputs = [input.as_path(), &planned.plan].into_iter().chain(arguments.method.files());
    let mut outputs = Outputs::new(inputs, arguments.force);
    check_stream(arguments, &mut outputs)?;
    let file = outputs.file_in_made_folder(&output)?;
    let no_layouts = WantedLayouts { json: false, rerun: false };
    let layout = Layout::beside(&output, no_layouts, &mut outputs)?;
    make_parent(&output)?;
    let task = CheckedTask { input: input.clone(), output: file, layout };
    let report = one(arguments, &task, Some(slice))?;
    print_json(arguments, &task, &report)?;
    Ok(Outcome::of(report.is_complete()))
}

/// Checks what is written for Rerun.
fn check_stream(arguments: &Arguments, outputs: &mut Outputs) -> Result<()> {
    if arguments.blueprint {
        viewer::require_built().context(
            "--blueprint: the layout is in Rerun's own binary form, which its library alone writes",
        )?;
        if arguments.output == Path::new(STANDARD_STREAM) {
            contradict!("--blueprint is written beside a file: name one with -o");
        }
    }
    if arguments.truth.is_said() && arguments.rerun.is_none() {
        contradict!("the truth is shown in Rerun alone: say where with --rerun");
    }
    if let Some(Target::Save { path, .. }) = &arguments.rerun {
        outputs.file(path)?;
    }
    Ok(())
}

fn print_json(arguments: &Arguments, task: &CheckedTask, report: &AnnotationReport) -> Result<()> {
    match arguments.json {
        true => print(task, &(serde_json::to_string_pretty(report)? + "\n")),
        false => Ok(()),
    }
}

/// Annotates one recording after the other. If one fails, the others are annotated all the same.
fn several(arguments: &Arguments, tasks: &CheckedTasks, done: Vec<PathBuf>) -> Result<Outcome> {
    let (mut reports, mut made, mut failed) = (Vec::new(), done, Vec::new());
    let all = made.len() + tasks.tasks.len();
    for task in &tasks.tasks {
        match one(arguments, task, None) {
            Ok(report) => {
                made.push(task.output.path().to_owned());
                reports.push(report);
            }
            Err(error) if interrupt::check().is_break() => return Err(error),
            Err(error) => {
                eprintln!("error: {}", error_chain(&error));
                failed.push(task.input.display().to_string());
            }
        }
    }
    let written = tasks.finish(&made)?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&reports)?);
    } else {
        for path in written {
            println!("wrote {}", path.display());
        }
        println!("annotated {} of {}", made.len(), counted(all as u64, "recording"));
    }
    if !failed.is_empty() {
        bail!("not annotated: {}", failed.join(", "));
    }
    Ok(Outcome::of(reports.iter().all(AnnotationReport::is_complete)))
}

/// Annotates a recording and prints the report, unless it is printed as JSON later.
fn one(
    arguments: &Arguments,
    task: &CheckedTask,
    slice: Option<Slice>,
) -> Result<AnnotationReport> {
    let (input, output) = (task.input.as_path(), task.output.path());
    let options = AnnotateOptions { slice, ..options(arguments, input)? };
    let target = arguments.rerun.clone().map(|target| match target {
        Target::Save { path, .. } => Target::Save { path, force: arguments.force },
        other => other,
    });
    let follows = options.tracks.applies_to(&options.config);
    let mut viewer = Watcher::open(target.as_ref(), input, (&options.config, follows))?;
    if terminal::is_verbose() && input != STANDARD_STREAM && options.slice.is_none() {
        eprint!("{}", plan::text(task, &options, layouts(arguments))?);
    }
    let progress = RecordingProgress::new("annotating", input);
    interrupt::is_writing(output);
    let report = annotate(input, output, &options, &mut |event| {
        progress.show(&event);
        viewer.show(&event);
        interrupt::check()
    })?;
    drop(progress);
    task.layout.write(&report)?;
    if !arguments.json && !terminal::is_quiet() {
        print(task, &report::text(&report))?;
        if arguments.profile || terminal::is_verbose() {
            print(task, &profile::text(&report))?;
        }
    }
    viewer.finish()?;
    Ok(report)
}

fn options(arguments: &Arguments, input: &Path) -> Result<AnnotateOptions> {
    let moments = (arguments.from, arguments.to);
    let (from_ns, to_ns) = window(input, moments, &arguments.topics)?;
    Ok(AnnotateOptions {
        config: arguments.method.config(input)?,
        types: message_types(arguments.flavor, &arguments.objects),
        topics: arguments.topics.clone(),
        from_ns,
        to_ns,
        compression: arguments.compression,
        tracks: arguments.tracks.options(&arguments.method.parameters_over_time()?),
        slice: None,
        unchecked: arguments.unchecked,
        form: match (arguments.only, arguments.in_place_fields) {
            (true, _) => Form::Only,
            (_, true) => Form::InPlace,
            _ => Form::Beside,
        },
        resume: arguments.resume,
        resumable: true,
        force: arguments.force,
        shown_truth: arguments
            .rerun
            .is_some()
            .then(|| (arguments.truth.source(), arguments.truth.is_said())),
        threads: arguments.threads.map_or(0, usize::from),
    })
}

/// Prints to standard output, or to stderr if the recording goes to standard output.
fn print(task: &CheckedTask, text: &str) -> Result<()> {
    match task.output.path() == STANDARD_STREAM {
        true => eprint!("{text}"),
        false => print!("{text}"),
    }
    terminal::flush();
    Ok(())
}
