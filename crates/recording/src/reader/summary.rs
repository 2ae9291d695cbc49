//! The summary of a recording: what stands only there, and whether it agrees with what was read.

use mcap::records::{self, Footer};

use super::counts::Counts;
use super::definitions::Definitions;
use crate::damage::Damage;
use crate::record::{Record, Schema};

/// What the summary says, held back until its checksum has been checked.
#[derive(Default)]
pub(super) struct Summary {
    /// Where it starts in the file.
    pub(super) start: u64,
    /// Definitions that stand only here.
    definitions: Definitions,
    statistics: Option<records::Statistics>,
}

impl Summary {
    /// Takes a record of the summary; fails if it contradicts the definitions in the data.
    pub(super) fn take(
        &mut self,
        record: records::Record,
        known: &Definitions,
    ) -> Result<(), Damage> {
        match record {
            records::Record::Schema { header, data } => {
                let schema = Schema::new(header, &data);
                if known.is_new_schema(&schema)? {
                    self.definitions.schemas.insert(schema.id, schema);
                }
            }
            records::Record::Channel(channel) if known.is_new_channel(&channel)? => {
                self.definitions.channels.insert(channel.id, channel);
            }
            records::Record::Statistics(statistics) => self.statistics = Some(statistics),
            _ => {}
        }
        Ok(())
    }

    /// Fails if the footer says that the summary starts elsewhere.
    pub(super) fn check_start(&self, footer: &Footer) -> Result<(), Damage> {
        match footer.summary_start {
            0 => Ok(()),
            start if start == self.start => Ok(()),
            stored => Err(Damage::SummaryStart { stored, found: self.start }),
        }
    }

    /// The definitions that stand only in the summary, and where its counts differ from what was
    /// read. Nothing is known of the number of messages if some were skipped.
    pub(super) fn finish(
        self,
        offset: u64,
        known: &mut Definitions,
        counted: Counts,
        has_skipped: bool,
    ) -> Vec<Record<'static>> {
        let damaged = |damage| Record::Damaged { offset, damage };
        let mut records = Vec::new();
        for schema in self.definitions.schemas.into_values() {
            known.schemas.insert(schema.id, schema.clone());
            records.push(Record::Schema(schema));
        }
        for channel in self.definitions.channels.into_values() {
            records.push(match known.require_schema_of(&channel) {
                Ok(()) => Record::Channel(channel),
                Err(damage) => damaged(damage),
            });
        }
        let Some(statistics) = self.statistics else {
            return records;
        };
        let pairs = [
            ("messages", statistics.message_count, counted.messages),
            ("attachments", statistics.attachment_count.into(), counted.attachments),
            ("metadata records", statistics.metadata_count.into(), counted.metadata),
        ];
        let pairs = pairs.into_iter().skip(usize::from(has_skipped));
        let differing = pairs.filter(|(_, stored, found)| stored != found);
        records
            .extend(differing.map(|(kind, stored, found)| {
                damaged(Damage::SummaryCount { kind, stored, found })
            }));
        records
    }
}
