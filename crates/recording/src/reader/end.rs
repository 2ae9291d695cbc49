//! Where a file ends: behind its last record, within one, or without an end.

use mcap::records::op;

use super::batch::Batch;
use super::records::Records;
use super::sections::{Section, Sections};
use crate::chunk;
use crate::damage::Damage;
use crate::error::Result;
use crate::fields::MAX_RECORD;
use crate::names::record_name;
use crate::record::Record;

impl Sections {
    /// Looks at what is behind the footer.
    pub(super) fn check_end(&mut self) -> Result<()> {
        let source = &mut self.source.source;
        let offset = source.offset;
        let mut end = Vec::new();
        let length = source.remaining().min(mcap::MAGIC.len() as u64);
        source.read(length, &mut end)?;
        self.offset = source.offset;
        let mut behind = Vec::new();
        // Whether a stream goes on is seen by trying.
        let more = source.remaining().min(mcap::MAGIC.len() as u64);
        source.read(more, &mut behind)?;
        let (zeros, behind_end) = (source.zeros(), self.offset);
        let damaged = |offset, damage| Record::Damaged { offset, damage };
        self.pending.push_back(match (end == mcap::MAGIC, behind.as_slice()) {
            (true, []) if zeros == 0 => return Ok(()),
            (true, []) => damaged(behind_end, Damage::ZerosBehindEnd { zeros }),
            (true, mcap::MAGIC) => {
                let damage = Damage::SecondRecording { length: behind_end };
                Record::Truncated { offset: behind_end, damage }
            }
            (true, _) => damaged(behind_end, Damage::BytesBehindEnd),
            (false, []) if end.len() < mcap::MAGIC.len() => {
                let place = "the file is cut off in the eight bytes that close a recording";
                Record::Truncated { offset, damage: self.before_zeros(Damage::CutOff { place }) }
            }
            (false, _) => damaged(offset, Damage::NoEndBehindFooter),
        });
        Ok(())
    }

    /// No record follows although the footer has not come.
    pub(super) fn run_out(&mut self, offset: u64, left: u64) -> Result<()> {
        if self.source.source.is_complete {
            return Err(self.damage(offset, Damage::NoEnd));
        }
        let place = match left {
            0 => "the file ends before the records that should close it",
            _ => "a record is cut in its length",
        };
        self.truncate(offset, Damage::CutOff { place });
        Ok(())
    }

    /// The file ends within a record: what is there of a chunk is given.
    pub(super) fn cut(&mut self, offset: u64, opcode: u8, length: u64, left: u64, body: &[u8]) {
        let is_salvaged =
            (self.section, opcode) == (Section::Data, op::CHUNK) && left <= MAX_RECORD;
        if is_salvaged {
            let records = Records::whole(chunk::salvage(body).into());
            self.batch = Batch::new(offset, true, records);
        }
        let record = record_name(opcode);
        self.truncate(offset, Damage::CutInRecord { record, length, left, is_salvaged });
    }

    fn truncate(&mut self, offset: u64, damage: Damage) {
        if self.section == Section::Summary {
            self.give_summary(offset);
        }
        let damage = self.before_zeros(damage);
        self.pending.push_back(Record::Truncated { offset, damage });
        self.section = Section::End;
    }

    fn before_zeros(&self, damage: Damage) -> Damage {
        match self.source.source.zeros() {
            0 => damage,
            zeros => Damage::BeforeZeros { damage: Box::new(damage), zeros },
        }
    }
}
