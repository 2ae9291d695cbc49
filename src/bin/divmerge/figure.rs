//! `divmerge figure`

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use clap::{ArgGroup, Args};
use divmerge::annotate::{Clustered, Method, cluster};
use divmerge::io::{CloudMessage, CloudMessages, Overview, Which, cloud_message_at};
use divmerge::view::{
    self, Canvas, ColourTracker, Crop, FigureOptions, Panel, Region, Scene, SceneClass,
};

use crate::Outcome;
use crate::arguments::MethodArguments;
use crate::terminal::frame_bar;
use divmerge::annotate::moments::Moment;

/// Draw a cloud as it is clustered
///
/// Object mask, local components and instances over the range image, the votes and the boxes from above:
/// one frame as PNG or SVG, the merge step by step, or numbered frames for a video.
#[derive(Args)]
#[command(group(ArgGroup::new("outputs").required(true).multiple(true).args(["output", "steps", "video"])))]
pub struct Arguments {
    /// The recording (MCAP)
    input: PathBuf,

    /// The figure; its ending, .png or .svg, says which
    #[arg(short, long, value_name = "OUT", value_parser = picture)]
    output: Option<PathBuf>,

    /// Number of the cloud on its topic, from 0
    #[arg(long, value_name = "N", conflicts_with = "time")]
    frame: Option<u64>,

    /// Log time of the cloud, the nearest is taken: seconds from the start (12.5) or since 1970
    /// (@1317384506.4)
    #[arg(long, value_name = "T", value_parser = Moment::from_str)]
    time: Option<Moment>,

    /// The cloud topic [default: the first with clouds]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Panels from the top, comma separated: range, intensity, mask, components, instances, votes, bev
    /// [default: mask,components,instances,votes,bev, of other methods mask,instances,bev]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = panel)]
    panels: Vec<Panel>,

    /// Height to width of the whole range image
    #[arg(long, value_name = "H:W", default_value = "1:8", value_parser = aspect)]
    aspect: f64,

    /// Pixels to the inch; a figure is 10.4 inches wide
    #[arg(long, default_value_t = 192.0, value_parser = dpi)]
    dpi: f64,

    /// Show a part of the range image, and from above what is in it: columns, or columns/rows from the
    /// top, as in 500..900 or 500..900/10..50
    #[arg(long, value_name = "COLUMNS/ROWS", value_parser = crop)]
    crop: Option<Crop>,

    /// Show this part of the plane: x/y in metres, as in -10..40/-15..15 [default: around the objects]
    #[arg(long, value_name = "X/Y", value_parser = region, allow_hyphen_values = true)]
    view: Option<Region>,

    /// Write the merge step by step as numbered pictures into this folder
    #[arg(long, value_name = "DIR")]
    steps: Option<PathBuf>,

    /// One picture for each instance that is opened, or for each decision to merge
    #[arg(long, value_enum, value_name = "WHAT", default_value_t = StepsBy::Instance, requires = "steps")]
    steps_by: StepsBy,

    /// Write a numbered picture of each of --frames into this folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["output", "steps", "frame", "time"])]
    video: Option<PathBuf>,

    /// Frames of the video: from a up to but without b, as in 0..50 [default: all]
    #[arg(long, value_name = "A..B", value_parser = frames, requires = "video", conflicts_with_all = ["output", "steps"])]
    frames: Option<Range<u64>>,

    #[command(flatten)]
    method: MethodArguments,

    /// Replace existing pictures
    #[arg(long)]
    force: bool,
}

/// What one picture of a step-by-step series shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum StepsBy {
    /// An instance with everything that joins it
    Instance,
    /// One decision
    Decision,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let method = arguments.method.method(&arguments.input)?;
    let panels = match (arguments.panels.as_slice(), &method.config.baseline) {
        ([], None) => FigureOptions::default().panels,
        ([], Some(_)) => vec![Panel::Mask, Panel::Instances, Panel::BirdsEye],
        (chosen, _) => chosen.to_vec(),
    };
    let options = FigureOptions {
        panels,
        aspect: arguments.aspect,
        crop: arguments.crop.clone().unwrap_or_default(),
        region: arguments.view,
        dpi: arguments.dpi,
    };
    if let Some(folder) = &arguments.video {
        return video(arguments, &method, options, folder);
    }
    if let Some(output) = &arguments.output {
        crate::refuse_existing(output, arguments.force)?;
    }
    if let Some(folder) = &arguments.steps {
        make_folder(folder)?;
    }
    let overview = Overview::read(&arguments.input)?;
    let start_ns = overview.start_ns.unwrap_or(0);
    let which = match arguments.time {
        Some(Moment::Frame(number)) => Which::Frame(number),
        Some(time) => Which::Time(time.log_time(&overview, &[])?),
        None => Which::Frame(arguments.frame.unwrap_or(0)),
    };
    let message = cloud_message_at(&arguments.input, arguments.topic.as_deref(), which)?;
    let clustered = Frame::new(&message, &method)?;
    let scene = clustered.scene(&message, &method, start_ns, &mut ColourTracker::default());
    if let Some(output) = &arguments.output {
        let bytes = write(output, &view::figure(&scene, &options)?, options.dpi, arguments.force)?;
        println!("wrote {} ({bytes} bytes, {})", output.display(), scene.heading);
    }
    if let Some(folder) = &arguments.steps {
        steps(&scene, &options, arguments, folder)?;
    }
    Ok(Outcome::Done)
}

/// Draws the figure of `demo`.
pub fn draw(input: &Path, frame: u64, output: &Path, method: &Method) -> Result<()> {
    let start_ns = Overview::read(input)?.start_ns.unwrap_or(0);
    let message = cloud_message_at(input, None, Which::Frame(frame))?;
    let clustered = Frame::new(&message, method)?;
    let scene = clustered.scene(&message, method, start_ns, &mut ColourTracker::default());
    let options = FigureOptions::default();
    write(output, &view::figure(&scene, &options)?, options.dpi, true)?;
    Ok(())
}

/// A clustered cloud message and what of it a figure needs beside.
struct Frame {
    clustered: Clustered,
    intensity: Option<Vec<f32>>,
}

impl Frame {
    fn new(message: &CloudMessage, method: &Method) -> Result<Self> {
        let place = || format!("frame {} of {}", message.number, message.topic);
        let wire = message.decode().with_context(place)?;
        let clustered = cluster(&wire, message.which(), method).with_context(place)?;
        if let Some(problem) = &clustered.missing_boxes {
            eprintln!("warning: {}: {problem}", place());
        }
        let intensity = ["intensity", "reflectivity"].into_iter().find_map(|name| {
            let values = wire.column_f64(name).ok()?;
            Some(values.into_iter().map(|value| value as f32).collect())
        });
        Ok(Frame { clustered, intensity })
    }

    fn scene(
        &self,
        message: &CloudMessage,
        method: &Method,
        start_ns: u64,
        colours: &mut ColourTracker,
    ) -> Scene<'_> {
        let Clustered { cloud, stages, semantics, .. } = &self.clustered;
        let has_classes = semantics.starts_with("field:");
        let classes = method.taxonomy.classes().iter().filter(|_| has_classes);
        let classes = classes
            .map(|class| SceneClass { name: class.name.clone(), is_thing: class.is_thing })
            .collect();
        let seconds = message.log_time.saturating_sub(start_ns) as f64 * 1e-9;
        Scene {
            cloud,
            stages,
            classes,
            intensity: self.intensity.clone(),
            merge_ratio: method.config.cluster.merge_ratio,
            colour_numbers: colours.colour_numbers(&stages.instances),
            heading: format!("frame {}  ·  {seconds:.3} s", message.number),
            remark: format!(
                "{}  ·  range image {} × {} ({})  ·  objects: {semantics}  ·  {}",
                message.topic,
                stages.image.rows(),
                stages.image.columns(),
                stages.image.projection.describe(),
                method.config.describe(),
            ),
        }
    }
}

fn video(
    arguments: &Arguments,
    method: &Method,
    mut options: FigureOptions,
    folder: &Path,
) -> Result<Outcome> {
    let frames = arguments.frames.clone().unwrap_or(0..u64::MAX);
    let topic = arguments.topic.as_deref();
    let messages = CloudMessages::open(&arguments.input, topic, frames.start..=frames.end - 1)?;
    let (count, start_ns) = (messages.message_count(), messages.start_ns());
    if arguments.frames.is_some() && frames.end > count {
        bail!(
            "{}: no frame {} on `{}`: it has {count}, from 0 to {}",
            arguments.input.display(),
            frames.end - 1,
            messages.topic(),
            count - 1
        );
    }
    make_folder(folder)?;
    let bar = frame_bar("drawing", frames.end.min(count) - frames.start);
    let mut colours = ColourTracker::default();
    let (mut drawn, mut unreadable) = (0_u64, 0_u64);
    for message in messages {
        let message = message?;
        let output = folder.join(format!("frame_{:06}.png", message.number));
        crate::refuse_existing(&output, arguments.force)?;
        let frame = match Frame::new(&message, method) {
            Ok(frame) => frame,
            Err(error) if ends_the_run(&error) => return Err(error),
            Err(error) => {
                bar.suspend(|| eprintln!("warning: {error:#}; not drawn"));
                unreadable += 1;
                continue;
            }
        };
        let scene = frame.scene(&message, method, start_ns, &mut colours);
        // The first frame's part of the plane stays, so that nothing jumps.
        if options.region.is_none() {
            let image = &frame.clustered.stages.image;
            let window = options.crop.within(image.rows(), image.columns())?;
            options.region = Some(Region::of_objects(&scene, &window, options.crop.is_all()));
        }
        write(&output, &view::figure(&scene, &options)?, options.dpi, arguments.force)?;
        drawn += 1;
        bar.inc(1);
    }
    bar.finish_and_clear();
    println!("wrote {drawn} pictures to {}", folder.join("frame_*.png").display());
    Ok(if unreadable == 0 { Outcome::Done } else { Outcome::Incomplete })
}

/// Whether boxes do not fit the clouds, which the next cloud would meet again.
fn ends_the_run(error: &anyhow::Error) -> bool {
    error.downcast_ref::<divmerge::Error>().is_some_and(divmerge::Error::ends_the_run)
}

fn steps(
    scene: &Scene,
    options: &FigureOptions,
    arguments: &Arguments,
    folder: &Path,
) -> Result<()> {
    let by_decision = arguments.steps_by == StepsBy::Decision;
    let steps = view::steps(scene, options, by_decision)?;
    let bar = frame_bar("drawing", steps.len() as u64);
    for (number, step) in (1..).zip(&steps) {
        let output = folder.join(format!("step_{number:05}.png"));
        crate::refuse_existing(&output, arguments.force)?;
        let page = view::step_figure(scene, options, step, number, steps.len());
        write(&output, &page, options.dpi, arguments.force)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let what = if by_decision { "decisions" } else { "instances that had someone to ask" };
    println!("wrote {} pictures to {} ({what})", steps.len(), folder.join("step_*.png").display());
    Ok(())
}

fn make_folder(folder: &Path) -> Result<()> {
    crate::refuse_address(folder)?;
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))
}

/// Writes a page as the ending asks; it appears under its name when it is complete.
pub fn write(output: &Path, canvas: &Canvas, dpi: f64, force: bool) -> Result<u64> {
    let bytes = if is_svg(output) {
        view::svg(canvas).into_bytes()
    } else {
        let [width, height] = view::png::size(canvas, dpi);
        let too_large = || format!("a picture of {width} x {height} pixels is too large");
        view::png(canvas, dpi).with_context(too_large)?
    };
    divmerge::io::write_file(output, &bytes, force)?;
    Ok(bytes.len() as u64)
}

fn is_svg(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("svg"))
}

/// Reads the name of a picture.
pub fn picture(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_png = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"));
    if is_png || is_svg(&path) { Ok(path) } else { Err("must end in .png or .svg".into()) }
}

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

/// `a..b` with a below b.
fn range<T: std::str::FromStr + PartialOrd>(text: &str) -> Result<Range<T>, String> {
    let wrong = || format!("`{text}` is no range: use a..b with a below b");
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    match (from.parse::<T>(), to.parse::<T>()) {
        (Ok(from), Ok(to)) if from < to => Ok(from..to),
        _ => Err(wrong()),
    }
}

fn frames(text: &str) -> Result<Range<u64>, String> {
    range(text)
}

fn crop(text: &str) -> Result<Crop, String> {
    let (columns, rows) = match text.split_once('/') {
        Some((columns, rows)) => (columns, Some(rows)),
        None => (text, None),
    };
    let part = |text: &str| if text.is_empty() { Ok(None) } else { range(text).map(Some) };
    Ok(Crop { columns: part(columns)?, rows: rows.map(part).transpose()?.flatten() })
}

fn region(text: &str) -> Result<Region, String> {
    let wrong = || "use x/y in metres, as in -10..40/-15..15, a metre to 2 km wide".to_owned();
    let (x, y) = text.split_once('/').ok_or_else(wrong)?;
    let part = |text: &str| {
        let part: Range<f64> = range(text)?;
        let is_wide = (1.0..=2000.0).contains(&(part.end - part.start));
        if is_wide { Ok([part.start, part.end]) } else { Err(wrong()) }
    };
    Ok(Region { x: part(x)?, y: part(y)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_crops_and_regions() {
        assert_eq!(frames("3..7"), Ok(3..7));
        assert!(frames("7..3").is_err() && frames("3").is_err() && frames("-1..3").is_err());
        let both = Crop { columns: Some(5..9), rows: Some(1..3) };
        assert_eq!(crop("5..9/1..3"), Ok(both));
        assert_eq!(crop("/1..3"), Ok(Crop { columns: None, rows: Some(1..3) }));
        assert!(crop("5").is_err());
        assert_eq!(region("-10..40/-15..15"), Ok(Region { x: [-10.0, 40.0], y: [-15.0, 15.0] }));
        assert!(region("0..0.1/0..9").is_err() && region("0..inf/0..9").is_err());
        assert!(region("nan..2/0..9").is_err());
        assert_eq!(aspect("1:8"), Ok(0.125));
        assert!(aspect("0:8").is_err() && aspect("1:0").is_err() && aspect("8").is_err());
        assert!(aspect("nan:1").is_err() && dpi("nan").is_err() && dpi("1").is_err());
    }
}
