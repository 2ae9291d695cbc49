//! `divmerge failures`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use divmerge::Taxonomy;
use divmerge::annotate::Method;
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::evaluate::{JudgedObject, Verdict};
use divmerge::explain::Frame;
use divmerge::failures::{Cause, Failure, LabelledRun, PixelBounds, Side, failures};
use divmerge::io::LabelledFrame;
use divmerge::pipeline;
use serde::Serialize;

use crate::Outcome;
use crate::arguments::{MethodArguments, quoted};
use crate::evaluate::write_json;
use crate::table::{Table, csv_cell};
use crate::terminal::{frame_bar, grouped};
use crate::truth::{CloudArguments, with_hint};

/// List the objects that the clustering gets wrong, the worst first, each with its cause
///
/// Every true object and every found instance gets a verdict: correct (one class, IoU above a half), wrong
/// class, over-segmented, under-segmented, missed, spurious. For each that is not correct the method runs again
/// with one step perfect after the other, to say which lost it: mask (the semantics did), projection (its points
/// are shadowed), divide (a component straddles two objects, or pixels are unreached), merge (a vote, named) or
/// post (bird's-eye, size or gap merge, minimum size); of another --method than our own only mask, projection, or
/// the method itself.
///
/// The worst is what has the most points: as many are not in a right instance.
///
/// IN is a recording whose clouds carry their truth, as simulated ones do, or have label files beside them; or
/// a folder of SemanticKITTI (sequences/NN/velodyne and labels).
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    clouds: CloudArguments,

    #[command(flatten)]
    method: MethodArguments,

    /// Unmatched objects of fewer points are no failures
    #[arg(long, default_value_t = MIN_POINTS, value_name = "POINTS")]
    small: u64,

    /// How many failures to print; the files have them all
    #[arg(long, default_value_t = 20, value_name = "N")]
    limit: usize,

    /// Write all failures here, a line each
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Write counts and all failures with every number here
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// A failure and where it is.
#[derive(Serialize)]
struct Row {
    /// Topic or sequence.
    topic: String,
    frame: u64,
    /// Log time in nanoseconds; none in a folder.
    log_time_ns: Option<u64>,
    #[serde(flatten)]
    failure: Failure,
    /// The cause in words.
    cause_in_words: String,
    /// Positions of the points to look at, metres.
    at: Vec<[f32; 3]>,
    /// None of a method that has nothing to explain.
    explain: Option<String>,
    figure: Option<String>,
}

/// Objects of one verdict.
#[derive(Default, Clone, Copy, Serialize)]
struct Count {
    r#true: u64,
    found: u64,
}

/// What all frames come to.
#[derive(Default, Serialize)]
struct Sums {
    frames: u64,
    /// By verdict; small unmatched ones left out.
    verdicts: BTreeMap<&'static str, Count>,
    /// Unmatched objects of few points.
    small: Count,
    /// Found instances of no thing, where classes are not compared.
    elsewhere: u64,
    /// Failures by step and verdict.
    causes: BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
}

/// What goes into the JSON file.
#[derive(Serialize)]
struct Written<'a> {
    input: &'a Path,
    method: &'a str,
    preset: &'a str,
    taxonomy: &'a str,
    min_points: u64,
    #[serde(flatten)]
    sums: &'a Sums,
    failures: &'a [Row],
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    for output in [&arguments.csv, &arguments.json].into_iter().flatten() {
        crate::refuse_address(output)?;
    }
    let method = arguments.method.method(&arguments.clouds.input)?;
    let frames = arguments.clouds.open(&method)?;
    let bar = frame_bar("judging", frames.remaining());
    let (mut sums, mut rows) = (Sums::default(), Vec::new());
    let keeps_all = arguments.csv.is_some() || arguments.json.is_some();
    for frame in frames {
        let frame = frame.map_err(with_hint)?;
        rows.extend(judge(arguments, &method, frame, &mut sums)?);
        rows.sort_by_key(|row: &Row| std::cmp::Reverse(row.failure.judged.points));
        if !keeps_all {
            rows.truncate(arguments.limit);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    print(&sums, &rows, arguments);
    if let Some(path) = &arguments.csv {
        std::fs::write(path, csv(&rows)).with_context(|| path.display().to_string())?;
    }
    if let Some(path) = &arguments.json {
        let written = Written {
            input: &arguments.clouds.input,
            method: method.config.method_name(),
            preset: method.config.preset,
            taxonomy: &method.taxonomy.name,
            min_points: arguments.small,
            sums: &sums,
            failures: &rows,
        };
        write_json(path, &written)?;
    }
    Ok(Outcome::Done)
}

impl Arguments {
    /// The recording that the commands are to read; of a folder the one that `convert` makes of a sequence.
    fn recording(&self, source: &str) -> String {
        match self.clouds.input.is_dir() {
            true => format!("{source}.mcap"),
            false => quoted(&self.clouds.input.display().to_string()),
        }
    }
}

/// The failures of a frame.
fn judge(
    arguments: &Arguments,
    method: &Method,
    mut labelled: LabelledFrame,
    sums: &mut Sums,
) -> Result<Vec<Row>> {
    method.prepare(&mut labelled)?;
    let detections = method.detections(&labelled)?;
    let LabelledFrame { source, number, log_time_ns, cloud, truth, .. } = &labelled;
    let (number, log_time_ns) = (*number, *log_time_ns);
    refuse_unknown(&truth.class, &method.taxonomy).with_context(|| {
        format!("{}: cloud {number} of {source}", arguments.clouds.input.display())
    })?;
    let (mask, config) = (method.mask(cloud), &method.config);
    let stages = pipeline::run_with(cloud, mask, &detections, config);
    let judged = failures(&LabelledRun {
        frame: Frame { cloud, mask, config, stages: &stages },
        detections: &detections,
        true_class: &truth.class,
        true_id: &truth.id,
        taxonomy: &method.taxonomy,
        min_points: arguments.small,
    });
    sums.frames += 1;
    sums.elsewhere += judged.verdicts.elsewhere;
    sums.count(&judged.verdicts.truth, |count| &mut count.r#true);
    sums.count(&judged.verdicts.found, |count| &mut count.found);
    let columns = stages.image.columns();
    let row = |failure: Failure| {
        *sums
            .causes
            .entry(failure.cause.step())
            .or_default()
            .entry(failure.judged.verdict.name())
            .or_default() += 1;
        let recorded = |point: &usize| cloud.recorded(cloud.position(*point).map(f64::from));
        let at: Vec<[f32; 3]> =
            failure.show.iter().map(|point| recorded(point).map(|along| along as f32)).collect();
        let place = Place { arguments, source, number };
        Row {
            topic: source.clone(),
            frame: number,
            log_time_ns: (log_time_ns != 0).then_some(log_time_ns),
            cause_in_words: failure.cause.describe(),
            explain: method.config.baseline.is_none().then(|| place.explain(&at)),
            figure: failure.pixels.as_ref().and_then(|pixels| place.figure(pixels, columns)),
            at,
            failure,
        }
    };
    Ok(judged.failures.into_iter().map(row).collect())
}

/// An error that names a class which the taxonomy does not know.
pub fn refuse_unknown(ids: &[u16], taxonomy: &Taxonomy) -> Result<()> {
    let mut is_known = vec![false; 1 << 16];
    taxonomy.known_ids().for_each(|(id, _)| is_known[usize::from(id)] = true);
    if let Some(&unknown) = ids.iter().find(|&&id| !is_known[usize::from(id)]) {
        let count = ids.iter().filter(|&&id| id == unknown).count() as u64;
        bail!("class {unknown} ({} points) is not in taxonomy {}", grouped(count), taxonomy.name);
    }
    Ok(())
}

/// A frame, for commands that show something in it.
struct Place<'a> {
    arguments: &'a Arguments,
    source: &'a str,
    number: u64,
}

impl Place<'_> {
    fn explain(&self, at: &[[f32; 3]]) -> String {
        let at = at.iter().map(|[x, y, z]| format!(" --at {x:.3},{y:.3},{z:.3}"));
        format!("{}{}", self.command("explain"), at.collect::<String>())
    }

    /// The object's part of the image with as much again around it; none for what lies on both sides of the
    /// first column.
    fn figure(&self, pixels: &PixelBounds, image_columns: usize) -> Option<String> {
        let columns = pixels.columns.len();
        let around = columns.max(20);
        let first = pixels.columns.start.saturating_sub(around);
        let end = (pixels.columns.end + around).min(image_columns);
        (2 * columns < image_columns)
            .then(|| format!("{} --crop {first}..{end} -o failure.png", self.command("figure")))
    }

    fn command(&self, name: &str) -> String {
        let input = self.arguments.recording(self.source);
        let mut words = vec!["divmerge".to_owned(), name.into(), input];
        words.extend(["--frame".into(), self.number.to_string()]);
        if let Some(topic) = &self.arguments.clouds.topic {
            words.extend(["--topic".into(), quoted(topic)]);
        }
        words.extend(self.arguments.method.words().iter().map(|word| quoted(word)));
        words.join(" ")
    }
}

impl Sums {
    fn count(&mut self, judged: &[JudgedObject], side: impl Fn(&mut Count) -> &mut u64) {
        for one in judged {
            let count = match one.is_small {
                true => &mut self.small,
                false => self.verdicts.entry(one.verdict.name()).or_default(),
            };
            *side(count) += 1;
        }
    }
}

fn print(sums: &Sums, rows: &[Row], arguments: &Arguments) {
    let frames = grouped(sums.frames);
    println!("{frames} frames; objects of {} points or more count unless matched", arguments.small);
    println!();
    print!("{}", verdicts(sums).markdown());
    if sums.elsewhere > 0 {
        println!(
            "and {} found instances of no thing, which truth does not number",
            grouped(sums.elsewhere)
        );
    }
    print!("\n{}", causes(sums).markdown());
    let total: u64 = sums.causes.values().flat_map(BTreeMap::values).sum();
    if total == 0 {
        println!("\nno failures");
        return;
    }
    let shown = rows.len().min(arguments.limit);
    println!("\nthe worst {} of {}, by points:", shown, grouped(total));
    for (number, row) in (1..).zip(rows.iter().take(arguments.limit)) {
        println!();
        described(number, row);
    }
    if arguments.clouds.input.is_dir() && shown > 0 {
        println!("\nThe commands read recordings. To make one of a sequence:");
        println!(
            "  divmerge convert semantickitti {} --sequence NN --labels -o NN.mcap",
            quoted(&arguments.clouds.input.display().to_string())
        );
    }
}

/// Objects of either side by verdict.
fn verdicts(sums: &Sums) -> Table {
    let rows = Verdict::ALL.map(|verdict| {
        let count = sums.verdicts.get(verdict.name()).copied().unwrap_or_default();
        let told = |number: u64, is_none: bool| if is_none { "-".into() } else { grouped(number) };
        vec![
            verdict.name().to_owned(),
            told(count.r#true, verdict == Verdict::Spurious),
            told(count.found, verdict == Verdict::Missed),
        ]
    });
    let Count { r#true, found } = sums.small;
    let small = vec!["small".to_owned(), grouped(r#true), grouped(found)];
    Table::new(&["verdict", "true objects", "found instances"], rows.into_iter().chain([small]))
}

/// Failures by step and verdict.
fn causes(sums: &Sums) -> Table {
    let verdicts = &Verdict::ALL[1..];
    let head: Vec<&str> =
        std::iter::once("failures by cause").chain(verdicts.iter().map(|v| v.name())).collect();
    let row = |step: &&'static str| {
        let of_step = sums.causes.get(step);
        let count = |verdict: &Verdict| of_step.and_then(|of| of.get(verdict.name())).copied();
        let counts = verdicts.iter().map(|verdict| grouped(count(verdict).unwrap_or(0)));
        std::iter::once(step.to_string()).chain(counts).collect()
    };
    Table::new(&head, Cause::STEPS.iter().map(row))
}

/// Number of a true object as people know it: the instance of a word that holds class and instance.
fn true_number(id: u32) -> u32 {
    if id > u32::from(u16::MAX) { id >> 16 } else { id }
}

fn described(number: usize, row: &Row) {
    let Failure { side, judged, cause, .. } = &row.failure;
    let [x, y, z] = judged.centre;
    let name = if judged.class_name.is_empty() { "instance" } else { &judged.class_name };
    let whose = match side {
        Side::True => "true",
        Side::Found => "found",
    };
    let time = row.log_time_ns.map_or(String::new(), |ns| {
        format!(", log time {}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000)
    });
    println!(
        "{number}. {} frame {}{time}: {whose} {name} of {} points at {x:.1},{y:.1},{z:.1}: {}",
        row.topic,
        row.frame,
        grouped(judged.points),
        judged.verdict.name()
    );
    println!("   {}", involved(*side, judged));
    println!("   cause: {}: {}", cause.step(), row.cause_in_words);
    for command in row.explain.iter().chain(&row.figure) {
        println!("   {command}");
    }
}

/// What shares points with the object.
fn involved(side: Side, judged: &JudgedObject) -> String {
    let (other, nothing) = match side {
        Side::True => ("instances", "without an instance"),
        Side::Found => ("true objects", "of no thing"),
    };
    let number = |is_true: bool, id: u32| if is_true { true_number(id) } else { id };
    let parts = judged.parts.iter().take(3).map(|part| {
        let name = if part.class_name.is_empty() {
            String::new()
        } else {
            format!(" {}", part.class_name)
        };
        format!(
            "{} of{name} {} ({} points)",
            grouped(part.shared),
            number(side == Side::Found, part.object.id),
            grouped(part.points)
        )
    });
    let mut told: Vec<String> = parts.collect();
    if judged.parts.len() > 3 {
        told.push(format!("{} more {other}", judged.parts.len() - 3));
    }
    if judged.in_nothing > 0 {
        told.push(format!("{} {nothing}", grouped(judged.in_nothing)));
    }
    let mut told = format!("its points: {}", told.join(", "));
    if !judged.beside.is_empty() || judged.beside_nothing > 0 {
        let beside = judged.beside.iter().take(3).map(|share| {
            format!(
                "{} of {} {}",
                grouped(share.shared),
                share.class_name,
                number(side == Side::True, share.object.id)
            )
        });
        let mut beside: Vec<String> = beside.collect();
        if judged.beside.len() > 3 {
            beside.push(format!("{} more", judged.beside.len() - 3));
        }
        if judged.beside_nothing > 0 {
            beside.push(format!("{} others", grouped(judged.beside_nothing)));
        }
        told += &format!("; beside them in the first: {}", beside.join(", "));
    }
    told
}

fn csv(rows: &[Row]) -> String {
    let head =
        "topic,frame,log_time_ns,side,class,id,points,x,y,z,verdict,iou,step,cause,explain,figure";
    let mut text = format!("{head}\n");
    for row in rows {
        let judged = &row.failure.judged;
        let [x, y, z] = judged.centre.map(|along| format!("{along:.3}"));
        let side = if row.failure.side == Side::True { "true" } else { "found" };
        let cells = [
            row.topic.clone(),
            row.frame.to_string(),
            row.log_time_ns.map_or(String::new(), |ns| ns.to_string()),
            side.into(),
            judged.class_name.clone(),
            judged.object.id.to_string(),
            judged.points.to_string(),
            x,
            y,
            z,
            judged.verdict.name().into(),
            format!("{:.4}", judged.iou),
            row.failure.cause.step().into(),
            row.cause_in_words.clone(),
            row.explain.clone().unwrap_or_default(),
            row.figure.clone().unwrap_or_default(),
        ];
        let cells = cells.map(|cell| csv_cell(&cell));
        text += &(cells.join(",") + "\n");
    }
    text
}
