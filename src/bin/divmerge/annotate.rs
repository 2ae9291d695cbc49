//! `divmerge annotate`

pub mod tasks;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use divmerge::annotate::moments::Moment;
use divmerge::annotate::{
    Event, Flavor, Form, FrameTimes, INSTANCES, MessageTypes, OBJECTS, Options, Report, Slice,
    TopicReport, annotate, slices::Plan,
};
use divmerge::io::{Compression, ObjectKind, STANDARD_STREAM, write_file};
use divmerge::view::{ShownTopic, Target, viewer_layout};

use crate::arguments::{MethodArguments, window};
use crate::terminal::{byte_bar, grouped};
use crate::viewer::{self, Watcher};
use crate::{Outcome, interrupt, profile, told};
use tasks::{Task, Tasks};

/// Write a recording again with instances in it
///
/// Every message, channel, schema, attachment and metadata record is kept as it is. Each cloud topic T
/// gains T/instances (the same cloud in the same messages, with instance, component, semantic, reason and colours
/// behind its own fields) and T/objects (a box and a number per instance; --objects has the types). Chunks of the output's
/// compression are taken over as they are, byte for byte; what is added stands in chunks of its own.
#[derive(Args)]
pub struct Arguments {
    /// The recordings (MCAP), or folders of rosbag2 with a metadata.yaml; they are never touched. `-` reads one from
    /// standard input. Of a slice: where the recording is, if not where it was planned
    #[arg(value_name = "IN", required_unless_present = "slice")]
    inputs: Vec<PathBuf>,

    /// The annotated recording; it appears when it is complete. For several recordings, and for a folder of rosbag2, a
    /// folder: each keeps its name there, and a metadata.yaml is written beside those of a bag. A slice goes into this
    /// folder under a name of its own. `-` writes to standard output
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Annotate only this cloud topic; may be given several times [default: all]
    #[arg(long = "topic", value_name = "T")]
    topics: Vec<String>,

    #[command(flatten)]
    method: MethodArguments,

    /// Type of the boxes on T/objects [default: what viewers draw: markers, beside Foxglove's clouds a SceneUpdate]
    #[arg(long, value_enum, value_name = "TYPE")]
    objects: Option<Objects>,

    /// In which messages T/instances and T/objects are written. `foxglove` is for recordings without ROS; in one of ROS 1 or 2 (its
    /// profile) ROS messages alone can stand, or ROS's own readers fail
    #[arg(long, value_enum, default_value_t = FlavorArgument::Auto)]
    flavor: FlavorArgument,

    /// Compression of the output [default: that of most chunks of the input, which then stay as they are]
    #[arg(long, value_enum)]
    compression: Option<Compress>,

    /// Take over chunks in which, by the recording's own index, is nothing to annotate without opening them. Quicker
    /// where clouds are a small part; but such a chunk, if it is damaged, is as damaged in the output, which only a
    /// reader that looks at its checksum will notice
    #[arg(long)]
    unchecked: bool,

    /// Leave out messages before this log time: seconds from the start (12.5), since 1970 (@1317384506.4), a date
    /// (2011-09-30T12:28:26Z), or that of a cloud (frame:100, of the first topic annotated). Where the recording has a
    /// sound index, what lies outside is not even read
    #[arg(long, value_name = "T", value_parser = Moment::from_str)]
    from: Option<Moment>,

    /// Leave out messages from this log time on
    #[arg(long, value_name = "T", value_parser = Moment::from_str)]
    to: Option<Moment>,

    /// Annotate one slice of a plan (`divmerge plan`), numbered from 0: plan.json:3. `divmerge join` puts slices together
    #[arg(long, value_name = "PLAN:N", value_parser = slice)]
    slice: Option<PlanAndNumber>,

    /// Write no layout for Lichtblick and Foxglove beside the output (OUT.layout.json, which shows clouds and boxes
    /// in colour once it is imported there)
    #[arg(long)]
    no_layout: bool,

    /// Write T/instances and T/objects alone: a small recording to be opened beside the input
    #[arg(long, conflicts_with = "in_place_fields")]
    only: bool,

    /// Put the fields into the clouds of T themselves, in place of a topic T/instances
    #[arg(long)]
    in_place_fields: bool,

    /// Go on where a run was cut off (Ctrl-C, killed, power lost) that was to write the same output: clouds that it had
    /// clustered are not clustered again, and the output is the same as without a cut. Of several recordings, those whose
    /// output is there already are left out
    #[arg(long, conflicts_with = "force")]
    resume: bool,

    /// Replace an existing output
    #[arg(long)]
    force: bool,

    /// Threads that decompress, cluster and compress, besides the one that reads and writes; with 1 everything
    /// happens one thing after the other. The output is the same, memory grows by 40 MB each [default: one for each
    /// core, 8 at most]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// Print what each stage took, and the slowest frames
    #[arg(long)]
    profile: bool,

    /// Show every frame in the Rerun viewer as it is annotated: into a file (F.rrd), to a viewer that is
    /// running (rerun+http://127.0.0.1:9876/proxy), or to one that is started (spawn)
    #[arg(long, value_name = "TARGET", value_parser = viewer::target)]
    rerun: Option<Target>,

    /// Print the report as JSON
    #[arg(long)]
    json: bool,
}

/// A slice of a plan.
#[derive(Clone)]
struct PlanAndNumber {
    plan: PathBuf,
    number: usize,
}

/// Reads `plan.json:3`.
fn slice(text: &str) -> Result<PlanAndNumber, String> {
    let (plan, number) = text.rsplit_once(':').unwrap_or_default();
    match (plan, number.parse()) {
        ("", _) | (_, Err(_)) => Err("use the plan and a number from 0, as in plan.json:3".into()),
        (plan, Ok(number)) => Ok(PlanAndNumber { plan: plan.into(), number }),
    }
}

/// Types of messages that hold boxes.
#[derive(Clone, Copy, ValueEnum)]
enum Objects {
    /// visualization_msgs/MarkerArray: what viewers draw
    Markers,
    /// vision_msgs/Detection3DArray: boxes with classes, for programs
    Detection3d,
    /// autoware_perception_msgs/DetectedObjects: boxes with Autoware's classes (ROS 2)
    Autoware,
}

impl From<Objects> for ObjectKind {
    fn from(objects: Objects) -> Self {
        match objects {
            Objects::Markers => ObjectKind::Markers,
            Objects::Detection3d => ObjectKind::Detection3d,
            Objects::Autoware => ObjectKind::Autoware,
        }
    }
}

/// In which messages an annotation is written.
#[derive(Clone, Copy, ValueEnum)]
enum FlavorArgument {
    /// As each topic's clouds are
    Auto,
    /// foxglove.PointCloud in protobuf
    Foxglove,
}

impl From<FlavorArgument> for Flavor {
    fn from(flavor: FlavorArgument) -> Self {
        match flavor {
            FlavorArgument::Auto => Flavor::Auto,
            FlavorArgument::Foxglove => Flavor::Foxglove,
        }
    }
}

/// Compression of a recording's chunks.
#[derive(Clone, Copy, ValueEnum)]
pub enum Compress {
    /// Zstandard, level 1
    Zstd,
    /// LZ4: larger files, quicker
    Lz4,
    /// None
    None,
}

impl From<Compress> for Compression {
    fn from(compress: Compress) -> Self {
        match compress {
            Compress::Zstd => Compression::Zstd,
            Compress::Lz4 => Compression::Lz4,
            Compress::None => Compression::None,
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    if let Some(wanted) = &arguments.slice {
        return one_slice(arguments, wanted);
    }
    let mut tasks = Tasks::new(&arguments.inputs, &arguments.output)?;
    let done = if arguments.resume { tasks.leave_out_done() } else { Vec::new() };
    tasks.prepare(arguments.force)?;
    match tasks.tasks.as_slice() {
        [task] if !tasks.has_folder => {
            let report = one(arguments, task, None)?;
            tell_json(arguments, task, &report)?;
            Ok(outcome(&report))
        }
        _ => several(arguments, &tasks, done),
    }
}

/// Annotates a slice of a plan.
fn one_slice(arguments: &Arguments, wanted: &PlanAndNumber) -> Result<Outcome> {
    let mut slices = Plan::read(&wanted.plan)?.slices;
    if wanted.number >= slices.len() {
        let (plan, count) = (wanted.plan.display(), slices.len());
        bail!("{plan} has {count} slices, numbered from 0: there is no {}", wanted.number);
    }
    let slice = slices.swap_remove(wanted.number);
    let input = match arguments.inputs.as_slice() {
        [] => slice.input.clone(),
        [input] => input.clone(),
        _ => bail!("a slice is of one recording"),
    };
    let output = arguments.output.join(slice.file_name());
    let task = Task { input, output };
    if arguments.resume && task.output.exists() {
        println!("{} is there already", task.output.display());
        return Ok(Outcome::Done);
    }
    crate::refuse_existing(&task.output, arguments.force)?;
    if let Some(folder) = task.output.parent() {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let report = one(arguments, &task, Some(slice))?;
    tell_json(arguments, &task, &report)?;
    Ok(outcome(&report))
}

fn tell_json(arguments: &Arguments, task: &Task, report: &Report) -> Result<()> {
    match arguments.json {
        true => tell(task, &(serde_json::to_string_pretty(report)? + "\n")),
        false => Ok(()),
    }
}

/// Annotates one recording after the other; one that fails does not keep the others from it.
fn several(arguments: &Arguments, tasks: &Tasks, done: Vec<PathBuf>) -> Result<Outcome> {
    let (mut reports, mut made, mut failed) = (Vec::new(), done, Vec::new());
    let all = made.len() + tasks.tasks.len();
    for task in &tasks.tasks {
        match one(arguments, task, None) {
            Ok(report) => {
                made.push(task.output.clone());
                reports.push(report);
            }
            Err(error) if interrupt::wish().is_break() => return Err(error),
            Err(error) => {
                eprintln!("error: {}", told(&error));
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
        println!("{} of {all} recordings annotated", made.len());
    }
    if !failed.is_empty() {
        bail!("not annotated: {}", failed.join(", "));
    }
    let is_whole = reports.iter().all(Report::is_complete);
    Ok(if is_whole { Outcome::Done } else { Outcome::Incomplete })
}

pub fn outcome(report: &Report) -> Outcome {
    if report.is_complete() { Outcome::Done } else { Outcome::Incomplete }
}

/// Annotates a recording and says what was done, unless that is to be said as JSON.
fn one(arguments: &Arguments, task: &Task, slice: Option<Slice>) -> Result<Report> {
    let input = task.input.as_path();
    let has_layout = !arguments.no_layout && slice.is_none();
    let options = Options { slice, ..options(arguments, input)? };
    let layout = Layout::beside(&task.output, has_layout, arguments.force)?;
    let target = arguments.rerun.clone().map(|target| match target {
        Target::Save { path, .. } => Target::Save { path, force: arguments.force },
        other => other,
    });
    let mut viewer = Watcher::open(target.as_ref(), input, &options.method)?;
    let bar = byte_bar("annotating");
    interrupt::is_writing(&task.output);
    let report = annotate(input, &task.output, &options, &mut |event| {
        match event {
            Event::Progress { bytes, total } => {
                bar.set_length(total.max(bytes));
                bar.set_position(bytes);
            }
            Event::Warning(warning) => {
                bar.suspend(|| eprintln!("warning: {}: {warning}", input.display()));
            }
            Event::Frame(frame) => viewer.show(&frame),
        }
        interrupt::wish()
    });
    bar.finish_and_clear();
    let report = report?;
    layout.write(&report)?;
    if !arguments.json {
        tell(task, &text(&report))?;
        if arguments.profile {
            tell(task, &profile::text(&report))?;
        }
    }
    viewer.finish()?;
    Ok(report)
}

fn options(arguments: &Arguments, input: &Path) -> Result<Options> {
    let moments = (arguments.from, arguments.to);
    let (from_ns, to_ns) = window(input, moments, &arguments.topics)?;
    Ok(Options {
        method: arguments.method.method(input)?,
        types: MessageTypes {
            flavor: arguments.flavor.into(),
            objects: arguments.objects.map(ObjectKind::from),
        },
        topics: arguments.topics.clone(),
        from_ns,
        to_ns,
        compression: arguments.compression.map(Compression::from),
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
        threads: arguments.threads.map_or(0, usize::from),
    })
}

/// For people: on standard output, unless the recording goes there.
fn tell(task: &Task, text: &str) -> Result<()> {
    match task.output.as_path() == STANDARD_STREAM {
        true => eprint!("{text}"),
        false => print!("{text}"),
    }
    Ok(io::stdout().flush()?)
}

/// Prints what was done.
pub fn print(report: &Report) {
    print!("{}", text(report));
}

/// The layout for viewers beside an output.
pub struct Layout {
    /// Where it goes, if it is written.
    path: Option<PathBuf>,
    force: bool,
}

impl Layout {
    /// The layout beside an output, if there is to be one.
    pub fn beside(output: &Path, is_wanted: bool, force: bool) -> Result<Self> {
        let is_wanted = is_wanted && output != STANDARD_STREAM;
        let path = is_wanted.then(|| output.with_extension("layout.json"));
        if let Some(path) = &path {
            crate::refuse_existing(path, force)?;
        }
        Ok(Layout { path, force })
    }

    /// Writes it.
    pub fn write(&self, report: &Report) -> Result<()> {
        if let Some(path) = &self.path {
            write_file(path, viewer_layout(&shown(report)).as_bytes(), self.force)?;
        }
        Ok(())
    }
}

/// The topics that viewers are to show.
fn shown(report: &Report) -> Vec<ShownTopic> {
    let topic = |(topic, of_topic): (&String, &TopicReport)| ShownTopic {
        cloud: topic.clone(),
        instances: match report.form == Form::InPlace.describe() {
            true => topic.clone(),
            false => format!("{topic}{INSTANCES}"),
        },
        objects: format!("{topic}{OBJECTS}"),
        has_packed_colours: !of_topic.format.is_foxglove(),
        frame_id: of_topic.frame_id.clone(),
    };
    report.topics.iter().map(topic).collect()
}

/// One line per topic, the reasons below it, and the output.
fn text(report: &Report) -> String {
    let mut text = String::new();
    for (topic, report) in &report.topics {
        text += &format!("{topic}: {}\n", summary(report));
        if report.frames > 0 {
            text += &format!("    {}\n    points: {}\n", how(report), reasons(report));
        }
    }
    text += &format!(
        "wrote {} ({} bytes, {} messages and {} annotations)\n",
        report.output.display(),
        grouped(report.output_bytes),
        grouped(report.messages),
        grouped(report.annotations),
    );
    text
}

fn summary(report: &TopicReport) -> String {
    if report.frames + report.unreadable == 0 {
        return "no clouds".into();
    }
    let mut line = format!(
        "{} frames, {} points, {:.1} instances per frame",
        grouped(report.frames),
        grouped(report.points),
        report.instances as f64 / report.frames.max(1) as f64,
    );
    if report.frames > report.resumed {
        line += &times(&report.times);
    }
    if report.unreadable > 0 {
        line += &format!("; {} clouds could not be read", grouped(report.unreadable));
    }
    line
}

fn times(times: &FrameTimes) -> String {
    let FrameTimes { decode_ms, semantics_ms, stages, encode_ms } = times;
    let classes = match semantics_ms {
        0.0 => String::new(),
        ms => format!(", classes {ms:.1}"),
    };
    format!(
        ", {:.1} ms per frame (decode {decode_ms:.1}{classes}, project {:.1}, mask {:.1}, divide {:.1}, \
         merge {:.1}, label {:.1}, encode {encode_ms:.1})",
        times.total_ms(),
        stages.projection_ms,
        stages.mask_ms,
        stages.divide_ms,
        stages.merge_ms,
        stages.labels_ms,
    )
}

fn how(report: &TopicReport) -> String {
    let join = |counts: &std::collections::BTreeMap<String, u64>| {
        let all = |count: u64| count == report.frames;
        let each = counts.iter().map(|(what, &count)| {
            if all(count) { what.clone() } else { format!("{what} ({count} frames)") }
        });
        each.collect::<Vec<_>>().join("; ")
    };
    let images = match report.projection.len() {
        0..=3 => join(&report.projection),
        sizes => format!("range images of {sizes} sizes"),
    };
    format!("objects from {}; rows from {images}", join(&report.semantics))
}

fn reasons(report: &TopicReport) -> String {
    let share = |count: u64| 100.0 * count as f64 / report.points.max(1) as f64;
    let each = divmerge::instances::Reason::ALL.iter().filter_map(|reason| {
        let count = *report.reasons.get(reason.describe()).filter(|&&count| count > 0)?;
        Some(format!("{} {} ({:.1} %)", grouped(count), reason.describe(), share(count)))
    });
    each.collect::<Vec<_>>().join(", ")
}
