//! Which topics of a recording carry clouds, and which of these are looked at.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::error::{Error, NoCloud, Result};
use crate::messages::clouds::{CloudChannel, CloudFormat};
use divmerge_recording::{Channel, Overview};

/// What is added to the name of a cloud topic for its annotated clouds.
pub const INSTANCES: &str = "/instances";

/// What is added to the name of a cloud topic for its boxes.
pub const OBJECTS: &str = "/objects";

/// The topic of a channel that carries clouds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CloudTopic {
    /// Its name.
    pub topic: Arc<str>,
    /// Format of the channel's messages.
    pub format: CloudFormat,
}

impl CloudTopic {
    /// `None` of a channel whose messages are no clouds, or clouds that cannot be read.
    pub(crate) fn of(overview: &Overview, channel: &Channel) -> Option<Self> {
        let format = CloudChannel::of(overview, channel).format()?;
        Some(CloudTopic { topic: channel.topic.as_str().into(), format })
    }
}

impl CloudChannel {
    /// What a channel of a recording carries, told from the name of its type and the encoding of
    /// its messages.
    pub fn of(overview: &Overview, channel: &Channel) -> Self {
        CloudChannel::named(schema_name(overview, channel), &channel.message_encoding)
    }

    /// Why a topic's clouds cannot be read, if it has some that cannot.
    pub fn why_unreadable(overview: &Overview, topic: &str) -> Option<String> {
        let channels = overview.channels_of(topic);
        channels.map(|channel| CloudChannel::of(overview, channel)).find_map(|found| match found {
            CloudChannel::Unreadable(unreadable) => Some(unreadable.reason),
            _ => None,
        })
    }
}

/// The name of the type of a channel's messages; empty where nothing says it.
pub(super) fn schema_name<'a>(overview: &'a Overview, channel: &Channel) -> &'a str {
    overview.schemas.get(&channel.schema_id).map_or("", |schema| &schema.name)
}

/// The last part of that name: `PointCloud2` of `sensor_msgs/msg/PointCloud2`.
pub(crate) fn type_name<'a>(overview: &'a Overview, channel: &Channel) -> &'a str {
    let name = schema_name(overview, channel);
    name.rsplit(['/', '.']).next().unwrap_or(name)
}

/// Whether a topic is one that an earlier annotation added beside its cloud topic: the clouds are
/// there, or the objects that come with it.
fn is_annotation(overview: &Overview, topic: &str) -> bool {
    let has_clouds = |topic: &str| {
        overview.channels_of(topic).any(|channel| CloudTopic::of(overview, channel).is_some())
    };
    let is_there = |topic: &str| overview.channels_of(topic).next().is_some();
    topic
        .strip_suffix(INSTANCES)
        .is_some_and(|cloud| has_clouds(cloud) || is_there(&format!("{cloud}{OBJECTS}")))
}

/// The topics that an earlier annotation added: `T/instances` of each cloud topic T, or beside
/// `T/objects`.
pub fn annotated_topics(overview: &Overview) -> BTreeSet<&str> {
    let topics = topic_names(overview);
    let channels = overview.channels.values();
    let clouds = channels.filter(|channel| CloudTopic::of(overview, channel).is_some());
    let clouds: BTreeSet<&str> = clouds.map(|channel| channel.topic.as_str()).collect();
    let is_added = |topic: &&str| {
        topic.strip_suffix(INSTANCES).is_some_and(|cloud| {
            clouds.contains(cloud) || topics.contains(format!("{cloud}{OBJECTS}").as_str())
        })
    };
    topics.iter().copied().filter(is_added).collect()
}

/// Names of the topics of a recording.
pub(crate) fn topic_names(overview: &Overview) -> BTreeSet<&str> {
    overview.channels.values().map(|channel| channel.topic.as_str()).collect()
}

/// The channels whose clouds are clustered: those of the topics that are named, or without names
/// all but the topic with the classes of other clouds and what an earlier annotation added.
///
/// # Errors
/// [`Error::NoCloud`] if there is none, or none of a topic that is named.
pub fn choose_topics(
    overview: &Overview,
    topics: &[String],
    class_topic: Option<&str>,
) -> Result<BTreeMap<u16, CloudTopic>> {
    let has_classes = |topic: &str| topics.is_empty() && class_topic == Some(topic);
    let annotated = annotated_topics(overview);
    let mut readable: BTreeMap<u16, CloudTopic> = overview
        .channels
        .values()
        .filter(|channel| !has_classes(&channel.topic))
        .filter(|channel| !annotated.contains(channel.topic.as_str()))
        .filter_map(|channel| Some((channel.id, CloudTopic::of(overview, channel)?)))
        .collect();
    if readable.is_empty() {
        return Err(no_readable_topic(overview));
    }
    let there: BTreeSet<&str> = readable.values().map(|have| &*have.topic).collect();
    if let Some(missing) = topics.iter().find(|topic| !there.contains(topic.as_str())) {
        return Err(no_such_topic(overview, missing, readable.values()));
    }
    let named: BTreeSet<&str> = topics.iter().map(String::as_str).collect();
    readable.retain(|_, have| named.is_empty() || named.contains(&*have.topic));
    Ok(readable)
}

/// The topic of a channel whose clouds are clustered, as far as is known of a stream.
pub(crate) fn clustered_topic(
    overview: &Overview,
    channel: &Channel,
    topics: &[String],
) -> Option<CloudTopic> {
    let is_named = topics.is_empty() || topics.contains(&channel.topic);
    let is_source = is_named && !is_annotation(overview, &channel.topic);
    CloudTopic::of(overview, channel).filter(|_| is_source)
}

/// The channels of the topic that is named, annotated or not; without a name those of the first
/// topic with clouds, else of the first that could have some.
///
/// # Errors
/// [`Error::NoCloud`] if there is no such topic, with what there is.
pub(super) fn single_topic(
    overview: &Overview,
    topic: Option<&str>,
) -> Result<(Arc<str>, BTreeMap<u16, CloudTopic>)> {
    let channels = overview.channels.values();
    let mut readable: BTreeMap<u16, CloudTopic> = channels
        .filter_map(|channel| Some((channel.id, CloudTopic::of(overview, channel)?)))
        .collect();
    let has_clouds = |(id, _): &(&u16, &CloudTopic)| message_count(overview, **id) > 0;
    let chosen = match topic {
        Some(topic) => readable.values().find(|have| *have.topic == *topic),
        None => {
            let with_clouds = readable.iter().find(has_clouds).map(|(_, have)| have);
            with_clouds.or(readable.values().next())
        }
    };
    let Some(CloudTopic { topic, .. }) = chosen.cloned() else {
        return Err(match topic {
            Some(topic) => no_such_topic(overview, topic, readable.values()),
            None => no_readable_topic(overview),
        });
    };
    readable.retain(|_, have| have.topic == topic);
    Ok((topic, readable))
}

fn no_readable_topic(overview: &Overview) -> Error {
    let damage = overview.problems.first().map(ToString::to_string);
    let problem = NoCloud::NoReadableTopic { topics: described(overview), damage };
    Error::NoCloud { path: overview.path.clone(), problem }
}

/// Why a topic that is named has no clouds that can be read, and which topics have.
fn no_such_topic<'a>(
    overview: &Overview,
    topic: &str,
    readable: impl Iterator<Item = &'a CloudTopic>,
) -> Error {
    let readable: BTreeSet<String> = readable.map(|have| have.topic.to_string()).collect();
    let unreadable = CloudChannel::why_unreadable(overview, topic);
    let topic = topic.to_owned();
    let problem = match unreadable {
        Some(reason) => NoCloud::UnreadableTopic { topic, reason },
        None if readable.is_empty() => return no_readable_topic(overview),
        None => NoCloud::NoSuchTopic { topic, readable: readable.into_iter().collect() },
    };
    Error::NoCloud { path: overview.path.clone(), problem }
}

/// The topics, each with its type and why its clouds cannot be read, where it has some.
fn described(overview: &Overview) -> Vec<String> {
    let describe = |channel: &Channel| {
        let schema = overview.schema_of(channel.id).map(|schema| schema.name.as_str());
        let reason = match CloudChannel::of(overview, channel) {
            CloudChannel::Unreadable(unreadable) => format!(": {}", unreadable.reason),
            _ => String::new(),
        };
        format!("{} ({}){reason}", channel.topic, schema.unwrap_or("no schema"))
    };
    overview.channels.values().map(describe).collect()
}

/// What an error says where a topic beside the clouds carries something else, or is not there.
pub(super) struct TopicWords {
    /// What can be read.
    pub(super) readable: &'static str,
    /// Stands before the topics that carry such.
    pub(super) on: &'static str,
    /// Stands where no topic carries such.
    pub(super) none: &'static str,
}

/// The channels of a topic beside the clouds, with how each is read; `of` knows that of all of
/// them.
///
/// # Errors
/// What a channel carries instead, or that there is no such topic, in words.
pub(super) fn channels_beside<T>(
    overview: &Overview,
    topic: &str,
    of: impl Fn(&Overview, &Channel) -> Option<T>,
    words: &TopicWords,
) -> std::result::Result<BTreeMap<u16, T>, String> {
    let mut channels = BTreeMap::new();
    for channel in overview.channels_of(topic) {
        let Some(read) = of(overview, channel) else {
            let what = overview.schema_of(channel.id).map_or("no schema", |schema| &schema.name);
            let encoding = &channel.message_encoding;
            return Err(format!("it carries {what} in encoding `{encoding}`; {}", words.readable));
        };
        channels.insert(channel.id, read);
    }
    if !channels.is_empty() {
        return Ok(channels);
    }
    let others = overview.channels.values().filter(|channel| of(overview, channel).is_some());
    let topics: BTreeSet<&str> = others.map(|channel| channel.topic.as_str()).collect();
    let others = match topics.is_empty() {
        true => words.none.to_owned(),
        false => {
            format!("{} {}", words.on, topics.into_iter().collect::<Vec<_>>().join(", "))
        }
    };
    Err(format!("{} has no such topic; {others}", overview.path.display()))
}

/// Messages of a topic, if the index counts them.
pub(crate) fn topic_count(overview: &Overview, topic: &str) -> Option<u64> {
    let counts =
        overview.channels_of(topic).map(|channel| overview.message_counts.get(&channel.id));
    counts.map(|count| count.copied()).sum()
}

/// Messages of a channel, as the index counts them.
pub(crate) fn message_count(overview: &Overview, channel: u16) -> u64 {
    overview.message_counts.get(&channel).copied().unwrap_or(0)
}
