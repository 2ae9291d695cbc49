//! `divmerge explain`

use std::ops::Range;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::error::ErrorKind;
use clap::{ArgGroup, Args};

use crate::annotate::{AnnotateConfig, FollowedDrive, TrackOptions};
use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::tracks::FollowArguments;
use crate::cli::arguments::values::{THEMES, one_of, position, positive, range};
use crate::cli::exit::{NotThere, Outcome, WrongUsage, contradict};
use crate::cli::followed::followed_drive;
use crate::cli::output::{OutputFile, Outputs, picture, rrd};
use crate::cli::viewer;
use crate::diagnose::explain::{
    ClusteredCloud, ExplanationReport, ExplanationText, Subject, distances, nearest_points,
    return_at, what_if,
};
use crate::diagnose::frame_links::FrameExplanation;
use crate::diagnose::track::{TrackExplanation, TrackText};
use crate::frames::{CloudAt, EncodedCloud, encoded_cloud_at};
use crate::pipeline;
use crate::view::{self, FrameScene, Target, Theme, explained_scene, explanation_report};

/// Explain why two points are one instance or not, or what one point belongs to
///
/// Shows the pixels and components of the points; the merges between them with the votes in favour
/// (V+) and against (V-), and the pixel pairs that cast the votes; what the later stages did; and
/// the smallest change of each single parameter that gives the other answer. Without classes: the
/// nodes of the tree of merges that hold the points, the terms of their scores, and what was
/// chosen.
#[derive(Args)]
#[command(group = ArgGroup::new("over_time").args(["track", "link"]).multiple(true))]
pub struct Arguments {
    /// The recording (MCAP)
    input: PathBuf,

    /// Cloud topic [default: the first readable one]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Number of the cloud on its topic, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u64,

    /// A point in metres in the cloud's own frame; once to explain it, twice to compare two points
    #[arg(long, value_name = "X,Y,Z", value_parser = position, allow_hyphen_values = true)]
    at: Vec<[f64; 3]>,

    /// An instance of this frame; twice, instead of two points
    #[arg(long, value_name = "ID", conflicts_with = "at")]
    instance: Vec<u32>,

    /// Explain an object over time instead: why its instances of different frames share the id, for
    /// which the frames of --frames are clustered and followed
    #[arg(long, value_name = "ID", conflicts_with_all = ["at", "instance", "output", "rerun"])]
    track: Option<u32>,

    /// The frame of the track that is explained in detail, with its alternatives; without --track
    /// why each instance of that frame is of its track
    #[arg(long, value_name = "N", conflicts_with_all = ["at", "instance", "output", "rerun"])]
    link: Option<u64>,

    /// Frames that are followed for --track and --link, as in 0..50 (without 50); ids are those of
    /// `annotate` if the frames begin at 0 [default: all]
    #[arg(long, value_name = "A..B", value_parser = range::<u64>, requires = "over_time")]
    frames: Option<Range<u64>>,

    #[command(flatten)]
    following: FollowArguments,

    /// Maximum distance of the nearest return from a requested point, metres
    #[arg(long, value_name = "M", default_value_t = 0.3, value_parser = positive)]
    within: f64,

    #[command(flatten)]
    method: MethodArguments,

    /// Maximum number of pixel pairs to list; --json has all of them
    #[arg(long, value_name = "N", default_value_t = 3)]
    pairs: usize,

    /// Do not search for parameter changes that give the other answer
    #[arg(long)]
    no_what_if: bool,

    /// Print as JSON
    #[arg(long)]
    json: bool,

    /// Also draw it, as .png, .svg or .pdf; without classes, with the tree of merges around the
    /// points
    #[arg(short, long, value_name = "OUT", value_parser = picture)]
    output: Option<PathBuf>,

    /// Panels of the picture for the screen or for print
    #[arg(long, value_name = "THEME", default_value = "dark", value_parser = one_of(THEMES))]
    theme: Theme,

    /// Also write it with its frame into a file for `rerun F.rrd`; needs a divmerge built with
    /// `--features rerun`
    #[arg(long, value_name = "F.rrd", value_parser = rrd)]
    rerun: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    check_usage(arguments)?;
    if arguments.rerun.is_some() {
        viewer::require_built()?;
    }
    let inputs = std::iter::once(arguments.input.as_path()).chain(arguments.method.files());
    let mut outputs = Outputs::new(inputs, arguments.force);
    let output = outputs.optional(arguments.output.as_deref())?;
    outputs.optional(arguments.rerun.as_deref())?;
    let method =
        arguments.method.config_with_warnings(&arguments.input, arguments.topic.as_slice())?;
    match (arguments.track, arguments.link) {
        (Some(track), _) => return explain_track(arguments, &method, track),
        (None, Some(frame)) => return explain_links(arguments, &method, frame),
        (None, None) => {}
    }
    if let Some(other) = &method.pipeline.other_method {
        contradict!(
            "{} has no votes or merges to explain; `divmerge figure --method {0}` draws its result",
            other.name()
        );
    }
    let (path, which) = (&arguments.input, CloudAt::Frame(arguments.frame));
    let message = encoded_cloud_at(path, arguments.topic.as_deref(), which, method.assemble)?;
    explain_message(arguments, &method, &message, output.as_ref())
        .with_context(|| format!("{}: {}", path.display(), message.describe()))?;
    Ok(Outcome::Done)
}

/// The drive whose objects are explained, and how they were followed.
fn drive(arguments: &Arguments, method: &AnnotateConfig) -> Result<(FollowedDrive, TrackOptions)> {
    let options = arguments.following.options(&arguments.method.parameters_over_time()?);
    let clouds = (arguments.topic.as_deref(), arguments.frames.clone());
    let drive = followed_drive(&arguments.input, clouds, (method, &options))?;
    Ok((drive, options))
}

/// Explains all instances of a frame over time.
fn explain_links(arguments: &Arguments, method: &AnnotateConfig, frame: u64) -> Result<Outcome> {
    let (drive, options) = drive(arguments, method)?;
    let Some(explanation) = FrameExplanation::of(&drive, frame, &options.params) else {
        let numbers = drive.clouds.iter().map(|cloud| cloud.number);
        let (first, last) = (numbers.clone().min().unwrap_or(0), numbers.max().unwrap_or(0));
        return Err(NotThere(format!(
            "frame {frame} of {} was not followed; frames {first} to {last} were",
            drive.topic
        ))
        .into());
    };
    match arguments.json {
        true => println!("{}", serde_json::to_string_pretty(&explanation)?),
        false => print!("{explanation}"),
    }
    Ok(Outcome::of(drive.unreadable == 0))
}

/// Explains an object over time.
fn explain_track(arguments: &Arguments, method: &AnnotateConfig, track: u32) -> Result<Outcome> {
    let (drive, options) = drive(arguments, method)?;
    let Some(explanation) = TrackExplanation::of(&drive, track, &options.params) else {
        let last = drive.tracks.last().map_or(0, |last| last.track);
        return Err(NotThere(format!(
            "no instance of {} is of track {track}; the objects have tracks up to {last}",
            drive.topic
        ))
        .into());
    };
    let is_there = |frame: &u64| explanation.links.iter().any(|link| link.cloud == *frame);
    if let Some(frame) = arguments.link.filter(|frame| !is_there(frame)) {
        return Err(NotThere(format!(
            "track {track} is not seen in frame {frame}; `divmerge explain --track {track}` lists \
             its frames"
        ))
        .into());
    }
    match arguments.json {
        true => println!("{}", serde_json::to_string_pretty(&explanation)?),
        false => print!("{}", TrackText { explanation: &explanation, link: arguments.link }),
    }
    Ok(Outcome::of(drive.unreadable == 0))
}

/// Clusters a cloud, explains the points and writes what was asked for.
fn explain_message(
    arguments: &Arguments,
    method: &AnnotateConfig,
    message: &EncodedCloud,
    output: Option<&OutputFile>,
) -> Result<()> {
    let wire = message.decode()?;
    let decoded = method.decode(&wire, &message.key(&wire))?;
    let (cloud, mask, config) = (&decoded.cloud, decoded.mask, &method.pipeline);
    let stages = pipeline::run(cloud, mask, config);
    let frame = ClusteredCloud { cloud, mask, config, stages: &stages };
    let report = requested(arguments, message, &decoded.semantics, &frame)?;
    match arguments.json {
        true => println!("{}", serde_json::to_string_pretty(&report)?),
        false => print!("{}", ExplanationText { report: &report, max_pairs: arguments.pairs }),
    }
    if let Some(output) = output {
        const DPI: f64 = 192.0;
        let scene = explained_scene(&frame, &report);
        let (scene, explanation) =
            (FrameScene { theme: arguments.theme, ..scene }, &report.explanation);
        let page = view::explanation(&scene, explanation, &explanation.headline(), DPI);
        let bytes = output.write_picture(&page, DPI)?;
        if !arguments.json {
            println!("\nwrote {} ({bytes} bytes)", output.path().display());
        }
    }
    if let Some(rrd) = &arguments.rerun {
        let target = Target::Save { path: rrd.clone(), force: arguments.force };
        let shown = crate::annotate::ClusteredFrame {
            key: message.key(&wire),
            header: message.header,
            cloud,
            stages: &stages,
            taxonomy: mask.taxonomy(),
            truth: None,
            remarks: &[],
        };
        let mut stream = viewer::open(&target, &report.file, (method, false))?;
        stream.log(&shown)?;
        let words = ExplanationText { report: &report, max_pairs: arguments.pairs }.to_string();
        stream.explain(&shown, &report.explanation, &words)?;
        stream.finish()?;
        if !arguments.json {
            println!("wrote {}", rrd.display());
        }
    }
    Ok(())
}

/// The explanation of the requested points.
fn requested(
    arguments: &Arguments,
    message: &EncodedCloud,
    semantics: &str,
    frame: &ClusteredCloud,
) -> Result<ExplanationReport> {
    // Positions are given in the recording's frame.
    let positions: Vec<[f64; 3]> =
        arguments.at.iter().map(|&at| frame.cloud.from_recorded(at)).collect();
    let subject = subject(arguments, &positions, frame)?;
    let report = explanation_report(&arguments.input, message, semantics, frame, subject);
    Ok(ExplanationReport {
        away: distances(&report.explanation.points, &positions),
        what_if: (!arguments.no_what_if).then(|| what_if(frame, subject)),
        ..report
    })
}

/// Refuses anything but one or two points, or two instances.
fn check_usage(arguments: &Arguments) -> Result<(), WrongUsage> {
    let problem = match (arguments.at.len(), arguments.instance.len()) {
        (1 | 2, 0) | (0, 2) => return Ok(()),
        (0, 0) if arguments.track.is_some() || arguments.link.is_some() => return Ok(()),
        (0, 0) => {
            "say what to explain: --at X,Y,Z once or twice, --instance ID twice, --track ID, \
                   or --link N"
                .into()
        }
        (points, 0) => format!("--at is given {points} times; give it once or twice"),
        (_, instances) => {
            let times = if instances == 1 { "once".into() } else { format!("{instances} times") };
            format!("--instance is given {times}; it takes two")
        }
    };
    Err(WrongUsage(ErrorKind::WrongNumberOfValues, problem))
}

fn subject(
    arguments: &Arguments,
    requested: &[[f64; 3]],
    frame: &ClusteredCloud,
) -> Result<Subject> {
    if let &[a, b] = &arguments.instance[..] {
        if a == b {
            contradict!("--instance {a} is given twice; give two different instances");
        }
        let (a, b) = nearest_points(frame, a, b)?;
        return Ok(Subject::Pair(a, b));
    }
    let at = |at: &[f64; 3]| return_at(frame.cloud, *at, arguments.within);
    let points = requested.iter().map(at).collect::<crate::Result<Vec<usize>>>()?;
    match points[..] {
        [a] => Ok(Subject::Point(a)),
        [a, b] if a == b => {
            contradict!("point {a} is the nearest to both --at; give two positions farther apart")
        }
        [a, b] => Ok(Subject::Pair(a, b)),
        _ => unreachable!("checked before"),
    }
}
