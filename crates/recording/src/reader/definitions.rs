//! Schemas and channels that have been read, and whether another one agrees with them.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::Channel;

use crate::damage::Damage;
use crate::record::Schema;

/// Schemas and channels by id.
#[derive(Debug, Clone, Default)]
pub(super) struct Definitions {
    pub(super) schemas: BTreeMap<u16, Schema>,
    pub(super) channels: BTreeMap<u16, Channel>,
    /// Channels that the summary lists, where it was believed: there must be no other.
    pub(super) listed: Option<BTreeSet<u16>>,
}

impl Definitions {
    /// Whether a schema is not known yet; fails if it contradicts one that is.
    pub(super) fn is_new_schema(&self, schema: &Schema) -> Result<bool, Damage> {
        if schema.id == 0 {
            return Err(Damage::SchemaIdZero { name: schema.name.clone() });
        }
        match self.schemas.get(&schema.id) {
            None => Ok(true),
            Some(known) if known == schema => Ok(false),
            Some(known) => Err(Damage::DefinedTwice {
                kind: "schema",
                id: schema.id,
                first: known.name.clone(),
                second: schema.name.clone(),
            }),
        }
    }

    /// Whether a channel is not known yet; fails if it contradicts one that is.
    pub(super) fn is_new_channel(&self, channel: &Channel) -> Result<bool, Damage> {
        match self.channels.get(&channel.id) {
            None if self.listed.as_ref().is_some_and(|ids| !ids.contains(&channel.id)) => {
                let (channel, topic) = (channel.id, channel.topic.clone());
                Err(Damage::UnlistedChannel { channel, topic })
            }
            None => Ok(true),
            Some(known) if known == channel => Ok(false),
            Some(known) => Err(Damage::DefinedTwice {
                kind: "channel",
                id: channel.id,
                first: known.topic.clone(),
                second: channel.topic.clone(),
            }),
        }
    }

    /// Fails if the schema of a channel is not known. A channel may have none.
    pub(super) fn require_schema_of(&self, channel: &Channel) -> Result<(), Damage> {
        let &Channel { id, schema_id, .. } = channel;
        if schema_id == 0 || self.schemas.contains_key(&schema_id) {
            return Ok(());
        }
        let topic = channel.topic.clone();
        Err(Damage::UndefinedSchema { channel: id, topic, schema: schema_id })
    }
}
