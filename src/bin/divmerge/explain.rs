//! `divmerge explain`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory};
use divmerge::annotate::Method;
use divmerge::explain::{Frame, PointFacts, Subject, explain, nearest_points, return_at, what_if};
use divmerge::io::{Which, cloud_message_at};
use divmerge::pipeline;
use divmerge::view::{self, ColourTracker, Scene, Target};

use crate::arguments::{MethodArguments, number, positive};
use crate::explain_text::{Report, Text};
use crate::figure::{picture, write};
use crate::{Outcome, viewer};

/// Say why two points are one instance or not, or why one point is what it is
///
/// Shows the points' pixels and components, the merges between them with the votes in favour (V+) and
/// against (V-) and the pairs of pixels that cast them, or where the votes failed; what the later stages
/// did; and the smallest change of each parameter alone that would give the other answer.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP)
    input: PathBuf,

    /// Cloud topic [default: the first that can be read]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Number of the cloud on its topic, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u64,

    /// A point in metres in the cloud's own frame; once to explain it, twice to compare two
    #[arg(long, value_name = "X,Y,Z", value_parser = position, allow_hyphen_values = true)]
    at: Vec<[f64; 3]>,

    /// An instance of this frame with these parameters; twice, in place of two points
    #[arg(long, value_name = "ID", conflicts_with = "at")]
    instance: Vec<u32>,

    /// How far the nearest return may be from a point asked for, metres
    #[arg(long, value_name = "M", default_value_t = 0.3, value_parser = positive)]
    within: f64,

    #[command(flatten)]
    method: MethodArguments,

    /// Most pairs of pixels to list; --json has them all
    #[arg(long, value_name = "N", default_value_t = 3)]
    pairs: usize,

    /// Do not look for changes of parameters that give the other answer
    #[arg(long)]
    no_what_if: bool,

    /// Print as JSON
    #[arg(long)]
    json: bool,

    /// Draw it too; the ending, .png or .svg, says which
    #[arg(short, long, value_name = "OUT", value_parser = picture)]
    output: Option<PathBuf>,

    /// Write it with its frame into a file that `rerun F.rrd` opens; needs a divmerge built with
    /// `--features rerun`
    #[arg(long, value_name = "F.rrd", value_parser = viewer::rrd)]
    rerun: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    check_usage(arguments);
    if arguments.rerun.is_some() {
        viewer::require_built()?;
    }
    for output in arguments.output.iter().chain(&arguments.rerun) {
        crate::refuse_existing(output, arguments.force)?;
    }
    let method = arguments.method.method(&arguments.input)?;
    if let Some(other) = &method.config.baseline {
        bail!(
            "{} has no votes or merges to explain; `divmerge figure --method {0}` draws what it cuts",
            other.name()
        );
    }
    let (path, which) = (&arguments.input, Which::Frame(arguments.frame));
    let message = cloud_message_at(path, arguments.topic.as_deref(), which)?;
    let place = || format!("{}: frame {} of {}", path.display(), message.number, message.topic);
    let wire = message.decode().with_context(place)?;
    let decoded = method.decode(&wire, message.which()).with_context(place)?;
    let (cloud, mask, config) = (&decoded.cloud, decoded.mask, &method.config);
    // Places are given in the recording's frame.
    let asked: Vec<[f64; 3]> = arguments.at.iter().map(|&at| cloud.from_recorded(at)).collect();
    let stages = pipeline::run(cloud, mask, config);
    let frame = Frame { cloud, mask, config, stages: &stages };

    let subject = subject(arguments, &asked, &frame).with_context(place)?;
    let explanation = explain(&frame, subject);
    let report = Report {
        file: path.clone(),
        topic: message.topic.clone(),
        frame: message.number,
        log_time_ns: message.log_time,
        preset: config.preset,
        semantics: decoded.semantics.clone(),
        instances: stages.instances.len(),
        away: explanation.points.iter().zip(&asked).map(away).collect(),
        votes_per_border_pair: 2,
        what_if: (!arguments.no_what_if).then(|| what_if(&frame, subject)),
        explanation,
    };
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print!("{}", Text { report: &report, pairs: arguments.pairs }.text());
    }
    if let Some(output) = &arguments.output {
        let bytes = draw(&report, &frame, output, arguments.force)?;
        if !arguments.json {
            println!();
            println!("wrote {} ({bytes} bytes)", output.display());
        }
    }
    if let Some(rrd) = &arguments.rerun {
        let target = Target::Save { path: rrd.clone(), force: arguments.force };
        let shown = divmerge::annotate::Frame {
            topic: &message.topic,
            number: message.number,
            log_time_ns: message.log_time,
            stamp_ns: wire.stamp_ns(),
            frame_id: &wire.frame_id,
            cloud,
            stages: &stages,
            remarks: &[],
        };
        stream(&report, &shown, &target, &method)?;
        if !arguments.json {
            println!("wrote {}", rrd.display());
        }
    }
    Ok(Outcome::Done)
}

/// Draws the explanation and returns the size of the picture in bytes.
fn draw(report: &Report, frame: &Frame, output: &Path, force: bool) -> Result<u64> {
    const DPI: f64 = 192.0;
    let Frame { cloud, config, stages, .. } = *frame;
    let scene = Scene {
        cloud,
        stages,
        classes: Vec::new(),
        intensity: None,
        merge_ratio: config.cluster.merge_ratio,
        colour_numbers: ColourTracker::default().colour_numbers(&stages.instances),
        heading: format!("frame {} of {}", report.frame, report.topic),
        remark: format!("objects: {}  ·  preset {}", report.semantics, report.preset),
    };
    let headline = Text { report, pairs: 0 }.headline();
    write(output, &view::explanation(&scene, &report.explanation, &headline, DPI), DPI, force)
}

/// Sends the frame and the explanation to the viewer's file.
fn stream(
    report: &Report,
    shown: &divmerge::annotate::Frame,
    target: &Target,
    method: &Method,
) -> Result<()> {
    let headline = Text { report, pairs: 0 }.headline();
    let mut stream = viewer::open(target, &report.file, method)?;
    stream.log(shown)?;
    stream.explain(shown, &report.explanation, &headline)?;
    Ok(stream.finish()?)
}

/// Ends the program with exit code 2 unless there are one or two points, or two instances.
fn check_usage(arguments: &Arguments) {
    let problem = match (arguments.at.len(), arguments.instance.len()) {
        (1 | 2, 0) | (0, 2) => return,
        (0, 0) => "say what to explain: --at X,Y,Z once or twice, or --instance ID twice".into(),
        (points, 0) => format!("--at is given {points} times; one or two points can be explained"),
        (_, instances) => format!("--instance is given {instances} times; it takes two"),
    };
    let mut command = crate::Cli::command();
    let command = command.find_subcommand_mut("explain").expect("this command");
    command.error(ErrorKind::WrongNumberOfValues, problem).exit()
}

fn subject(arguments: &Arguments, asked: &[[f64; 3]], frame: &Frame) -> Result<Subject> {
    if let &[a, b] = &arguments.instance[..] {
        if a == b {
            bail!("--instance {a} twice: name two different instances");
        }
        let (a, b) = nearest_points(frame, a, b)?;
        return Ok(Subject::Pair(a, b));
    }
    let at = |at: &[f64; 3]| return_at(frame.cloud, *at, arguments.within);
    let points = asked.iter().map(at).collect::<divmerge::Result<Vec<usize>>>()?;
    match points[..] {
        [a] => Ok(Subject::Point(a)),
        [a, b] if a == b => bail!("both --at lie nearest to the same point, number {a}"),
        [a, b] => Ok(Subject::Pair(a, b)),
        _ => unreachable!("checked before"),
    }
}

fn away((point, asked): (&PointFacts, &[f64; 3])) -> f64 {
    let along = |axis: usize| f64::from(point.position[axis]) - asked[axis];
    (0..3).map(|axis| along(axis).powi(2)).sum::<f64>().sqrt()
}

fn position(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(|part| number(part.trim()));
    let numbers = numbers.collect::<Result<Vec<f64>, String>>();
    let form = || "use x,y,z in metres, as in 12.5,-3.2,0.4".to_owned();
    numbers.map_err(|_| form())?.try_into().map_err(|_| form())
}
