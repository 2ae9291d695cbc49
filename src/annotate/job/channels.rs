//! The channels of what is added.

use std::sync::Arc;

use super::Job;
use crate::annotate::Form;
use crate::annotate::topics::{INSTANCES, OBJECTS, added_metadata, channel_metadata};
use crate::error::Result;
use crate::io::{Channel, CloudFormat, MessageSchema};

/// The channels of what is added to a topic's clouds.
#[derive(Clone, Copy)]
pub(super) struct Added {
    pub(super) instances: u16,
    pub(super) objects: u16,
}

impl Job<'_> {
    /// The channels of what is added to a channel's clouds, made at the first of its topic.
    pub(super) fn channels_for(&mut self, cloud_channel: u16) -> Result<Added> {
        let (topic, format) = self.clouds[&cloud_channel].clone();
        let written = self.options.types.format(format);
        if let Some(&added) = self.added.get(&(Arc::clone(&topic), written)) {
            return Ok(added);
        }
        let channel = self.overview.channels[&cloud_channel].clone();
        let instances = match self.options.form {
            Form::InPlace => cloud_channel,
            _ => self.add_instances(&channel, format, written)?,
        };
        let schema = self.options.types.objects(written)?;
        let objects = self.add_channel(&format!("{topic}{OBJECTS}"), &schema, &channel)?;
        let added = Added { instances, objects };
        self.added.insert((topic, written), added);
        Ok(added)
    }

    /// The channel of the annotated clouds: as the cloud's own where they are of its format.
    fn add_instances(
        &mut self,
        cloud: &Channel,
        format: CloudFormat,
        written: CloudFormat,
    ) -> Result<u16> {
        let topic = format!("{}{INSTANCES}", cloud.topic);
        if format != written {
            return self.add_channel(&topic, &written.schema(), cloud);
        }
        let schema = match (self.options.form, self.overview.schema_of(cloud.id)) {
            (Form::Only, Some(schema)) => {
                self.writer.add_schema(&schema.name, &schema.encoding, &schema.data)?
            }
            _ => cloud.schema_id,
        };
        let (encoding, metadata) = (&cloud.message_encoding, channel_metadata(cloud, format));
        self.writer.add_channel(&topic, schema, encoding, &metadata)
    }

    /// A channel of a type of its own beside a cloud's.
    fn add_channel(&mut self, topic: &str, schema: &MessageSchema, cloud: &Channel) -> Result<u16> {
        let id = self.writer.add_type(schema)?;
        let metadata = added_metadata(topic, schema, cloud);
        self.writer.add_channel(topic, id, schema.message_encoding, &metadata)
    }
}
