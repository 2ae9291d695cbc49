//! Schemas and channels that have been read, and whether another one agrees with them.

use std::collections::BTreeMap;

use mcap::records::Channel;

use crate::damage::Damage;
use crate::record::Schema;

/// Schemas and channels by id.
#[derive(Debug, Clone, Default)]
pub(super) struct Definitions {
    pub(super) schemas: BTreeMap<u16, Schema>,
    pub(super) channels: BTreeMap<u16, Channel>,
    /// Those of the summary, where it was believed.
    pub(super) listed: Option<Listed>,
}

/// Definitions of a summary that was believed: there must be no other channel, and none that
/// differs.
#[derive(Debug, Clone)]
pub(super) struct Listed {
    pub(super) schemas: BTreeMap<u16, Schema>,
    pub(super) channels: BTreeMap<u16, Channel>,
}

impl Listed {
    fn check_schema(&self, schema: &Schema) -> Result<(), Damage> {
        match self.schemas.get(&schema.id) {
            Some(listed) if listed != schema => Err(schema_twice(listed, schema)),
            _ => Ok(()),
        }
    }

    fn check_channel(&self, channel: &Channel) -> Result<(), Damage> {
        match self.channels.get(&channel.id) {
            None => {
                let (channel, topic) = (channel.id, channel.topic.clone());
                Err(Damage::UnlistedChannel { channel, topic })
            }
            Some(listed) if listed != channel => Err(channel_twice(listed, channel)),
            Some(_) => Ok(()),
        }
    }
}

fn schema_twice(first: &Schema, second: &Schema) -> Damage {
    let (id, first, second) = (first.id, first.name.clone(), second.name.clone());
    Damage::DefinedTwice { kind: "schema", id, first, second }
}

fn channel_twice(first: &Channel, second: &Channel) -> Damage {
    let (id, first, second) = (first.id, first.topic.clone(), second.topic.clone());
    Damage::DefinedTwice { kind: "channel", id, first, second }
}

impl Definitions {
    /// Whether a schema is not known yet; fails if it contradicts one that is.
    pub(super) fn is_new_schema(&self, schema: &Schema) -> Result<bool, Damage> {
        if schema.id == 0 {
            return Err(Damage::SchemaIdZero { name: schema.name.clone() });
        }
        match self.schemas.get(&schema.id) {
            None => self.listed.iter().try_for_each(|listed| listed.check_schema(schema)),
            Some(known) if known == schema => return Ok(false),
            Some(known) => Err(schema_twice(known, schema)),
        }
        .map(|()| true)
    }

    /// Whether a channel is not known yet; fails if it contradicts one that is.
    pub(super) fn is_new_channel(&self, channel: &Channel) -> Result<bool, Damage> {
        match self.channels.get(&channel.id) {
            None => self.listed.iter().try_for_each(|listed| listed.check_channel(channel)),
            Some(known) if known == channel => return Ok(false),
            Some(known) => Err(channel_twice(known, channel)),
        }
        .map(|()| true)
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
