//! `divmerge info`

mod facts;
mod geometry;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;

use facts::{Cloud, GeometryOptions, Info, Topic, cloud_facts};

use crate::cli::arguments::geometry::GeometryArguments;
use crate::cli::exit::Outcome;
use crate::datasets::bag::{Bag, METADATA_FILE};
use crate::frames::{CloudTopic, EncodedClouds, Selection, annotated_topics};
use crate::messages::clouds::CloudChannel;
use crate::recording::{Channel, Overview};

/// Show a recording's topics and the geometry of its clouds
///
/// For each cloud topic, from its first cloud with a return: fields; geometry (how rows and columns
/// were found and why, beams and their spacing, field of view, whether the scan closes, multiple
/// returns per shot, multiple sensors, the ground) and the options that change it; and the choice
/// of `--semantics auto`.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP), or a folder of recordings: that of a rosbag2 recording, or of .mcap
    /// files
    #[arg(value_name = "FILE")]
    input: PathBuf,

    #[command(flatten)]
    geometry: GeometryArguments,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let is_folder = arguments.input.is_dir();
    let files = match is_folder {
        true => recordings_in(&arguments.input)?,
        false => vec![arguments.input.clone()],
    };
    let (mut infos, mut is_complete) = (Vec::new(), true);
    for file in &files {
        let info = info(file, &arguments.geometry)?;
        is_complete &= info.complete;
        match arguments.json {
            true => infos.push(info),
            false => text::print(&info),
        }
    }
    match infos.as_slice() {
        [info] if !is_folder => println!("{}", serde_json::to_string_pretty(info)?),
        _ if arguments.json => println!("{}", serde_json::to_string_pretty(&infos)?),
        _ => {}
    }
    Ok(Outcome::of(is_complete))
}

/// The recordings of a rosbag2 folder in their order, or those in another folder by name.
fn recordings_in(folder: &Path) -> Result<Vec<PathBuf>> {
    if folder.join(METADATA_FILE).is_file() {
        return Ok(Bag::open(folder)?.files.iter().map(|file| folder.join(file)).collect());
    }
    let reading = || format!("reading {}", folder.display());
    let entries: Vec<_> =
        std::fs::read_dir(folder).and_then(Iterator::collect).with_context(reading)?;
    let is_recording = |name: &str| Bag::unpacked_name(name).ends_with(".mcap");
    let paths = entries.into_iter().map(|entry: std::fs::DirEntry| entry.path());
    let mut files: Vec<PathBuf> = paths
        .filter(|path| path.file_name().and_then(|name| name.to_str()).is_some_and(is_recording))
        .collect();
    if files.is_empty() {
        bail!("{}: the folder has no {METADATA_FILE} and no .mcap file", folder.display());
    }
    files.sort();
    Ok(files)
}

fn info(file: &Path, geometry: &GeometryArguments) -> Result<Info> {
    let overview = Overview::read(file)?;
    let mut options = GeometryOptions::default();
    geometry.set(&mut options.projection);
    (options.unit, options.crop) = geometry.coordinates.values();
    options.frames = geometry.frames(file)?;
    options.ego = geometry.ego(file, &options.frames, &options.projection)?;
    let (clouds, mut problems) = first_clouds(&overview, &options)?;
    problems.extend(overview.problems.iter().cloned());
    Ok(Info {
        file: overview.path.clone(),
        bytes: overview.file_size,
        profile: overview.profile.clone(),
        library: overview.library.clone(),
        complete: overview.is_complete,
        messages: overview.message_count,
        seconds: overview
            .start_ns
            .zip(overview.end_ns)
            .map_or(0.0, |(start, end)| end.saturating_sub(start) as f64 * 1e-9),
        compression: overview.compression.keys().cloned().collect(),
        attachments: overview.attachment_count,
        metadata: overview.metadata_count,
        problems,
        topics: topics(&overview, clouds),
    })
}

fn topics(overview: &Overview, mut clouds: BTreeMap<u16, Cloud>) -> Vec<Topic> {
    let describe = |channel: &Channel| {
        let schema = overview.schema_of(channel.id);
        Topic {
            topic: channel.topic.clone(),
            type_name: schema.map(|schema| schema.name.clone()).unwrap_or_default(),
            encoding: channel.message_encoding.clone(),
            messages: overview.message_counts.get(&channel.id).copied().unwrap_or(0),
            cloud: clouds.remove(&channel.id),
        }
    };
    overview.channels.values().map(describe).collect()
}

/// The first cloud with a return of each cloud channel, reading no farther than needed.
fn first_clouds(
    overview: &Overview,
    options: &GeometryOptions,
) -> Result<(BTreeMap<u16, Cloud>, Vec<String>)> {
    let annotated = annotated_topics(overview);
    let mut found = BTreeMap::new();
    let mut waiting: BTreeMap<u16, (CloudTopic, Option<String>)> = BTreeMap::new();
    for channel in overview.channels.values() {
        let messages = overview.message_counts.get(&channel.id).copied().unwrap_or(0);
        let note = match CloudChannel::of(overview, channel) {
            CloudChannel::Other => continue,
            CloudChannel::Unreadable(unreadable) => format!("not read: {}", unreadable.reason),
            CloudChannel::Readable(_) if annotated.contains(channel.topic.as_str()) => {
                "made by an earlier `annotate`".to_owned()
            }
            CloudChannel::Readable(format) => {
                if messages > 0 {
                    let topic = channel.topic.as_str().into();
                    waiting.insert(channel.id, (CloudTopic { topic, format }, None));
                }
                continue;
            }
        };
        found.insert(channel.id, Cloud { note: Some(note), facts: None });
    }
    let mut problems = Vec::new();
    let channels = waiting.iter().map(|(&id, (cloud, _))| (id, cloud.clone())).collect();
    for cloud in EncodedClouds::of_channels(overview, channels, &Selection::default())? {
        let cloud = match cloud {
            Ok(cloud) => cloud,
            Err(error) => {
                problems.push(error.to_string());
                break;
            }
        };
        let channel = cloud.header.channel_id;
        let Some((_, note)) = waiting.get_mut(&channel) else {
            continue;
        };
        match cloud_facts(&cloud, options) {
            Ok(facts) if facts.geometry.returns > 0 => {
                waiting.remove(&channel);
                found.insert(channel, Cloud { note: None, facts: Some(facts) });
            }
            Ok(_) => *note = Some("no cloud has a return".to_owned()),
            Err(error) => *note = Some(error.to_string()),
        }
        if waiting.is_empty() {
            break;
        }
    }
    for (channel, (_, note)) in waiting {
        found.insert(channel, Cloud { note, facts: None });
    }
    Ok((found, problems))
}
