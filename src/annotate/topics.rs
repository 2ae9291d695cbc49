//! Which topics are annotated, and what the added ones are called and carry.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::{Error, Result};
use crate::io::frames::cloud_format;
use crate::io::qos::{Durability, QOS_KEY, connection_metadata, qos_metadata};
use crate::io::{Channel, CloudChannel, CloudFormat, MessageSchema, Overview};

/// Whether a topic is one that an earlier annotation added beside its cloud topic: the clouds are there, or the
/// objects that come with it.
pub fn is_annotation(overview: &Overview, topic: &str) -> bool {
    let has_clouds = |topic: &str| {
        overview.channels_of(topic).any(|channel| cloud_format(overview, channel).is_some())
    };
    let is_there = |topic: &str| overview.channels_of(topic).next().is_some();
    topic
        .strip_suffix(INSTANCES)
        .is_some_and(|cloud| has_clouds(cloud) || is_there(&format!("{cloud}{OBJECTS}")))
}

/// The topics that an earlier annotation added, `T/instances` of each cloud topic T.
pub fn annotated_topics(overview: &Overview) -> BTreeSet<&str> {
    let topics = overview.channels.values().map(|channel| channel.topic.as_str());
    topics.filter(|topic| is_annotation(overview, topic)).collect()
}

/// What is added to the name of a cloud topic for its annotated clouds.
pub const INSTANCES: &str = "/instances";

/// What is added to the name of a cloud topic for its boxes.
pub const OBJECTS: &str = "/objects";

/// A channel whose clouds are clustered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CloudTopic {
    /// Its topic.
    pub topic: String,
    /// Format of its messages.
    pub format: CloudFormat,
}

/// The channels whose clouds are clustered, with their topics.
///
/// # Errors
/// [`Error::NoCloud`] if there is none, or none of a topic that was asked for.
pub fn choose(overview: &Overview, topics: &[String]) -> Result<BTreeMap<u16, CloudTopic>> {
    choose_beside(overview, topics, None)
}

/// The same, without a topic that says something of the clouds of others, unless it is asked for by name.
///
/// # Errors
/// Those of [`choose`].
pub fn choose_beside(
    overview: &Overview,
    topics: &[String],
    beside: Option<&str>,
) -> Result<BTreeMap<u16, CloudTopic>> {
    let is_beside = |topic: &str| topics.is_empty() && beside == Some(topic);
    let readable: BTreeMap<u16, CloudTopic> = overview
        .channels
        .values()
        .filter(|channel| !is_beside(&channel.topic))
        .filter_map(|channel| Some((channel.id, chosen(overview, channel, &[])?)))
        .collect();
    let no_cloud = |problem: String| Error::NoCloud { path: overview.path.clone(), problem };
    if readable.is_empty() {
        let damage = overview.problems.first().map(|problem| format!("; {problem}"));
        let (topics, damage) = (list(overview), damage.unwrap_or_default());
        return Err(no_cloud(format!("no cloud topic that can be read; {topics}{damage}")));
    }
    let has = |topic: &String| readable.values().any(|have| have.topic == *topic);
    if let Some(missing) = topics.iter().find(|topic| !has(topic)) {
        if let Some(reason) = CloudChannel::why_unreadable(overview, missing) {
            return Err(no_cloud(format!("the topic `{missing}` cannot be read: {reason}")));
        }
        let known: Vec<&str> = readable.values().map(|have| have.topic.as_str()).collect();
        let known = known.join(", ");
        return Err(no_cloud(format!("no readable cloud topic `{missing}`; there is: {known}")));
    }
    Ok(readable
        .into_iter()
        .filter(|(_, have)| topics.is_empty() || topics.contains(&have.topic))
        .collect())
}

/// A channel whose clouds are clustered, as far as is known of the recording; none otherwise.
pub(super) fn chosen(
    overview: &Overview,
    channel: &Channel,
    topics: &[String],
) -> Option<CloudTopic> {
    let is_asked_for = topics.is_empty() || topics.contains(&channel.topic);
    let format = cloud_format(overview, channel)
        .filter(|_| is_asked_for && !is_annotation(overview, &channel.topic))?;
    Some(CloudTopic { topic: channel.topic.clone(), format })
}

/// Refuses a recording that has the topics that would be added.
pub(super) fn refuse_annotated<'a>(
    overview: &Overview,
    topics: impl IntoIterator<Item = &'a String>,
) -> Result<()> {
    for topic in topics {
        for end in [INSTANCES, OBJECTS] {
            let added = format!("{topic}{end}");
            if overview.channels_of(&added).next().is_some() {
                let problem =
                    format!("already has a topic {added}: annotate the recording it was made from");
                let path = overview.path.clone();
                return Err(Error::Conflict { path, problem });
            }
        }
    }
    Ok(())
}

fn list(overview: &Overview) -> String {
    if overview.channels.is_empty() {
        return "it has no topic at all".into();
    }
    let describe = |channel: &Channel| {
        let schema = overview.schema_of(channel.id).map(|schema| schema.name.as_str());
        let reason = match CloudChannel::of(overview, channel) {
            CloudChannel::Unreadable(unreadable) => format!(": {}", unreadable.reason),
            _ => String::new(),
        };
        format!("{} ({}){reason}", channel.topic, schema.unwrap_or("no schema"))
    };
    let topics: Vec<String> = overview.channels.values().map(describe).collect();
    format!("its topics:\n  {}", topics.join("\n  "))
}

/// Quality-of-service metadata for an added channel: the cloud's own where it has some, else reliable, volatile, keep
/// the last ten.
fn qos(cloud: &Channel) -> BTreeMap<String, String> {
    let own = cloud.metadata.get(QOS_KEY).filter(|own| !own.trim().is_empty());
    match own {
        Some(own) => BTreeMap::from([(QOS_KEY.to_owned(), own.clone())]),
        None => qos_metadata(10, Durability::Volatile),
    }
}

/// Metadata of an added channel of a type of its own: what recorders of its kind of messages note.
pub(crate) fn added_metadata(
    topic: &str,
    schema: &MessageSchema,
    cloud: &Channel,
) -> BTreeMap<String, String> {
    connection_metadata(topic, schema, || qos(cloud))
}

/// Metadata of the channel of a topic's instances, where they are of the same type as the cloud: the cloud's own, so
/// with the same sum or hash of the type, under the name of the added topic.
pub(super) fn channel_metadata(cloud: &Channel, format: CloudFormat) -> BTreeMap<String, String> {
    let mut metadata = cloud.metadata.clone();
    if let Some(topic) = metadata.get_mut("topic").filter(|topic| **topic == cloud.topic) {
        topic.push_str(INSTANCES);
    }
    if format.profile() == "ros2" {
        metadata.extend(qos(cloud));
    }
    metadata
}
