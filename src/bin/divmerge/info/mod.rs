//! `divmerge info`

mod facts;
mod geometry;
mod text;

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use divmerge::frames::{CloudTopic, EncodedClouds, Selection, annotated_topics};
use divmerge::messages::clouds::CloudChannel;
use divmerge::recording::{Channel, Overview};

use crate::arguments::geometry::GeometryArguments;
use crate::exit::Outcome;
use facts::{Cloud, GeometryOptions, Info, Topic, cloud_facts};

/// Show a recording's topics and the geometry of its clouds
///
/// For each cloud topic, from its first cloud with a return: fields; geometry (how rows and columns
/// were found and why, beams and their spacing, field of view, whether the scan closes, multiple
/// returns per shot, multiple sensors, the ground) and the options that change it; and the choice
/// of `--semantics auto`.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP)
    file: PathBuf,

    #[command(flatten)]
    geometry: GeometryArguments,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let overview = Overview::read(&arguments.file)?;
    let mut options = GeometryOptions::default();
    arguments.geometry.set(&mut options.projection);
    (options.unit, options.crop) = arguments.geometry.coordinates.values();
    options.frames = arguments.geometry.frames(&arguments.file)?;
    let (clouds, mut problems) = first_clouds(&overview, &options)?;
    problems.extend(overview.problems.iter().cloned());
    let info = Info {
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
    };
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&info)?);
    } else {
        text::print(&info);
    }
    Ok(Outcome::of(info.complete))
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
