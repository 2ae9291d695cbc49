//! Ids of schemas and channels that are added.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::Channel;

use crate::error::{Error, Result};
use crate::overview::Overview;
use crate::record::Schema;

/// Ids that are taken, by what was written or is going to be copied.
#[derive(Default)]
pub(super) struct Ids {
    pub(super) schemas: BTreeMap<u16, Schema>,
    channels: BTreeSet<u16>,
    /// Whether new ids are the highest that are free, else the one behind the highest that is
    /// taken.
    from_the_top: bool,
}

impl Ids {
    /// Takes the ids of a recording.
    pub(super) fn reserve(&mut self, overview: &Overview) {
        let schemas = overview.schemas.iter();
        self.schemas.extend(schemas.map(|(&id, schema)| (id, schema.clone())));
        self.channels.extend(overview.channels.keys());
    }

    /// Gives out the highest ids first.
    pub(super) fn start_at_the_top(&mut self) {
        self.from_the_top = true;
    }

    pub(super) fn take_schema(&mut self, schema: &Schema) {
        self.schemas.entry(schema.id).or_insert_with(|| schema.clone());
    }

    pub(super) fn take_channel(&mut self, id: u16) {
        self.channels.insert(id);
    }

    /// The id of an equal schema, or else a new one.
    pub(super) fn schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> Result<u16> {
        let is_equal = |schema: &&Schema| {
            (schema.name.as_str(), schema.encoding.as_str()) == (name, encoding)
                && schema.data == data
        };
        if let Some(schema) = self.schemas.values().find(is_equal) {
            return Ok(schema.id);
        }
        let last = self.schemas.last_key_value().map(|(&id, _)| id);
        let id = self.free(last, |id| self.schemas.contains_key(&id));
        let id = id.ok_or(Error::TooManySchemas)?;
        let (name, encoding, data) = (name.to_owned(), encoding.to_owned(), data.to_vec());
        self.schemas.insert(id, Schema { id, name, encoding, data });
        Ok(id)
    }

    /// A channel with a new id.
    pub(super) fn channel(
        &mut self,
        topic: &str,
        schema_id: u16,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Channel> {
        let id = self.free(self.channels.last().copied(), |id| self.channels.contains(&id));
        let id = id.ok_or(Error::TooManyChannels)?;
        self.channels.insert(id);
        Ok(Channel {
            id,
            schema_id,
            topic: topic.to_owned(),
            message_encoding: message_encoding.to_owned(),
            metadata: metadata.clone(),
        })
    }

    /// The id behind the last, or else the first free one; or the highest free one.
    fn free(&self, last: Option<u16>, is_taken: impl Fn(u16) -> bool) -> Option<u16> {
        let is_free = |id: &u16| !is_taken(*id);
        match self.from_the_top {
            true => (1..=u16::MAX).rev().find(is_free),
            false => last.unwrap_or(0).checked_add(1).or_else(|| (1..=u16::MAX).find(is_free)),
        }
    }
}
