//! Ids of schemas and channels that are added.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

use mcap::records::Channel;

use crate::error::{Error, Result};
use crate::overview::Overview;
use crate::record::Schema;

/// Ids that are taken, by what was written or is going to be copied.
#[derive(Default)]
pub(super) struct Ids {
    pub(super) schemas: BTreeMap<u16, Schema>,
    /// Ids of those by a hash of what they are.
    by_content: HashMap<u64, Vec<u16>>,
    channels: BTreeSet<u16>,
    next_schema: NextId,
    next_channel: NextId,
    /// Whether new ids are the highest that are free, else the one behind the highest that is
    /// taken.
    from_the_top: bool,
}

/// Where to look for a free id. Ids are never given back.
struct NextId {
    /// All ids below are taken.
    lowest: u16,
    /// All ids above are taken.
    highest: u16,
}

impl Default for NextId {
    fn default() -> Self {
        NextId { lowest: 1, highest: u16::MAX }
    }
}

impl NextId {
    fn lowest(&mut self, is_taken: impl Fn(u16) -> bool) -> Option<u16> {
        let free = (self.lowest..=u16::MAX).find(|&id| !is_taken(id));
        self.lowest = free.unwrap_or(u16::MAX);
        free
    }

    fn highest(&mut self, is_taken: impl Fn(u16) -> bool) -> Option<u16> {
        let free = (1..=self.highest).rev().find(|&id| !is_taken(id));
        self.highest = free.unwrap_or(1);
        free
    }
}

/// A hash of what a schema is, besides its id.
fn content_hash(name: &str, encoding: &str, data: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    (name, encoding, data).hash(&mut hasher);
    hasher.finish()
}

impl Ids {
    /// Takes the ids of a recording.
    pub(super) fn reserve(&mut self, overview: &Overview) {
        overview.schemas.values().for_each(|schema| self.take_schema(schema));
        self.channels.extend(overview.channels.keys());
    }

    /// Gives out the highest ids first.
    pub(super) fn start_at_the_top(&mut self) {
        self.from_the_top = true;
    }

    pub(super) fn take_schema(&mut self, schema: &Schema) {
        if !self.schemas.contains_key(&schema.id) {
            let content = content_hash(&schema.name, &schema.encoding, &schema.data);
            self.by_content.entry(content).or_default().push(schema.id);
            self.schemas.insert(schema.id, schema.clone());
        }
    }

    pub(super) fn take_channel(&mut self, id: u16) {
        self.channels.insert(id);
    }

    /// The id of an equal schema, or else a new one.
    pub(super) fn schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> Result<u16> {
        let is_equal = |id: &&u16| {
            let schema = &self.schemas[id];
            (schema.name.as_str(), schema.encoding.as_str()) == (name, encoding)
                && schema.data == data
        };
        let alike = self.by_content.get(&content_hash(name, encoding, data));
        if let Some(&id) = alike.and_then(|ids| ids.iter().filter(is_equal).min()) {
            return Ok(id);
        }
        let last = self.schemas.last_key_value().map(|(&id, _)| id);
        let is_taken = |id| self.schemas.contains_key(&id);
        let id = free(&mut self.next_schema, last, self.from_the_top, is_taken);
        let id = id.ok_or(Error::TooManySchemas)?;
        let (name, encoding, data) = (name.to_owned(), encoding.to_owned(), data.to_vec());
        self.take_schema(&Schema { id, name, encoding, data });
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
        let (last, is_taken) = (self.channels.last().copied(), |id| self.channels.contains(&id));
        let id = free(&mut self.next_channel, last, self.from_the_top, is_taken);
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
}

/// The id behind the last, or else the first free one; or the highest free one.
fn free(
    next: &mut NextId,
    last: Option<u16>,
    from_the_top: bool,
    is_taken: impl Fn(u16) -> bool,
) -> Option<u16> {
    match from_the_top {
        true => next.highest(is_taken),
        false => last.unwrap_or(0).checked_add(1).or_else(|| next.lowest(is_taken)),
    }
}
