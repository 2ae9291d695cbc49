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
    chunk_count: u32,
    /// The records of the chunk index, which are all that grows with a recording.
    chunks: Vec<u8>,
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

    /// Takes a chunk that is in the file.
    pub(super) fn add_chunk(&mut self, index: &ChunkIndex) {
        self.chunk_count += 1;
        self.chunks.extend(encode::record(op::CHUNK_INDEX, index));
    }

    /// The records from the end of the data, which lies at `offset` bytes of the file and has the
    /// checksum `data_section_crc`, to the end of the file.
    pub(super) fn close(self, offset: u64, data_section_crc: u32) -> [Vec<u8>; 8] {
        let data_end = encode::record(op::DATA_END, &DataEnd { data_section_crc });
        let summary_start = offset + data_end.len() as u64;
        let mut crc = crc32fast::Hasher::new();
        let (mut end, mut summary_offset_start) = (Vec::new(), summary_start);
        let groups = self.groups().map(|(group_opcode, records)| {
            if !records.is_empty() {
                let (group_start, group_length) = (summary_offset_start, records.len() as u64);
                let group = SummaryOffset { group_opcode, group_start, group_length };
                end.extend(encode::record(op::SUMMARY_OFFSET, &group));
                summary_offset_start += group_length;
                crc.update(&records);
            }
            records
        });
        let mut footer = Footer { summary_start, summary_offset_start, summary_crc: 0 };
        crc.update(&end);
        let unsigned = encode::record(op::FOOTER, &footer);
        crc.update(&unsigned[..unsigned.len() - size_of_val(&footer.summary_crc)]);
        footer.summary_crc = crc.finalize();
        end.extend(encode::record(op::FOOTER, &footer));
        end.extend_from_slice(mcap::MAGIC);
        let [schemas, channels, statistics, chunks, attachments, metadata] = groups;
        [data_end, schemas, channels, statistics, chunks, attachments, metadata, end]
    }

    /// Opcode and records of each group.
    fn groups(mut self) -> [(u8, Vec<u8>); 6] {
        let statistics = self.statistics();
        [
            (op::SCHEMA, self.schemas.values().flat_map(encode::schema).collect()),
            (op::CHANNEL, all(op::CHANNEL, self.channels.values())),
            (op::STATISTICS, encode::record(op::STATISTICS, &statistics)),
            (op::CHUNK_INDEX, std::mem::take(&mut self.chunks)),
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
            chunk_count: self.chunk_count,
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
