//! The channels of what is added.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::annotate::added_topics::{added_metadata, channel_metadata};
use crate::annotate::types::MessageTypes;
use crate::error::Result;
use crate::frames::{CloudTopic, INSTANCES, OBJECTS};
use crate::messages::clouds::CloudFormat;
use crate::messages::definitions::MessageSchema;
use divmerge_recording::{Channel, Overview, RecordingWriter, Schema};

/// The channels of what is added to a topic's clouds.
#[derive(Clone, Copy)]
pub(super) struct Added {
    pub(super) instances: u16,
    pub(super) objects: u16,
}

/// The channels of what is added, for each topic and format, once they are there.
pub(super) struct AddedChannels {
    types: MessageTypes,
    /// Whether annotated clouds take the place of the clouds.
    is_in_place: bool,
    added: BTreeMap<(Arc<str>, CloudFormat), Added>,
}

impl AddedChannels {
    pub(super) fn new(types: MessageTypes, is_in_place: bool) -> Self {
        AddedChannels { types, is_in_place, added: BTreeMap::new() }
    }

    /// The channels of what is added to a channel's clouds, declared at the first of its topic.
    /// Annotated clouds that take the place of the clouds are on the channel of those.
    pub(super) fn of_clouds(
        &mut self,
        channel: u16,
        cloud: &CloudTopic,
        overview: &Overview,
        writer: &mut RecordingWriter,
    ) -> Result<Added> {
        let written = self.types.format(cloud.format);
        let key = (Arc::clone(&cloud.topic), written);
        let added = match self.added.get(&key) {
            Some(&added) => added,
            None => {
                let schema = overview.schema_of(channel).filter(|_| cloud.format == written);
                let objects = self.types.objects(written)?;
                let channel = &overview.channels[&channel];
                let instances = match self.is_in_place {
                    true => channel.id,
                    false => add_instances(channel, schema, written, writer)?,
                };
                let topic = format!("{}{OBJECTS}", channel.topic);
                let objects = declare(&topic, &objects, channel, writer)?;
                *self.added.entry(key).or_insert(Added { instances, objects })
            }
        };
        Ok(match self.is_in_place {
            true => Added { instances: channel, ..added },
            false => added,
        })
    }
}

/// The channel of the annotated clouds: with the clouds' own schema if there is one to be kept that
/// defines them.
fn add_instances(
    cloud: &Channel,
    schema: Option<&Schema>,
    written: CloudFormat,
    writer: &mut RecordingWriter,
) -> Result<u16> {
    let topic = format!("{}{INSTANCES}", cloud.topic);
    let whole = written.schema();
    match schema.filter(|schema| whole.is_defined_by(&schema.encoding, &schema.data)) {
        Some(Schema { name, encoding, data, .. }) => {
            let metadata = channel_metadata(cloud, written);
            let schema = (name.as_str(), encoding.as_str(), data.as_slice());
            Ok(writer.declare_channel(&topic, schema, &cloud.message_encoding, &metadata)?)
        }
        None => declare(&topic, &whole, cloud, writer),
    }
}

/// A channel of a type of its own beside a cloud's.
fn declare(
    topic: &str,
    schema: &MessageSchema,
    cloud: &Channel,
    writer: &mut RecordingWriter,
) -> Result<u16> {
    let metadata = added_metadata(topic, schema, cloud);
    let definition = (schema.name, schema.encoding, &*schema.data);
    Ok(writer.declare_channel(topic, definition, schema.message_encoding, &metadata)?)
}
