//! Which topics are annotated, and what the added ones are called and carry.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::{Error, Result};
use crate::io::frames::is_readable_cloud;
use crate::io::qos::{Durability, QOS_KEY, qos_profile};
use crate::io::{Channel, Overview};

/// Whether a topic is one that an earlier annotation added beside its cloud topic.
pub fn is_annotation(overview: &Overview, topic: &str) -> bool {
    topic
        .strip_suffix(INSTANCES)
        .is_some_and(|cloud| overview.channels_of(&format!("{cloud}{OBJECTS}")).next().is_some())
}

/// The topics that an earlier annotation added, `T/instances` of each cloud topic T.
pub fn annotated_topics(overview: &Overview) -> BTreeSet<&str> {
    let topics = overview.channels.values().map(|channel| channel.topic.as_str());
    topics.filter(|topic| is_annotation(overview, topic)).collect()
}

pub(super) const INSTANCES: &str = "/instances";

pub(super) const OBJECTS: &str = "/objects";

/// The channels whose clouds are clustered, with their topics.
///
/// # Errors
/// [`Error::NoCloud`] if there is none, or none of a topic that was asked for.
pub fn choose(overview: &Overview, topics: &[String]) -> Result<BTreeMap<u16, String>> {
    let readable: BTreeMap<u16, String> = overview
        .channels
        .values()
        .filter(|channel| is_readable_cloud(overview, channel))
        .filter(|channel| !is_annotation(overview, &channel.topic))
        .map(|channel| (channel.id, channel.topic.clone()))
        .collect();
    let no_cloud = |problem: String| Error::NoCloud { path: overview.path.clone(), problem };
    if readable.is_empty() {
        return Err(no_cloud(format!("no cloud topic that can be read; {}", list(overview))));
    }
    if let Some(missing) = topics.iter().find(|&topic| !readable.values().any(|have| have == topic))
    {
        let known = readable.values().map(String::as_str).collect::<Vec<_>>().join(", ");
        return Err(no_cloud(format!("no readable cloud topic `{missing}`; there is: {known}")));
    }
    Ok(readable
        .into_iter()
        .filter(|(_, topic)| topics.is_empty() || topics.contains(topic))
        .collect())
}

/// Whether a channel's clouds are clustered, as far as is known of the recording.
pub(super) fn is_chosen(overview: &Overview, channel: &Channel, topics: &[String]) -> bool {
    is_readable_cloud(overview, channel)
        && !is_annotation(overview, &channel.topic)
        && (topics.is_empty() || topics.contains(&channel.topic))
}

/// Refuses a recording that has the topics that would be added.
pub(super) fn refuse_annotated(overview: &Overview, clouds: &BTreeMap<u16, String>) -> Result<()> {
    for topic in clouds.values() {
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
        format!("{} ({})", channel.topic, schema.unwrap_or("no schema"))
    };
    let topics: Vec<String> = overview.channels.values().map(describe).collect();
    format!("its topics: {}", topics.join(", "))
}

/// Quality-of-service metadata for an added channel: the cloud's own where it has some, else rosbag2's
/// form of reliable, volatile, keep the last ten.
pub(crate) fn qos(cloud: &Channel) -> BTreeMap<String, String> {
    let own = cloud.metadata.get(QOS_KEY).filter(|own| !own.trim().is_empty());
    let usual = || qos_profile(10, Durability::Volatile);
    BTreeMap::from([(QOS_KEY.to_owned(), own.cloned().unwrap_or_else(usual))])
}

/// Metadata of the instances' channel: of the same type as the cloud, so with the same type hash.
pub(super) fn channel_metadata(
    cloud: &Channel,
    qos: &BTreeMap<String, String>,
) -> BTreeMap<String, String> {
    let mut metadata = cloud.metadata.clone();
    metadata.extend(qos.clone());
    metadata
}
