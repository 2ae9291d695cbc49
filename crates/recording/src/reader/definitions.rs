//! Schemas and channels that have been read, and whether another one agrees with them.

use std::collections::BTreeMap;

use mcap::records::Channel;

use crate::record::Schema;

/// Schemas and channels by id.
#[derive(Debug, Clone, Default)]
pub(super) struct Definitions {
    pub(super) schemas: BTreeMap<u16, Schema>,
    pub(super) channels: BTreeMap<u16, Channel>,
}

impl Definitions {
    /// Whether a schema is not known yet; what is wrong if it contradicts one that is.
    pub(super) fn is_new_schema(&self, schema: &Schema) -> Result<bool, String> {
        if schema.id == 0 {
            return Err(format!("schema `{}` has the id 0, which means no schema", schema.name));
        }
        match self.schemas.get(&schema.id) {
            None => Ok(true),
            Some(known) if known == schema => Ok(false),
            Some(known) => Err(format!(
                "schema {} is defined twice, as `{}` and differently as `{}`",
                schema.id, known.name, schema.name
            )),
        }
    }

    /// Whether a channel is not known yet; what is wrong if it contradicts one that is.
    pub(super) fn is_new_channel(&self, channel: &Channel) -> Result<bool, String> {
        match self.channels.get(&channel.id) {
            None => Ok(true),
            Some(known) if known == channel => Ok(false),
            Some(known) => Err(format!(
                "channel {} is defined twice, as `{}` and differently as `{}`",
                channel.id, known.topic, channel.topic
            )),
        }
    }

    /// Whether the schema of a channel is known, or it has none.
    pub(super) fn has_schema_of(&self, channel: &Channel) -> bool {
        channel.schema_id == 0 || self.schemas.contains_key(&channel.schema_id)
    }
}

/// What is wrong with a channel whose schema is not known.
pub(super) fn unknown_schema(channel: &Channel) -> String {
    format!(
        "channel {} (`{}`) has schema {}, which has not been defined",
        channel.id, channel.topic, channel.schema_id
    )
}
