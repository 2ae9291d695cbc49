//! `divmerge info`

mod words;

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use divmerge::annotate::is_annotation;
use divmerge::io::{
    Channel, CloudChannel, CloudFormat, Overview, ReadFilter, Record, RecordingReader,
};
use divmerge::range_image::{Geometry, ProjectionParams, RangeImage};
use divmerge::semantics::GroundParams;
use divmerge::semantics::ground::{self, GroundPose};
use divmerge::sensor_frame::{SensorFrame, Transforms};
use divmerge::workers::Workers;
use serde::Serialize;

use crate::Outcome;
use crate::geometry::GeometryArguments;
use crate::terminal::grouped;

/// Show a recording's topics, and what its clouds look like
///
/// For each cloud topic, from its first cloud that has a return: fields; what its geometry is taken for (how rows
/// and columns were found and why, beams and their spacing, field of view, whether the scan closes, several
/// returns of one shot, several sensors, which way the ground lies) and what would change that; and what
/// `--semantics auto` would choose.
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

/// What was asked for about geometry.
#[derive(Default)]
struct Asked {
    projection: ProjectionParams,
    frame: SensorFrame,
    transforms: Transforms,
}

/// What is known of a recording.
#[derive(Serialize)]
struct Info {
    file: PathBuf,
    bytes: u64,
    profile: String,
    library: String,
    complete: bool,
    messages: u64,
    seconds: f64,
    compression: Vec<String>,
    attachments: u64,
    metadata: u64,
    problems: Vec<String>,
    topics: Vec<Topic>,
}

#[derive(Serialize)]
struct Topic {
    topic: String,
    #[serde(rename = "type")]
    type_name: String,
    encoding: String,
    messages: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    cloud: Option<Cloud>,
}

/// What the first cloud of a topic tells.
#[derive(Serialize)]
struct Cloud {
    note: Option<String>,
    #[serde(flatten)]
    look: Option<Look>,
}

#[derive(Serialize)]
struct Look {
    frame_id: String,
    height: u32,
    width: u32,
    point_step: u32,
    fields: Vec<String>,
    #[serde(flatten)]
    geometry: Geometry,
    /// How the ground lies, where one is found.
    ground: Option<GroundPose>,
    /// Roll, pitch and yaw by which the cloud was turned, degrees; `None` if it was not.
    turned_degrees: Option<[f64; 3]>,
    auto: String,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let overview = Overview::read(&arguments.file)?;
    let mut asked = Asked::default();
    arguments.geometry.set(&mut asked.projection);
    (asked.frame, asked.transforms) = arguments.geometry.frame(&arguments.file)?;
    let (clouds, mut problems) = first_clouds(&overview, &asked)?;
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
        print(&info);
    }
    Ok(if info.complete { Outcome::Done } else { Outcome::Incomplete })
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
fn first_clouds(overview: &Overview, asked: &Asked) -> Result<(BTreeMap<u16, Cloud>, Vec<String>)> {
    let mut found = BTreeMap::new();
    let mut waiting: BTreeMap<u16, (CloudFormat, Option<String>)> = BTreeMap::new();
    for channel in overview.channels.values() {
        let messages = overview.message_counts.get(&channel.id).copied().unwrap_or(0);
        let note = match CloudChannel::of(overview, channel) {
            CloudChannel::Other => continue,
            CloudChannel::Unreadable(unreadable) => format!("not read: {}", unreadable.reason),
            CloudChannel::Readable(_) if is_annotation(overview, &channel.topic) => {
                "made by an earlier `annotate`".to_owned()
            }
            CloudChannel::Readable(format) => {
                if messages > 0 {
                    waiting.insert(channel.id, (format, None));
                }
                continue;
            }
        };
        found.insert(channel.id, Cloud { note: Some(note), look: None });
    }
    let mut problems = Vec::new();
    let numbered = waiting.keys().map(|&id| (id, overview.channels[&id].topic.clone())).collect();
    let wanted = ReadFilter { numbered, others: false, ..ReadFilter::default() };
    let mut reader = RecordingReader::open_filtered(overview, &wanted, &Workers::none())?;
    while !waiting.is_empty() {
        let record = match reader.next_record() {
            Ok(Some(record)) => record,
            Ok(None) => break,
            Err(error) => {
                problems.push(error.to_string());
                break;
            }
        };
        let Record::Message { header, data, .. } = record else {
            continue;
        };
        let Some((format, note)) = waiting.get_mut(&header.channel_id) else {
            continue;
        };
        match look(*format, &data, asked) {
            Ok(look) if look.geometry.returns > 0 => {
                waiting.remove(&header.channel_id);
                found.insert(header.channel_id, Cloud { note: None, look: Some(look) });
            }
            Ok(_) => *note = Some("no cloud has a return".to_owned()),
            Err(error) => *note = Some(error.to_string()),
        }
    }
    for (channel, (_, note)) in waiting {
        found.insert(channel, Cloud { note, look: None });
    }
    Ok((found, problems))
}

fn look(format: CloudFormat, message: &[u8], asked: &Asked) -> divmerge::Result<Look> {
    let wire = format.decode(message)?;
    let mut cloud = wire.to_cloud(None)?;
    cloud.turn(asked.frame.turn(&wire.frame_id, &asked.transforms)?);
    let image = RangeImage::new(&cloud, &asked.projection);
    let describe = |field: &divmerge::io::PointField| {
        let count = if field.count == 1 { String::new() } else { format!("[{}]", field.count) };
        let datatype = format!("{:?}", field.datatype).to_lowercase();
        format!("{} {datatype}{count}", field.name)
    };
    let (roll, pitch, yaw) = cloud.turned.euler_angles();
    let is_turned = cloud.turned.angle() > 0.0;
    Ok(Look {
        frame_id: wire.frame_id.clone(),
        height: wire.height,
        width: wire.width,
        point_step: wire.point_step,
        fields: wire.fields.iter().map(describe).collect(),
        geometry: Geometry::new(&cloud, &image),
        ground: ground::pose(&cloud, &image, &GroundParams::default()),
        turned_degrees: is_turned.then(|| [roll, pitch, yaw].map(f64::to_degrees)),
        auto: wire.semantic_field().map_or("ground".to_owned(), |field| format!("field:{field}")),
    })
}

fn print(info: &Info) {
    println!("{} ({} bytes)", info.file.display(), grouped(info.bytes));
    let named = |name: &str| {
        if name.is_empty() { "none".to_owned() } else { name.to_owned() }
    };
    let compression: Vec<String> = info.compression.iter().map(|name| named(name)).collect();
    println!(
        "  profile {}, written by {}; {} messages in {:.1} s; compression {}; {} attachments, {} \
         metadata records",
        named(&info.profile),
        named(&info.library),
        grouped(info.messages),
        info.seconds,
        if compression.is_empty() { "none".to_owned() } else { compression.join(", ") },
        info.attachments,
        info.metadata
    );
    for problem in &info.problems {
        println!("  warning: {problem}");
    }
    let width = info.topics.iter().map(|topic| topic.topic.len()).max().unwrap_or(0);
    for topic in &info.topics {
        let type_name = named(&topic.type_name);
        println!(
            "  {:<width$}  {type_name} ({}), {} messages",
            topic.topic,
            topic.encoding,
            grouped(topic.messages)
        );
        if let Some(cloud) = &topic.cloud {
            print_cloud(cloud);
        }
    }
}

fn print_cloud(cloud: &Cloud) {
    if let Some(note) = &cloud.note {
        println!("      {note}");
    }
    let Some(look) = &cloud.look else {
        return;
    };
    println!(
        "      {} x {} points of {} bytes in frame `{}`, {} returns",
        look.height,
        look.width,
        look.point_step,
        look.frame_id,
        grouped(look.geometry.returns as u64)
    );
    println!("      fields: {}", look.fields.join(", "));
    for line in words::geometry(look) {
        println!("      {line}");
    }
    println!("      --semantics auto: {}", look.auto);
}
