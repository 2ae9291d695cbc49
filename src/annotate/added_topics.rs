//! What the added topics carry, and that they are not there yet.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use crate::error::{Conflict, Error, Result};
use crate::frames::{INSTANCES, OBJECTS};
use crate::messages::clouds::CloudFormat;
use crate::messages::definitions::MessageSchema;
use crate::messages::qos::{Durability, QOS_KEY, connection_metadata, qos_metadata};
use divmerge_recording::{Channel, Overview};

/// Refuses a recording that has the topics that would be added beside those of its clouds.
pub(super) fn refuse_annotated<'a>(
    path: &Path,
    names: &BTreeSet<&str>,
    clouds: impl IntoIterator<Item = &'a Arc<str>>,
) -> Result<()> {
    for topic in clouds {
        for end in [INSTANCES, OBJECTS] {
            let added = format!("{topic}{end}");
            if names.contains(added.as_str()) {
                return Err(already_there(path, added));
            }
        }
    }
    Ok(())
}

/// Refuses a recording that has a topic that would be added.
pub(crate) fn refuse_topic(overview: &Overview, topic: String) -> Result<()> {
    let is_there = overview.channels_of(&topic).next().is_some();
    match is_there {
        true => Err(already_there(&overview.path, topic)),
        false => Ok(()),
    }
}

/// The error that a topic that would be added is there already.
pub(super) fn already_there(path: &Path, topic: String) -> Error {
    Error::Conflict { path: path.to_owned(), problem: Conflict::TopicExists { topic } }
}

/// Quality-of-service metadata for an added channel: the cloud's own where it has some, else
/// reliable, volatile, keep the last ten.
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

/// Metadata of the channel of a topic's instances, where they are of the same type as the cloud:
/// the cloud's own, so with the same sum or hash of the type, under the name of the added topic.
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
