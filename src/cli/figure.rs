//! `divmerge figure`

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result};
use clap::error::ErrorKind;
use clap::{ArgGroup, Args};

use crate::annotate::AnnotateConfig;
use crate::annotate::time_spec::TimeSpec;
use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::pictures::{aspect, dpi, panel, region, window};
use crate::cli::arguments::tracks::FollowArguments;
use crate::cli::arguments::values::{NamedValue, THEMES, one_of, range};
use crate::cli::dry_run::{DryRun, DryRunArgument};
use crate::cli::exit::{Outcome, WrongUsage, contradict};
use crate::cli::followed::followed_drive;
use crate::cli::output::{OutputFile, Outputs, make_folder, picture};
use crate::cli::progress::frame_bar;
use crate::cli::text::counted;
use crate::error::{Error, NoCloud};
use crate::frames::{CloudAt, EncodedCloud, EncodedClouds, encoded_cloud_at};
use crate::recording::Overview;
use crate::view::{
    self, ClusteredMessage, ColourTracker, FigureOptions, FrameScene, Panel, PixelCrop,
    PlaneRegion, StepPages, Theme,
};

/// Draw the clustering of a cloud
///
/// Shows object mask, local components, instances and votes on the range image, and the boxes from
/// above: one frame as PNG, SVG or PDF, the merge step by step, or numbered frames for a video.
#[derive(Args)]
#[command(group(
    ArgGroup::new("outputs").required(true).multiple(true).args(["output", "steps", "video"])
))]
pub struct Arguments {
    /// The recording (MCAP)
    input: PathBuf,

    /// The figure, as .png, .svg or .pdf
    #[arg(short, long, value_name = "OUT", value_parser = picture)]
    output: Option<PathBuf>,

    /// Number of the cloud on its topic, from 0
    #[arg(long, value_name = "N", conflicts_with = "time")]
    frame: Option<u64>,

    /// Log time of the cloud; the nearest cloud is taken: seconds from the start (12.5) or since
    /// 1970 (@1317384506.4)
    #[arg(long, value_name = "T", value_parser = TimeSpec::from_str)]
    time: Option<TimeSpec>,

    /// Cloud topic [default: the first with clouds]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Panels from top to bottom, comma separated: range, intensity, mask, components, instances,
    /// votes, bev [default: mask,components,instances,votes,bev; without votes where a tree of
    /// merges is cut; for other methods mask,instances,bev]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = panel)]
    panels: Vec<Panel>,

    /// Panels for the screen or for print
    #[arg(long, value_name = "THEME", default_value = "dark", value_parser = one_of(THEMES))]
    theme: Theme,

    /// Aspect ratio of the whole range image
    #[arg(long, value_name = "H:W", default_value = "1:8", value_parser = aspect)]
    aspect: f64,

    /// Pixels per inch; a figure is 10.4 inches wide
    #[arg(long, default_value_t = 192.0, value_parser = dpi)]
    dpi: f64,

    /// Show this part of the range image, and its points from above: columns, or columns/rows from
    /// the top, as in 500..900 or 500..900/10..50
    #[arg(long, value_name = "COLUMNS/ROWS", value_parser = window)]
    window: Option<PixelCrop>,

    /// Show this part of the bird's-eye plane: x/y in metres, as in -10..40/-15..15 [default:
    /// around the objects]
    #[arg(long, value_name = "X/Y", value_parser = region, allow_hyphen_values = true)]
    view: Option<PlaneRegion>,

    /// Write numbered pictures to this folder: the merge, step by step; without classes, each
    /// object and the tree of merges around it
    #[arg(long, value_name = "DIR")]
    steps: Option<PathBuf>,

    /// One picture for each new instance, or for each decision to merge by votes
    #[arg(long, value_name = "STEP", default_value = "instance", value_parser = one_of(STEPS))]
    #[arg(requires = "steps")]
    steps_by: Step,

    /// Write a numbered picture of each of --frames to this folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["output", "steps", "frame", "time"])]
    video: Option<PathBuf>,

    /// Follow objects over time and draw their ways from above, of all of --frames: what moves as a
    /// line, what stands as a box
    #[arg(long, requires = "output", conflicts_with_all = ["steps", "video", "frame", "time"])]
    #[arg(conflicts_with_all = ["panels", "window"])]
    tracks: bool,

    /// Frames of the video or of the tracks, as in 0..50 (without 50) [default: all]
    #[arg(long, value_name = "A..B", value_parser = range::<u64>, conflicts_with = "steps")]
    frames: Option<Range<u64>>,

    #[command(flatten)]
    following: FollowArguments,

    #[command(flatten)]
    method: MethodArguments,

    #[command(flatten)]
    dry_run: DryRunArgument,

    /// Replace existing pictures
    #[arg(long)]
    force: bool,
}

/// What one picture of the merge shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Instance,
    Decision,
}

const STEPS: &[NamedValue<Step>] = &[
    ("instance", "An instance with everything that joins it", Step::Instance),
    ("decision", "One decision to merge", Step::Decision),
];

impl Arguments {
    /// The panels of a figure for which none are chosen.
    fn fill_in_panels(
        &self,
        options: &mut FigureOptions,
        method: &AnnotateConfig,
        scene: &FrameScene,
    ) {
        if self.panels.is_empty() {
            options.panels = Panel::usual(&method.pipeline, scene.stages);
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    if arguments.frames.is_some() && arguments.video.is_none() && !arguments.tracks {
        let problem = "--frames needs --video or --tracks; --frame is for one picture";
        return Err(WrongUsage(ErrorKind::MissingRequiredArgument, problem.into()).into());
    }
    let inputs = std::iter::once(arguments.input.as_path()).chain(arguments.method.files());
    let mut outputs = Outputs::new(inputs, arguments.force);
    let output = outputs.optional(arguments.output.as_deref())?;
    let method =
        arguments.method.config_with_warnings(&arguments.input, arguments.topic.as_slice())?;
    if arguments.dry_run.dry_run {
        return dry_run(arguments, &method, output.as_ref());
    }
    if let (true, Some(output)) = (arguments.tracks, &output) {
        return tracks(arguments, &method, output);
    }
    let mut options = FigureOptions {
        panels: arguments.panels.clone(),
        aspect: arguments.aspect,
        crop: arguments.window.clone().unwrap_or_default(),
        region: arguments.view,
        dpi: arguments.dpi,
    };
    if let Some(folder) = &arguments.video {
        return video(arguments, &method, options, &mut outputs, folder);
    }
    if let Some(folder) = &arguments.steps {
        make_folder(folder)?;
    }
    let overview = Overview::read(&arguments.input)?;
    let start_ns = overview.start_ns.unwrap_or(0);
    let which = match arguments.time {
        Some(TimeSpec::Frame(number)) => CloudAt::Frame(number),
        Some(time) => CloudAt::Time(time.log_time(&overview, &[])?),
        None => CloudAt::Frame(arguments.frame.unwrap_or(0)),
    };
    let message =
        encoded_cloud_at(&arguments.input, arguments.topic.as_deref(), which, method.assemble)?;
    let clustered = clustered(&message, &method)?;
    let scene = clustered.scene(&method, start_ns, &mut ColourTracker::default());
    let scene = FrameScene { theme: arguments.theme, ..scene };
    arguments.fill_in_panels(&mut options, &method, &scene);
    if let Some(output) = &output {
        let bytes = output.write_picture(&view::figure(&scene, &options)?, options.dpi)?;
        println!("wrote {} ({bytes} bytes, {})", output.path().display(), scene.heading);
    }
    if let Some(folder) = &arguments.steps {
        let pages = StepPages::new(&scene, &options, arguments.steps_by == Step::Decision)?;
        steps(&pages, arguments.steps_by, options.dpi, &mut outputs, folder)?;
    }
    Ok(Outcome::Done)
}

/// Says what would be done.
fn dry_run(
    arguments: &Arguments,
    method: &AnnotateConfig,
    output: Option<&OutputFile>,
) -> Result<Outcome> {
    let (input, topic) = (&arguments.input, arguments.topic.as_deref());
    let clouds = EncodedClouds::open_assembled(input, topic, 0..=u64::MAX, method.assemble)?;
    let topic = [clouds.topic().to_owned()];
    let which = match (arguments.tracks || arguments.video.is_some(), &arguments.frames) {
        (true, None) => Vec::new(),
        (true, Some(_)) => vec!["--frames"],
        (false, _) if arguments.time.is_some() => vec!["--time"],
        (false, _) => vec!["--frame"],
    };
    let mut plan = DryRun::of_clouds(input, &topic, method, &which)?;
    output.iter().for_each(|file| plan.writes(file.path().display()));
    for folder in arguments.steps.iter().chain(&arguments.video) {
        plan.writes(format_args!("numbered pictures to {}", folder.display()));
    }
    plan.print();
    Ok(Outcome::Done)
}

/// Draws the figure of `demo`.
pub fn draw(input: &Path, frame: u64, output: &OutputFile, method: &AnnotateConfig) -> Result<()> {
    let start_ns = Overview::read(input)?.start_ns.unwrap_or(0);
    let message = encoded_cloud_at(input, None, CloudAt::Frame(frame), method.assemble)?;
    let clustered = clustered(&message, method)?;
    let scene = clustered.scene(method, start_ns, &mut ColourTracker::default());
    let panels = Panel::usual(&method.pipeline, scene.stages);
    let options = FigureOptions { panels, ..FigureOptions::default() };
    output.write_picture(&view::figure(&scene, &options)?, options.dpi)?;
    Ok(())
}

/// Clusters a cloud message, with a warning if its boxes are missing.
fn clustered<'a>(
    message: &'a EncodedCloud,
    method: &AnnotateConfig,
) -> Result<ClusteredMessage<'a>> {
    let place = || message.describe();
    let clustered = ClusteredMessage::new(message, method).with_context(place)?;
    if let Some(problem) = &clustered.clustered.missing_boxes {
        eprintln!("warning: {}: {problem}", place());
    }
    Ok(clustered)
}

/// Draws the tracks of a drive.
fn tracks(arguments: &Arguments, method: &AnnotateConfig, output: &OutputFile) -> Result<Outcome> {
    let options = arguments.following.options(&arguments.method.parameters_over_time()?);
    let drive = followed_drive(
        &arguments.input,
        (arguments.topic.as_deref(), arguments.frames.clone()),
        (method, &options),
    )?;
    let page = view::track_figure(&drive, arguments.view, arguments.theme, arguments.dpi);
    let bytes = output.write_picture(&page, arguments.dpi)?;
    println!(
        "wrote {} ({bytes} bytes, {} of {})",
        output.path().display(),
        counted(drive.tracks.len() as u64, "object"),
        counted(drive.clouds.len() as u64, "frame")
    );
    Ok(Outcome::of(drive.unreadable == 0))
}

fn video(
    arguments: &Arguments,
    method: &AnnotateConfig,
    mut options: FigureOptions,
    outputs: &mut Outputs,
    folder: &Path,
) -> Result<Outcome> {
    let frames = arguments.frames.clone().unwrap_or(0..u64::MAX);
    let topic = arguments.topic.as_deref();
    let numbers = frames.start..=frames.end - 1;
    let messages =
        EncodedClouds::open_assembled(&arguments.input, topic, numbers, method.assemble)?;
    let (count, start_ns) = (messages.message_count(), messages.start_ns());
    if arguments.frames.is_some() && frames.end > count {
        let counts = vec![(messages.topic().to_owned(), count)];
        let problem = NoCloud::NoFrame { frame: frames.end - 1, counts };
        return Err(Error::NoCloud { path: arguments.input.clone(), problem }.into());
    }
    let end = frames.end.min(count);
    let name = |number: u64| folder.join(format!("frame_{number:06}.png"));
    let pictures = (frames.start..end).map(|number| outputs.file_in_made_folder(&name(number)));
    let pictures: Vec<OutputFile> = pictures.collect::<Result<_, _>>()?;
    make_folder(folder)?;
    let bar = frame_bar("drawing", pictures.len() as u64);
    let mut colours = ColourTracker::default();
    let (mut drawn, mut unreadable) = (0_u64, 0_u64);
    for message in messages {
        let message = message?;
        // A turn has the name of its last message that was asked for. A file that grows may have
        // more clouds than when it was opened.
        let number = message.number.min(frames.end - 1).checked_sub(frames.start);
        let output = number.and_then(|number| pictures.get(number as usize));
        let Some(output) = output else { break };
        let frame = match clustered(&message, method) {
            Ok(frame) => frame,
            Err(error) if is_of_one_cloud(&error) => {
                bar.suspend(|| eprintln!("warning: {error:#}; not drawn"));
                unreadable += 1;
                continue;
            }
            Err(error) => return Err(error),
        };
        let scene = frame.scene(method, start_ns, &mut colours);
        let scene = FrameScene { theme: arguments.theme, ..scene };
        arguments.fill_in_panels(&mut options, method, &scene);
        // All frames show the first frame's part of the plane.
        if options.region.is_none() {
            let image = &frame.clustered.stages.image;
            let window = options.crop.within(image.rows(), image.columns())?;
            options.region = Some(PlaneRegion::of_objects(&scene, &window, options.crop.is_all()));
        }
        output.write_picture(&view::figure(&scene, &options)?, options.dpi)?;
        drawn += 1;
        bar.inc(1);
    }
    bar.finish_and_clear();
    println!("wrote {} to {}", counted(drawn, "picture"), folder.join("frame_*.png").display());
    Ok(Outcome::of(unreadable == 0))
}

/// Whether the error is of one cloud, so that the others can still be drawn.
fn is_of_one_cloud(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(Error::Frame(_)))
}

/// Writes the numbered pictures of a merge.
fn steps(
    pages: &StepPages,
    by: Step,
    dpi: f64,
    outputs: &mut Outputs,
    folder: &Path,
) -> Result<()> {
    let each = match (pages.are_of_objects(), by) {
        (true, Step::Decision) => contradict!(
            "--steps-by decision draws merges by votes; these objects were cut from a tree"
        ),
        (true, Step::Instance) => "object",
        (false, Step::Decision) => "decision",
        (false, Step::Instance) => "instance with neighbours",
    };
    let name = |number: usize| folder.join(StepPages::name(number));
    let pictures = (1..=pages.count()).map(|number| outputs.file(&name(number)));
    let pictures: Vec<OutputFile> = pictures.collect::<Result<_, _>>()?;
    let bar = frame_bar("drawing", pages.count() as u64);
    for ((_, page), picture) in pages.pages().zip(&pictures) {
        picture.write_picture(&page, dpi)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let pictures = counted(pictures.len() as u64, "picture");
    let names = folder.join("step_*.png");
    println!("wrote {pictures} to {}, one for each {each}", names.display());
    Ok(())
}
