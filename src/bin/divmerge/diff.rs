//! `divmerge diff`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use divmerge::annotate::annotated_topics;
use divmerge::evaluate::{Difference, differences};
use divmerge::io::{CloudMessage, CloudMessages, Overview};
use serde::Serialize;

use crate::Outcome;
use crate::table::write_json;
use crate::terminal::{frame_bar, grouped};

/// List the instances that two annotated recordings cut differently
///
/// Both are annotations of the same recording, with other parameters, methods or versions. Which numbers instances have
/// does not matter: instances belong together if more than half of one lies in the other, and groups that are not the
/// same points on both sides are listed, those of the most points first.
#[derive(Args)]
pub struct Arguments {
    /// The first recording (MCAP), as `divmerge annotate` writes it
    first: PathBuf,

    /// The second
    second: PathBuf,

    /// The topic of the clouds, as in /lidar/points or /lidar/points/instances [default: all annotated ones]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Most differences that are printed; the files have all
    #[arg(long, default_value_t = 20, value_name = "N")]
    limit: usize,

    /// Write all differences here, a line each
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Write all differences here
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// A difference and where it is.
#[derive(Serialize)]
struct Found {
    topic: String,
    frame: u64,
    /// Seconds from the start of the recording.
    seconds: f64,
    /// A point of it, metres, frame of the cloud.
    at: [f32; 3],
    #[serde(flatten)]
    difference: Difference,
}

/// What was looked at.
#[derive(Default)]
struct Tally {
    frames: u64,
    differing_frames: u64,
    points: u64,
    differing_points: u64,
    instances: [u64; 2],
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    for output in arguments.csv.iter().chain(&arguments.json) {
        crate::refuse_existing(output, arguments.force)?;
    }
    let (mut found, mut tally) = (Vec::new(), Tally::default());
    for topic in topics(arguments)? {
        compare(arguments, &topic, &mut found, &mut tally)?;
    }
    found.sort_by_key(|found| std::cmp::Reverse(found.difference.points));
    print(&found, &tally, arguments.limit);
    if let Some(csv) = &arguments.csv {
        divmerge::io::write_file(csv, as_csv(&found).as_bytes(), arguments.force)?;
        println!("wrote {}", csv.display());
    }
    if let Some(json) = &arguments.json {
        write_json(json, &found, arguments.force)?;
        println!("wrote {}", json.display());
    }
    Ok(Outcome::Done)
}

/// The annotated topics of both recordings.
fn topics(arguments: &Arguments) -> Result<Vec<String>> {
    let annotated = |path: &Path| -> Result<Vec<String>> {
        let overview = Overview::read(path)?;
        let topics: Vec<String> =
            annotated_topics(&overview).into_iter().map(str::to_owned).collect();
        if topics.is_empty() {
            bail!("{}: no annotated topic (run `divmerge annotate`)", path.display());
        }
        Ok(topics)
    };
    let (first, second) = (annotated(&arguments.first)?, annotated(&arguments.second)?);
    if let Some(topic) = &arguments.topic {
        let is_meant =
            |have: &&String| *have == topic || have.strip_suffix("/instances") == Some(topic);
        let meant: Vec<String> =
            first.iter().filter(is_meant).filter(|have| second.contains(have)).cloned().collect();
        if meant.is_empty() {
            let (first, second) = (first.join(", "), second.join(", "));
            bail!("`{topic}` is not annotated in both: the first has {first}, the second {second}");
        }
        return Ok(meant);
    }
    if first != second {
        let (first, second) = (first.join(", "), second.join(", "));
        bail!(
            "annotated topics differ: the first has {first}, the second {second}; choose by --topic"
        );
    }
    Ok(first)
}

fn compare(
    arguments: &Arguments,
    topic: &str,
    found: &mut Vec<Found>,
    tally: &mut Tally,
) -> Result<()> {
    let open = |path: &Path| CloudMessages::open(path, Some(topic), 0..=u64::MAX);
    let (mut first, mut second) = (open(&arguments.first)?, open(&arguments.second)?);
    let (counts, start_ns) = ([first.message_count(), second.message_count()], first.start_ns());
    if counts[0] != counts[1] {
        bail!("{topic}: {} clouds in the first, {} in the second", counts[0], counts[1]);
    }
    let bar = frame_bar("comparing", counts[0]);
    while let (Some(a), Some(b)) = (first.next(), second.next()) {
        let (a, b) = (a?, b?);
        let place = || format!("frame {} of {topic}", a.number);
        let seconds = a.log_time.saturating_sub(start_ns) as f64 * 1e-9;
        let (number, here) = (a.number, frame(&a, &b, tally).with_context(place)?);
        let located = here.into_iter().map(|(difference, at)| Found {
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
    first: &CloudMessage,
    second: &CloudMessage,
    tally: &mut Tally,
) -> Result<Vec<(Difference, [f32; 3])>> {
    let (a, b) = (first.decode()?, second.decode()?);
    let cloud = a.to_cloud(None)?;
    if first.log_time != second.log_time || a.point_count() != b.point_count() {
        bail!(
            "the first has {} points at {} ns, the second {} at {} ns: not annotations of one recording",
            grouped(a.point_count() as u64),
            first.log_time,
            grouped(b.point_count() as u64),
            second.log_time
        );
    }
    let (a, b) = (a.column_u32("instance")?, b.column_u32("instance")?);
    let found = differences(&a, &b);
    tally.frames += 1;
    tally.differing_frames += u64::from(!found.is_empty());
    tally.points += a.len() as u64;
    tally.differing_points += found.iter().map(|found| found.points).sum::<u64>();
    for (count, ids) in tally.instances.iter_mut().zip([&a, &b]) {
        *count += u64::from(ids.iter().copied().max().unwrap_or(0));
    }
    let place = |found: Difference| {
        let at = cloud.position(found.example as usize);
        (found, at)
    };
    Ok(found.into_iter().map(place).collect())
}

fn print(found: &[Found], tally: &Tally, limit: usize) {
    println!(
        "{} clouds, {} of them cut differently: {} differences, {} of {} points; {} instances in the first, {} in \
         the second",
        grouped(tally.frames),
        grouped(tally.differing_frames),
        grouped(found.len() as u64),
        grouped(tally.differing_points),
        grouped(tally.points),
        grouped(tally.instances[0]),
        grouped(tally.instances[1]),
    );
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

/// Some instances, as in `3, 7, 12 and 5 more`.
fn ids(ids: &[u32]) -> String {
    const NAMED: usize = 6;
    let named: Vec<String> = ids.iter().take(NAMED).map(u32::to_string).collect();
    match ids.len() {
        0 => "none".to_owned(),
        n if n > NAMED => format!("{} and {} more", named.join(", "), n - NAMED),
        _ => named.join(", "),
    }
}

fn as_csv(found: &[Found]) -> String {
    let all = |ids: &[u32]| ids.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
    let line = |found: &Found| {
        let Found { topic, frame, seconds, at: [x, y, z], difference } = found;
        let topic = topic.replace('"', "\"\"");
        let (points, change) = (difference.points, difference.change.name());
        let (first, second) = (all(&difference.first), all(&difference.second));
        format!("\"{topic}\",{frame},{seconds:.9},{points},{change},{x},{y},{z},{first},{second}\n")
    };
    let head = "topic,frame,seconds,points,change,x,y,z,first,second\n".to_owned();
    std::iter::once(head).chain(found.iter().map(line)).collect()
}
