//! The end of a recording: what only the summary has, and whether it agrees with what was read.

use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::records::{self, Channel, op};

use super::super::record::{Record, Schema};
use super::super::words::crc_mismatch;
use super::batch::{owned_schema, unknown_schema};
use super::{RecordingReader, Section};
use crate::error::Result;

/// What the end of the file says, held back until its checksum has been checked.
#[derive(Default)]
pub(super) struct Summary {
    pub(super) start: u64,
    pub(super) schemas: BTreeMap<u16, Schema>,
    pub(super) channels: BTreeMap<u16, Channel>,
    pub(super) statistics: Option<records::Statistics>,
}

impl RecordingReader {
    pub(super) fn take_summary(&mut self, offset: u64, opcode: u8) -> Result<()> {
        match self.parse(offset, opcode)? {
            records::Record::Schema { header, data } => {
                let schema = owned_schema(header, &data);
                let is_new = self.is_new_schema(offset, &schema)?;
                let new = is_new.then_some((schema.id, schema));
                self.summary.schemas.extend(new);
            }
            records::Record::Channel(channel) => {
                let is_new = self.is_new_channel(offset, &channel)?;
                let new = is_new.then_some((channel.id, channel));
                self.summary.channels.extend(new);
            }
            records::Record::Statistics(statistics) => {
                self.summary.statistics = Some(statistics);
            }
            _ => {}
        }
        Ok(())
    }

    pub(super) fn take_footer(&mut self, offset: u64) -> Result<()> {
        let records::Record::Footer(footer) = self.parse(offset, op::FOOTER)? else {
            return Ok(());
        };
        let (stored, computed) = (footer.summary_crc, self.crc.clone().finalize());
        if stored != 0 && stored != computed {
            let problem = crc_mismatch("summary section", stored, computed);
            return Err(self.source.damage(offset, problem));
        }
        if footer.summary_start != 0 && footer.summary_start != self.summary.start {
            let problem = format!(
                "the footer says that the summary starts at byte {}, but it starts at {}",
                footer.summary_start, self.summary.start
            );
            return Err(self.source.damage(offset, problem));
        }
        self.give_summary(offset);
        self.section = Section::End;
        self.check_end()
    }

    /// Gives what only the summary has, and compares its counts with what was read.
    pub(super) fn give_summary(&mut self, offset: u64) {
        let Summary { schemas, channels, statistics, .. } = std::mem::take(&mut self.summary);
        for schema in schemas.into_values() {
            self.schemas.insert(schema.id, schema.clone());
            self.waiting.push_back(Record::Schema(schema));
        }
        for channel in channels.into_values() {
            if channel.schema_id == 0 || self.schemas.contains_key(&channel.schema_id) {
                self.waiting.push_back(Record::Channel(channel));
            } else {
                let problem = unknown_schema(&channel);
                self.waiting.push_back(Record::Damaged { offset, problem });
            }
        }
        let Some(statistics) = statistics else {
            return;
        };
        let counted = self.counts;
        let pairs = [
            ("messages", statistics.message_count, counted.messages),
            ("attachments", statistics.attachment_count.into(), counted.attachments),
            ("metadata records", statistics.metadata_count.into(), counted.metadata),
        ];
        // The messages of what was passed over have not been counted.
        let pairs = pairs.into_iter().skip(usize::from(self.has_passed));
        for (what, said, found) in pairs.filter(|(_, said, found)| said != found) {
            let problem = format!("the summary counts {said} {what}, the file has {found}");
            self.waiting.push_back(Record::Damaged { offset, problem });
        }
    }

    /// Ends at damage in the summary. What only the summary had cannot be trusted and is left out.
    pub(super) fn give_up_summary(&mut self, offset: u64, problem: String) {
        let problem = format!(
            "the summary at the end of the file is damaged ({problem}); the messages are not \
             affected, but what stands only in the summary is left out"
        );
        self.waiting.push_back(Record::Damaged { offset, problem });
        self.batch.bytes = Arc::default();
        self.section = Section::End;
    }

    /// Looks at what is behind the footer.
    fn check_end(&mut self) -> Result<()> {
        let source = &mut self.source.source;
        let offset = source.offset;
        let mut end = Vec::new();
        let length = source.remaining().min(mcap::MAGIC.len() as u64);
        source.read(length, &mut end)?;
        self.offset = source.offset;
        let more = match source.size {
            Some(_) => source.remaining(),
            // Whether there is more is seen by trying.
            None => source.read(1, &mut Vec::new())?,
        };
        let (offset, problem) = match (end == mcap::MAGIC, more) {
            (true, 0) => return Ok(()),
            (true, _) => {
                (self.offset, "there are bytes behind the end of the recording".to_owned())
            }
            (false, 0) if end.len() < mcap::MAGIC.len() => {
                let problem = "the file is cut off in the eight bytes that close a recording";
                let problem = problem.to_owned();
                self.waiting.push_back(Record::Truncated { offset, problem });
                return Ok(());
            }
            (false, _) => (offset, "the footer is not followed by the end of the file".to_owned()),
        };
        self.waiting.push_back(Record::Damaged { offset, problem });
        Ok(())
    }
}
