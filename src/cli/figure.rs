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
use crate::cli::arguments::tracks::FollowArguments;
use crate::cli::arguments::values::{NamedValue, THEMES, one_of, range};
use crate::cli::exit::{Outcome, WrongUsage, contradict};
use crate::cli::followed::followed_drive;
use crate::cli::output::{OutputFile, Outputs, make_folder, picture};
use crate::cli::progress::frame_bar;
use crate::cli::text::counted;
use crate::error::{Error, NoCloud};
use crate::frames::{CloudAt, EncodedCloud, EncodedClouds, encoded_cloud_at};
use crate::recording::Overview;
use crate::view::{
    self, Canvas, ClusteredMessage, ColourTracker, FigureOptions, FrameScene, Panel, PixelCrop,
    PlaneRegion, Theme,
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
        steps(&scene, &options, arguments.steps_by, &mut outputs, folder)?;
    }
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

fn steps(
    scene: &FrameScene,
    options: &FigureOptions,
    by: Step,
    outputs: &mut Outputs,
    folder: &Path,
) -> Result<()> {
    if let Some(objects) = view::cut_objects(scene, options)? {
        if by == Step::Decision {
            contradict!(
                "--steps-by decision draws merges by votes; these objects were cut from a tree"
            );
        }
        let page = |number: usize| {
            let object = &objects[number - 1];
            view::object_figure(scene, options, object, number, objects.len())
        };
        let series = Series { folder, count: objects.len(), each: "object", dpi: options.dpi };
        return series.write(outputs, page);
    }
    let by_decision = by == Step::Decision;
    let steps = view::steps(scene, options, by_decision)?;
    let page =
        |number: usize| view::step_figure(scene, options, &steps[number - 1], number, steps.len());
    let each = if by_decision { "decision" } else { "instance with neighbours" };
    Series { folder, count: steps.len(), each, dpi: options.dpi }.write(outputs, page)
}

/// Pictures that are numbered from 1.
struct Series<'a> {
    folder: &'a Path,
    count: usize,
    /// What each of them shows.
    each: &'static str,
    dpi: f64,
}

impl Series<'_> {
    fn write(&self, outputs: &mut Outputs, page: impl Fn(usize) -> Canvas) -> Result<()> {
        let Series { folder, count, each, dpi } = self;
        let name = |number: usize| folder.join(format!("step_{number:05}.png"));
        let pictures = (1..=*count).map(|number| outputs.file(&name(number)));
        let pictures: Vec<OutputFile> = pictures.collect::<Result<_, _>>()?;
        let bar = frame_bar("drawing", *count as u64);
        for (number, picture) in (1..).zip(&pictures) {
            picture.write_picture(&page(number), *dpi)?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        let pictures = counted(*count as u64, "picture");
        let names = folder.join("step_*.png");
        println!("wrote {pictures} to {}, one for each {each}", names.display());
        Ok(())
    }
}
/// Reads the name of a panel.
fn panel(text: &str) -> Result<Panel, String> {
    let found = Panel::NAMES.iter().find(|(name, _)| *name == text);
    let names = Panel::NAMES.map(|(name, _)| name);
    found.map(|&(_, panel)| panel).ok_or_else(|| format!("use some of {}", names.join(", ")))
}

fn aspect(text: &str) -> Result<f64, String> {
    let wrong = || "use height:width, as in 1:8, from 1:100 to 10:1".to_owned();
    let (height, width) = text.split_once(':').ok_or_else(wrong)?;
    let number = |text: &str| text.parse::<f64>().map_err(|_| wrong());
    let aspect = number(height)? / number(width)?;
    if (0.01..=10.0).contains(&aspect) { Ok(aspect) } else { Err(wrong()) }
}

fn dpi(text: &str) -> Result<f64, String> {
    let dpi: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (24.0..=1200.0).contains(&dpi) { Ok(dpi) } else { Err("must be in 24..=1200".into()) }
}

fn window(text: &str) -> Result<PixelCrop, String> {
    let (columns, rows) = match text.split_once('/') {
        Some((columns, rows)) => (columns, Some(rows)),
        None => (text, None),
    };
    let part = |text: &str| if text.is_empty() { Ok(None) } else { range(text).map(Some) };
    Ok(PixelCrop { columns: part(columns)?, rows: rows.map(part).transpose()?.flatten() })
}

fn region(text: &str) -> Result<PlaneRegion, String> {
    let wrong = || "use x/y in metres, as in -10..40/-15..15, a metre to 2 km wide".to_owned();
    let (x, y) = text.split_once('/').ok_or_else(wrong)?;
    let part = |text: &str| {
        let part: Range<f64> = range(text)?;
        let is_wide = (1.0..=2000.0).contains(&(part.end - part.start));
        if is_wide { Ok([part.start, part.end]) } else { Err(wrong()) }
    };
    Ok(PlaneRegion { x: part(x)?, y: part(y)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_crops_and_regions() {
        let frames = range::<u64>;
        assert_eq!(frames("3..7"), Ok(3..7));
        assert!(frames("7..3").is_err() && frames("3").is_err() && frames("-1..3").is_err());
        let both = PixelCrop { columns: Some(5..9), rows: Some(1..3) };
        assert_eq!(window("5..9/1..3"), Ok(both));
        assert_eq!(window("/1..3"), Ok(PixelCrop { columns: None, rows: Some(1..3) }));
        assert!(window("5").is_err());
        assert_eq!(
            region("-10..40/-15..15"),
            Ok(PlaneRegion { x: [-10.0, 40.0], y: [-15.0, 15.0] })
        );
        assert!(region("0..0.1/0..9").is_err() && region("0..inf/0..9").is_err());
        assert!(region("nan..2/0..9").is_err());
        assert_eq!(aspect("1:8"), Ok(0.125));
        assert!(aspect("0:8").is_err() && aspect("1:0").is_err() && aspect("8").is_err());
        assert!(aspect("nan:1").is_err() && dpi("nan").is_err() && dpi("1").is_err());
    }
}
