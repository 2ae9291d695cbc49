//! The channels of what is added.

use super::Job;
use crate::annotate::Form;
use crate::annotate::topics::{INSTANCES, OBJECTS, added_metadata, channel_metadata};
use crate::error::Result;
use crate::io::{Channel, CloudFormat, MessageSchema, Schema};

/// The channels of what is added to a topic's clouds.
#[derive(Clone, Copy)]
pub(super) struct Added {
    pub(super) instances: u16,
    pub(super) objects: u16,
}

impl Job<'_> {
    /// The channels of what is added to a channel's clouds, declared at the first of its topic. Annotated clouds that take
    /// the place of the clouds stand on the channel of those.
    pub(super) fn channels_for(&mut self, cloud_channel: u16) -> Result<Added> {
        let (topic, format) = self.clouds[&cloud_channel].clone();
        let written = self.options.types.format(format);
        let is_in_place = self.options.form == Form::InPlace;
        let key = (topic, written);
        let added = match self.added.get(&key) {
            Some(&added) => added,
            None => {
                let channel = self.overview.channels[&cloud_channel].clone();
                let instances = match is_in_place {
                    true => cloud_channel,
                    false => self.add_instances(&channel, format, written)?,
                };
                let added = Added { instances, objects: self.add_objects(&channel, written)? };
                *self.added.entry(key).or_insert(added)
            }
        };
        Ok(match is_in_place {
            true => Added { instances: cloud_channel, ..added },
            false => added,
        })
    }

    /// The channel of the annotated clouds: as the cloud's own where they are of its format.
    fn add_instances(
        &mut self,
        cloud: &Channel,
        format: CloudFormat,
        written: CloudFormat,
    ) -> Result<u16> {
        let topic = format!("{}{INSTANCES}", cloud.topic);
        match self.overview.schema_of(cloud.id).filter(|_| format == written).cloned() {
            Some(Schema { name, encoding, data, .. }) => {
                let metadata = channel_metadata(cloud, format);
                let schema = (name.as_str(), encoding.as_str(), data.as_slice());
                let encoding = &cloud.message_encoding;
                Ok(self.writer.declare_channel(&topic, schema, encoding, &metadata)?)
            }
            None => self.declare(&topic, &written.schema(), cloud),
        }
    }

    fn add_objects(&mut self, cloud: &Channel, written: CloudFormat) -> Result<u16> {
        let schema = self.options.types.objects(written)?;
        self.declare(&format!("{}{OBJECTS}", cloud.topic), &schema, cloud)
    }

    /// A channel of a type of its own beside a cloud's.
    fn declare(&mut self, topic: &str, schema: &MessageSchema, cloud: &Channel) -> Result<u16> {
        let metadata = added_metadata(topic, schema, cloud);
        let definition = (schema.name, schema.encoding, &*schema.data);
        let encoding = schema.message_encoding;
        Ok(self.writer.declare_channel(topic, definition, encoding, &metadata)?)
    }
}
