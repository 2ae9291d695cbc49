//! What stands at the end of a recording being written, gathered on the way.

use std::collections::BTreeMap;

use mcap::records::{
    AttachmentIndex, Channel, ChunkIndex, DataEnd, Footer, MetadataIndex, Statistics,
    SummaryOffset, op,
};

use crate::encode;
use crate::record::Schema;

/// Definitions, counts and indexes.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    pub(crate) schemas: BTreeMap<u16, Schema>,
    pub(crate) channels: BTreeMap<u16, Channel>,
    pub(crate) chunks: Vec<ChunkIndex>,
    pub(crate) attachments: Vec<AttachmentIndex>,
    pub(crate) metadata: Vec<MetadataIndex>,
    message_counts: BTreeMap<u16, u64>,
    bounds: Option<(u64, u64)>,
}

impl Summary {
    /// Counts messages of a channel, logged from the first to the last time.
    pub(crate) fn count(&mut self, channel: u16, count: u64, (first, last): (u64, u64)) {
        *self.message_counts.entry(channel).or_default() += count;
        let (start, end) = self.bounds.unwrap_or((first, last));
        self.bounds = Some((start.min(first), end.max(last)));
    }

    /// The records from the end of the data, which lies at `offset` bytes of the file and has the
    /// checksum `data_section_crc`, to the end of the file.
    pub(crate) fn close(self, offset: u64, data_section_crc: u32) -> Vec<u8> {
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
