//! `divmerge demo`

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;

use crate::Taxonomy;
use crate::annotate::{AnnotateOptions, AnnotationReport, TrackOptions, annotate};
use crate::cli::arguments::objects::ObjectArguments;
use crate::cli::arguments::parameters::ParameterArguments;
use crate::cli::exit::Outcome;
use crate::cli::layout::{Layout, WantedLayouts};
use crate::cli::output::{OutputFile, Outputs, make_folder};
use crate::cli::progress::{RecordingProgress, frame_bar};
use crate::cli::{figure, interrupt, report, viewer};
use crate::datasets::drive::{CLOUD_TOPIC, write_drive};
use crate::evaluate::panoptic::{MIN_POINTS, Panoptic};
use crate::frames::EncodedClouds;
use crate::pipeline::Preset;
use crate::recording::WriteOptions;
use crate::simulate::{Drive, Scene, Sensor};

/// Simulate a drive, annotate it, and score it against its truth
///
/// Needs no data. Writes the simulated and the annotated recording, layouts for viewers and a
/// figure of one frame to a folder, and suggests what to open next.
#[derive(Args)]
pub struct Arguments {
    /// Folder for the recordings and the figure; replaces those of an earlier demo
    #[arg(long, value_name = "DIR", default_value = "demo")]
    out: PathBuf,

    /// Number of frames to simulate
    #[arg(long, default_value_t = 20)]
    frames: usize,

    /// Random seed of the street
    #[arg(long, default_value_t = 1)]
    seed: u64,

    #[command(flatten)]
    objects: ObjectArguments,

    #[command(flatten)]
    parameters: ParameterArguments,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    let parameters = arguments.parameters.of_preset(Preset::Best)?;
    let folder = &arguments.out;
    let inputs = arguments.objects.files().chain(arguments.parameters.files());
    let mut outputs = Outputs::new(inputs, true);
    let mut output = |name: &str| outputs.file_in_made_folder(&folder.join(name));
    let [drive, annotated] = [output("drive.mcap")?, output("annotated.mcap")?];
    let figure = output("figure.png")?;
    let layouts = WantedLayouts { json: true, rerun: viewer::IS_BUILT };
    let layout = Layout::beside(annotated.path(), layouts, &mut outputs)?;
    make_folder(folder)?;
    simulate(&drive, arguments)?;
    let (drive, annotated) = (drive.path(), annotated.path());
    let config = arguments.objects.config(drive)?.with_parameters(&parameters);
    let tracks = TrackOptions::default().with_parameters(&parameters);
    let options = AnnotateOptions { force: true, config, tracks, ..AnnotateOptions::default() };
    let progress = RecordingProgress::new("annotating", drive);
    let report = annotate(drive, annotated, &options, &mut |event| {
        progress.show(&event);
        interrupt::check()
    })?;
    drop(progress);
    layout.write(&report)?;
    println!("{}", report::text(&report));
    let taxonomy = &options.config.taxonomy;
    print_scores(&score(annotated, taxonomy)?, taxonomy, &classes_of(&report));
    if arguments.frames > 0 {
        let middle = arguments.frames as u64 / 2;
        figure::draw(drive, middle, &figure, &options.config)?;
    }
    print_next(drive, &layout.how_to_look(&report), figure.path());
    Ok(Outcome::Done)
}

/// Begins the source of classes that are predicted, not given.
const PREDICTED: &str = "classes from";

/// Where the classes came from.
fn classes_of(report: &AnnotationReport) -> String {
    let sources = report.topics.values().flat_map(|topic| topic.semantics.keys());
    match sources.cloned().collect::<Vec<_>>().join(", ").as_str() {
        "field:label" => "classes given".to_owned(),
        "ground" | "all" => "no classes".to_owned(),
        other => format!("{PREDICTED} {other}"),
    }
}

fn simulate(drive: &OutputFile, arguments: &Arguments) -> Result<()> {
    let frames = arguments.frames;
    let street = Drive::new(Sensor::Hdl64e, Scene::Street, arguments.seed);
    let options = WriteOptions { force: drive.force(), ..WriteOptions::default() };
    let bar = frame_bar("simulating an HDL-64E in a street", frames as u64);
    write_drive(&street, frames, drive.path(), &options, |_| {
        bar.inc(1);
        interrupt::check()
    })?;
    bar.finish_and_clear();
    Ok(())
}

/// Panoptic quality of an annotated simulated drive; its clouds have fields of truth and result.
fn score(annotated: &Path, taxonomy: &Taxonomy) -> Result<Panoptic> {
    let class_of = taxonomy.lookup();
    let mut scores = Panoptic::of(taxonomy, MIN_POINTS);
    let topic = format!("{CLOUD_TOPIC}/instances");
    for message in EncodedClouds::open(annotated, Some(&topic), 0..=u64::MAX)? {
        let message = message?;
        let cloud = message.decode()?;
        let column = |name: &str| cloud.column_u32(name);
        let class = |name: &str| -> Result<Vec<u16>> {
            Ok(column(name)?.iter().map(|&id| class_of[id as u16 as usize]).collect())
        };
        scores.add(
            &class("semantic")?,
            &column("instance")?,
            &class("label")?,
            &column("true_instance")?,
        );
    }
    Ok(scores)
}

/// Each thing class that occurs, and their mean.
fn print_scores(scores: &Panoptic, taxonomy: &Taxonomy, semantics: &str) {
    let classes = taxonomy.classes();
    let occurs = |class: usize| scores.is_thing_present(taxonomy, class);
    println!("panoptic quality against the simulated truth, {semantics} (%):");
    println!("class            PQ     SQ     RQ     found  spurious  missed");
    for class in (0..classes.len()).filter(|&class| occurs(class)) {
        let quality = scores.class(class);
        println!(
            "{:<14} {:>5.1}  {:>5.1}  {:>5.1}  {:>6}  {:>8}  {:>6}",
            classes[class].name,
            quality.pq * 100.0,
            quality.sq * 100.0,
            quality.rq * 100.0,
            quality.true_positives,
            quality.false_positives,
            quality.false_negatives
        );
    }
    let mean = scores.mean(occurs);
    let [pq, sq, rq] = [mean.pq, mean.sq, mean.rq].map(|figure| figure * 100.0);
    println!("{:<14} {pq:>5.1}  {sq:>5.1}  {rq:>5.1}", "mean");
    if semantics.starts_with(PREDICTED) {
        let iou = scores.mean_iou_of_present() * 100.0;
        println!("mean IoU of the points over all classes in the truth: {iou:.1}");
    }
}

fn print_next(drive: &Path, how_to_look: &str, figure: &Path) {
    println!();
    println!("Next:");
    if figure.exists() {
        let figure = figure.display();
        println!("  look at {figure}: mask, components, instances and votes of one frame");
    }
    println!("  look at the annotated recording: {how_to_look}");
    println!(
        "    {CLOUD_TOPIC}/instances shows instances in colour, {CLOUD_TOPIC}/objects their boxes"
    );
    println!("  divmerge info {}", drive.display());
    println!("  divmerge figure {} --frame 3 -o figure.svg", drive.display());
    println!("  divmerge annotate YOUR.mcap -o annotated.mcap");
}
