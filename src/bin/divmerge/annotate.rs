//! `divmerge annotate`

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use divmerge::annotate::{Event, Flavor, Options, Report, TopicReport, annotate};
use divmerge::io::Compression;
use divmerge::view::Target;

use crate::arguments::{MethodArguments, Moment, moment, window};
use crate::terminal::{byte_bar, grouped};
use crate::viewer::{self, Watcher};
use crate::{Outcome, interrupt, profile};

/// Write a recording again with instances in it
///
/// Every message, channel, schema, attachment and metadata record is kept as it is. Each cloud topic T
/// gains T/instances (the same cloud in the same messages, with instance, component, semantic, reason and colours
/// behind its own fields) and, in ROS 2, T/objects (a box and a number per instance, as a MarkerArray). Chunks of the asked-for
/// compression are taken over as they are, byte for byte; what is added stands in chunks of its own.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP); it is never touched
    input: PathBuf,

    /// The annotated recording; it appears when it is complete
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Annotate only this cloud topic; may be given several times [default: all]
    #[arg(long = "topic", value_name = "T")]
    topics: Vec<String>,

    #[command(flatten)]
    method: MethodArguments,

    /// In which messages T/instances is written. `foxglove` is for recordings without ROS; in one of ROS 1 or 2 (its
    /// profile) ROS messages alone can stand, or ROS's own readers fail
    #[arg(long, value_enum, default_value_t = FlavorArgument::Auto)]
    flavor: FlavorArgument,

    /// Compression of the output
    #[arg(long, value_enum, default_value_t = Compress::Zstd)]
    compression: Compress,

    /// Leave out messages before this log time: seconds from the start (12.5) or since 1970
    /// (@1317384506.4)
    #[arg(long, value_name = "T", value_parser = moment)]
    from: Option<Moment>,

    /// Leave out messages from this log time on
    #[arg(long, value_name = "T", value_parser = moment)]
    to: Option<Moment>,

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
    crate::refuse_existing(&arguments.output, arguments.force)?;
    let (from_ns, to_ns) = window(&arguments.input, arguments.from, arguments.to)?;
    let options = Options {
        method: arguments.method.method(&arguments.input)?,
        topics: arguments.topics.clone(),
        flavor: arguments.flavor.into(),
        from_ns,
        to_ns,
        compression: arguments.compression.into(),
        force: arguments.force,
        threads: arguments.threads.map_or(0, usize::from),
    };
    let target = arguments.rerun.clone().map(|target| match target {
        Target::Save { path, .. } => Target::Save { path, force: arguments.force },
        other => other,
    });
    let mut viewer = Watcher::open(target.as_ref(), &arguments.input, &options.method)?;
    let bar = byte_bar("annotating");
    let report = annotate(&arguments.input, &arguments.output, &options, &mut |event| {
        match event {
            Event::Progress { bytes, total } => {
                bar.set_length(total);
                bar.set_position(bytes);
            }
            Event::Warning(warning) => {
                bar.suspend(|| eprintln!("warning: {}: {warning}", arguments.input.display()));
            }
            Event::Frame(frame) => viewer.show(&frame),
        }
        interrupt::wish()
    });
    bar.finish_and_clear();
    let report = report?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print(&report);
        if arguments.profile {
            profile::print(&report);
        }
    }
    viewer.finish()?;
    Ok(if report.is_complete() { Outcome::Done } else { Outcome::Incomplete })
}

/// One line per topic, the reasons below it, and the output.
pub fn print(report: &Report) {
    for (topic, report) in &report.topics {
        println!("{topic}: {}", summary(report));
        if report.frames > 0 {
            println!("    {}", how(report));
            println!("    points: {}", reasons(report));
        }
    }
    println!(
        "wrote {} ({} bytes, {} messages and {} annotations)",
        report.output.display(),
        grouped(report.output_bytes),
        grouped(report.messages),
        grouped(report.annotations),
    );
}

fn summary(report: &TopicReport) -> String {
    if report.frames + report.unreadable == 0 {
        return "no clouds".into();
    }
    let stages = &report.times.stages;
    let mut line = format!(
        "{} frames, {} points, {:.1} instances per frame, {:.1} ms per frame (decode {:.1}, \
             project {:.1}, mask {:.1}, divide {:.1}, merge {:.1}, label {:.1}, encode {:.1})",
        grouped(report.frames),
        grouped(report.points),
        report.instances as f64 / report.frames.max(1) as f64,
        report.times.total_ms(),
        report.times.decode_ms,
        stages.projection_ms,
        stages.mask_ms,
        stages.divide_ms,
        stages.merge_ms,
        stages.labels_ms,
        report.times.encode_ms,
    );
    if report.unreadable > 0 {
        line += &format!("; {} clouds could not be read", grouped(report.unreadable));
    }
    line
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
