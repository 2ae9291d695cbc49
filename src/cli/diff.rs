//! `divmerge diff`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use serde::Serialize;

use crate::cli::annotated::{annotated, find_annotated};
use crate::cli::exit::Outcome;
use crate::cli::output::Outputs;
use crate::cli::progress::frame_bar;
use crate::cli::text::{counted, fitted, grouped, listed};
use crate::evaluate::{Difference, differences};
use crate::frames::{EncodedCloud, EncodedClouds};
use crate::text::csv_line;

/// List the differences between two annotated recordings
///
/// Both must be annotations of the same recording, with different parameters, methods or versions.
/// Instance numbers do not matter: instances correspond if more than half of one lies in the other.
/// Groups of corresponding instances with different points are listed, the largest first.
#[derive(Args)]
pub struct Arguments {
    /// The first recording (MCAP), as `divmerge annotate` writes it
    first: PathBuf,

    /// The second
    second: PathBuf,

    /// Topic of the clouds, as in /lidar/points or /lidar/points/instances [default: all annotated
    /// topics]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Maximum number of differences to print; the files have all of them
    #[arg(long, default_value_t = 20, value_name = "N")]
    limit: usize,

    /// Write all differences to this file, one on each line
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Write all differences to this JSON file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// A difference and where it is.
#[derive(Serialize)]
struct LocatedDifference {
    topic: String,
    frame: u64,
    /// Seconds from the start of the recording.
    seconds: f64,
    /// A point of it, metres, frame of the cloud.
    at: [f32; 3],
    #[serde(flatten)]
    difference: Difference,
}

/// Totals over all clouds.
#[derive(Default)]
struct Totals {
    frames: u64,
    differing_frames: u64,
    points: u64,
    differing_points: u64,
    instances: [u64; 2],
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let inputs = [arguments.first.as_path(), &arguments.second];
    let mut outputs = Outputs::new(inputs, arguments.force);
    let csv = outputs.optional(arguments.csv.as_deref())?;
    let json = outputs.optional(arguments.json.as_deref())?;
    let (mut found, mut totals) = (Vec::new(), Totals::default());
    for topic in topics(arguments)? {
        compare(arguments, &topic, &mut found, &mut totals)?;
    }
    found.sort_by_key(|found| std::cmp::Reverse(found.difference.points));
    print(&found, &totals, arguments.limit);
    if let Some(csv) = csv {
        csv.write(as_csv(&found).as_bytes())?;
        println!("wrote {}", csv.path().display());
    }
    if let Some(json) = json {
        json.write_json(&found)?;
        println!("wrote {}", json.path().display());
    }
    Ok(Outcome::Done)
}

/// The annotated topics of both recordings.
fn topics(arguments: &Arguments) -> Result<Vec<String>> {
    let (first, second) = (annotated(&arguments.first)?, annotated(&arguments.second)?);
    let names = || (first.join(", "), second.join(", "));
    if let Some(topic) = &arguments.topic {
        let Some(found) = find_annotated(&first, topic).filter(|found| second.contains(found))
        else {
            let (first, second) = names();
            bail!(
                "`{topic}` is not annotated in both; annotated topics are {first} in the first, \
                 {second} in the second"
            );
        };
        return Ok(vec![found.clone()]);
    }
    if first != second {
        let (first, second) = names();
        bail!(
            "annotated topics differ: {first} in the first, {second} in the second; choose one \
             with --topic"
        );
    }
    Ok(first)
}

fn compare(
    arguments: &Arguments,
    topic: &str,
    found: &mut Vec<LocatedDifference>,
    totals: &mut Totals,
) -> Result<()> {
    let open = |path: &Path| EncodedClouds::open(path, Some(topic), 0..=u64::MAX);
    let (mut first, mut second) = (open(&arguments.first)?, open(&arguments.second)?);
    let (counts, start_ns) = ([first.message_count(), second.message_count()], first.start_ns());
    if counts[0] != counts[1] {
        bail!("{topic}: {} clouds in the first, {} in the second", counts[0], counts[1]);
    }
    let bar = frame_bar("comparing", counts[0]);
    while let (Some(a), Some(b)) = (first.next(), second.next()) {
        let (a, b) = (a?, b?);
        let place = || format!("frame {} of {topic}", a.number);
        let seconds = a.log_time_ns().saturating_sub(start_ns) as f64 * 1e-9;
        let (number, here) = (a.number, frame(&a, &b, totals).with_context(place)?);
        let located = here.into_iter().map(|(difference, at)| LocatedDifference {
            topic: topic.strip_suffix("/instances").unwrap_or(topic).to_owned(),
            frame: number,
            seconds,
            at,
            difference,
        });
        found.extend(located);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

/// The differences of a cloud, each with a point of it.
fn frame(
    first: &EncodedCloud,
    second: &EncodedCloud,
    totals: &mut Totals,
) -> Result<Vec<(Difference, [f32; 3])>> {
    let (a, b) = (first.decode()?, second.decode()?);
    let cloud = a.to_cloud(None)?;
    if first.log_time_ns() != second.log_time_ns() || a.point_count() != b.point_count() {
        bail!(
            "not annotations of the same recording: the first has {} at {} ns, the second {} at {} \
             ns",
            counted(a.point_count() as u64, "point"),
            first.log_time_ns(),
            grouped(b.point_count() as u64),
            second.log_time_ns()
        );
    }
    let (a, b) = (a.column_u32("instance")?, b.column_u32("instance")?);
    let found = differences(&a, &b);
    totals.frames += 1;
    totals.differing_frames += u64::from(!found.is_empty());
    totals.points += a.len() as u64;
    totals.differing_points += found.iter().map(|found| found.points).sum::<u64>();
    for (count, ids) in totals.instances.iter_mut().zip([&a, &b]) {
        *count += u64::from(ids.iter().copied().max().unwrap_or(0));
    }
    let place = |found: Difference| {
        let at = cloud.position(found.example as usize);
        (found, at)
    };
    Ok(found.into_iter().map(place).collect())
}

fn print(found: &[LocatedDifference], totals: &Totals, limit: usize) {
    let summary = format!(
        "{}, {} with differences: {} in {} of {} points; {} instances in the first, {} in the \
         second",
        counted(totals.frames, "cloud"),
        grouped(totals.differing_frames),
        counted(found.len() as u64, "difference"),
        grouped(totals.differing_points),
        grouped(totals.points),
        grouped(totals.instances[0]),
        grouped(totals.instances[1]),
    );
    print!("{}", fitted(&summary));
    if found.is_empty() {
        return;
    }
    println!();
    println!(
        " points  frame       time  at x, y, z (m)           change              first -> second"
    );
    let of_several = found.iter().any(|other| other.topic != found[0].topic);
    for found in found.iter().take(limit) {
        let [x, y, z] = found.at;
        println!(
            "{:>7}  {:>5}  {:>7.3} s  {:<23}  {:<18}  {} -> {}{}",
            grouped(found.difference.points),
            found.frame,
            found.seconds,
            format!("{x:.2}, {y:.2}, {z:.2}"),
            found.difference.change.name(),
            ids(&found.difference.first),
            ids(&found.difference.second),
            if of_several { format!("  ({})", found.topic) } else { String::new() },
        );
    }
    if found.len() > limit {
        println!("and {} more", grouped((found.len() - limit) as u64));
    }
}

/// The first instances, as in `3, 7, 12 and 5 more`.
fn ids(ids: &[u32]) -> String {
    let names: Vec<String> = ids.iter().map(u32::to_string).collect();
    if names.is_empty() { "none".to_owned() } else { listed(&names, 6) }
}

fn as_csv(found: &[LocatedDifference]) -> String {
    let all = |ids: &[u32]| ids.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
    let line = |found: &LocatedDifference| {
        let LocatedDifference { topic, frame, seconds, at: [x, y, z], difference } = found;
        csv_line(&[
            topic.clone(),
            frame.to_string(),
            format!("{seconds:.9}"),
            difference.points.to_string(),
            difference.change.name().to_owned(),
            x.to_string(),
            y.to_string(),
            z.to_string(),
            all(&difference.first),
            all(&difference.second),
        ])
    };
    let head = "topic,frame,seconds,points,change,x,y,z,first,second\n".to_owned();
    std::iter::once(head).chain(found.iter().map(line)).collect()
}
