//! What stands at the end of a recording being written, gathered on the way.

use std::collections::BTreeMap;

use mcap::records::{
    AttachmentIndex, Channel, ChunkIndex, DataEnd, Footer, MetadataIndex, Statistics,
    SummaryOffset, op,
};

use crate::encode;
use crate::error::{Error, Result};
use crate::record::Schema;

/// Definitions, counts and indexes.
#[derive(Debug, Default)]
pub(super) struct Summary {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    pub(super) chunks: Vec<ChunkIndex>,
    pub(super) attachments: Vec<AttachmentIndex>,
    pub(super) metadata: Vec<MetadataIndex>,
    message_counts: BTreeMap<u16, u64>,
    bounds: Option<(u64, u64)>,
}

impl Summary {
    /// Takes a schema that is in the file; whether it is new.
    pub(super) fn define_schema(&mut self, schema: &Schema) -> Result<bool> {
        if schema.id == 0 {
            return Err(Error::SchemaIdZero);
        }
        match self.schemas.get(&schema.id) {
            Some(known) if known == schema => return Ok(false),
            Some(_) => return Err(Error::ConflictingSchemas { name: schema.name.clone() }),
            None => {}
        }
        self.schemas.insert(schema.id, schema.clone());
        Ok(true)
    }

    /// Takes a channel that is in the file; whether it is new.
    pub(super) fn define_channel(&mut self, channel: &Channel) -> Result<bool> {
        let topic = || channel.topic.clone();
        if channel.schema_id != 0 && !self.schemas.contains_key(&channel.schema_id) {
            return Err(Error::UnknownSchema { topic: topic(), schema: channel.schema_id });
        }
        match self.channels.get(&channel.id) {
            Some(known) if known == channel => return Ok(false),
            Some(_) => return Err(Error::ConflictingChannels { topic: topic() }),
            None => {}
        }
        self.channels.insert(channel.id, channel.clone());
        Ok(true)
    }

    /// Counts messages of a channel, the first of this sequence number, logged from the first to
    /// the last time.
    pub(super) fn count(
        &mut self,
        channel: u16,
        sequence: u32,
        count: u64,
        (first, last): (u64, u64),
    ) -> Result<()> {
        if !self.channels.contains_key(&channel) {
            return Err(Error::UnknownChannel { sequence, channel });
        }
        *self.message_counts.entry(channel).or_default() += count;
        let (start, end) = self.bounds.unwrap_or((first, last));
        self.bounds = Some((start.min(first), end.max(last)));
        Ok(())
    }

    /// The records from the end of the data, which lies at `offset` bytes of the file and has the
    /// checksum `data_section_crc`, to the end of the file.
    pub(super) fn close(self, offset: u64, data_section_crc: u32) -> Vec<u8> {
        let mut end = encode::record(op::DATA_END, &DataEnd { data_section_crc });
        let start = end.len();
        let mut offsets = Vec::new();
        for (opcode, records) in self.groups() {
            if !records.is_empty() {
                let group_start = offset + end.len() as u64;
                let group_length = records.len() as u64;
                offsets.push(SummaryOffset { group_opcode: opcode, group_start, group_length });
                end.extend(records);
            }
        }
        let mut footer = Footer {
            summary_start: offset + start as u64,
            summary_offset_start: offset + end.len() as u64,
            summary_crc: 0,
        };
        for group in &offsets {
            end.extend(encode::record(op::SUMMARY_OFFSET, group));
        }
        let mut crc = crc32fast::Hasher::new();
        crc.update(&end[start..]);
        let unsigned = encode::record(op::FOOTER, &footer);
        crc.update(&unsigned[..unsigned.len() - size_of_val(&footer.summary_crc)]);
        footer.summary_crc = crc.finalize();
        end.extend(encode::record(op::FOOTER, &footer));
        end.extend_from_slice(mcap::MAGIC);
        end
    }

    /// Opcode and records of each group.
    fn groups(self) -> [(u8, Vec<u8>); 6] {
        let statistics = self.statistics();
        [
            (op::SCHEMA, self.schemas.values().flat_map(encode::schema).collect()),
            (op::CHANNEL, all(op::CHANNEL, self.channels.values())),
            (op::STATISTICS, encode::record(op::STATISTICS, &statistics)),
            (op::CHUNK_INDEX, all(op::CHUNK_INDEX, &self.chunks)),
            (op::ATTACHMENT_INDEX, all(op::ATTACHMENT_INDEX, &self.attachments)),
            (op::METADATA_INDEX, all(op::METADATA_INDEX, &self.metadata)),
        ]
    }

    fn statistics(&self) -> Statistics {
        let (message_start_time, message_end_time) = self.bounds.unwrap_or_default();
        Statistics {
            message_count: self.message_counts.values().sum(),
            schema_count: self.schemas.len() as u16,
            channel_count: self.channels.len() as u32,
            attachment_count: self.attachments.len() as u32,
            metadata_count: self.metadata.len() as u32,
            chunk_count: self.chunks.len() as u32,
            message_start_time,
            message_end_time,
            channel_message_counts: self.message_counts.clone(),
        }
    }
}

fn all<'a, T: encode::Structure + 'a>(
    opcode: u8,
    structures: impl IntoIterator<Item = &'a T>,
) -> Vec<u8> {
    structures.into_iter().flat_map(|structure| encode::record(opcode, structure)).collect()
}
