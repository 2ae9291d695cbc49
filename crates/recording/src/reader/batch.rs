//! The records of a chunk, or one that is outside of chunks.

use std::borrow::Cow;

use mcap::records::{self, MessageHeader, op};

use super::counts::Counts;
use super::definitions::Definitions;
use super::records::Records;
use crate::chunk;
use crate::damage::Damage;
use crate::fields::{HEAD_LEN, MESSAGE_HEADER_LEN, message_header, split_head};
use crate::names::record_name;
use crate::pack::MessagePlaces;
use crate::parse::parse_record;
use crate::part::Item;
use crate::record::{Position, Record, Schema};

/// Bytes of a message's own header.
const HEADER_LEN: u64 = MESSAGE_HEADER_LEN as u64;

/// Records that are in memory with their heads: those of a chunk, or one that was outside.
#[derive(Default)]
pub(super) struct Batch {
    pub(super) records: Records,
    pub(super) next: usize,
    pub(super) offset: u64,
    pub(super) in_chunk: bool,
    messages: u32,
    /// Where its messages lie among the records of the chunk.
    pub(super) places: MessagePlaces,
    /// Bytes of messages so far that are left out of the records.
    left_out: u64,
    /// Whether it is a whole chunk, checked.
    pub(super) is_copyable: bool,
    /// Whether messages that are compressed each by itself are unpacked.
    pub(super) unpacks_messages: bool,
    /// Whether there was one.
    pub(super) has_unpacked: bool,
    /// Bytes of those that were unpacked last.
    pub(super) unpacked: u64,
}

impl Batch {
    /// A batch of records, which lie at `offset` in the file and are whole.
    pub(super) fn new(offset: u64, in_chunk: bool, records: Records) -> Self {
        Batch { records, offset, in_chunk, ..Batch::default() }
    }

    /// Whether records are left.
    pub(super) fn has_next(&self) -> bool {
        self.next < self.records.bytes.len()
    }

    /// Takes the next record; `None` for a definition that is repeated, or a message that is left
    /// out.
    pub(super) fn take_next(
        &mut self,
        definitions: &mut Definitions,
        counts: &mut Counts,
    ) -> Result<Option<Item>, Damage> {
        let bytes = &self.records.bytes;
        let (opcode, length) = split_head(&bytes[self.next..]).unwrap_or_default();
        let start = self.next + HEAD_LEN;
        if opcode == op::MESSAGE {
            let header = message_header(&bytes[start..]).filter(|_| length >= HEADER_LEN);
            return self.message(header.ok_or(unreadable(opcode))?, length, definitions, counts);
        }
        let place = start..start + length as usize;
        self.next = place.end;
        let body = &bytes[place];
        match opcode {
            op::SCHEMA | op::CHANNEL => definition(opcode, body, definitions),
            op::METADATA if !self.in_chunk => {
                counts.metadata += 1;
                match parse_record(opcode, body)? {
                    records::Record::Metadata(metadata) => {
                        Ok(Some(Item::Record(Record::Metadata(metadata))))
                    }
                    _ => Err(unreadable(opcode)),
                }
            }
            0x80.. => {
                let (data, in_chunk) = (Cow::Owned(body.to_vec()), self.in_chunk);
                Ok(Some(Item::Record(Record::Private { opcode, data, in_chunk })))
            }
            0x10.. => Ok(Some(Item::Record(Record::Damaged {
                offset: self.offset,
                damage: Damage::UnknownRecord { opcode, length },
            }))),
            _ => {
                let (record, place) = (record_name(opcode), "inside a chunk");
                Err(Damage::Misplaced { record, opcode, place })
            }
        }
    }

    /// The message whose record comes next; `None` if it is left out.
    fn message(
        &mut self,
        header: MessageHeader,
        length: u64,
        definitions: &Definitions,
        counts: &mut Counts,
    ) -> Result<Option<Item>, Damage> {
        if !definitions.channels.contains_key(&header.channel_id) {
            let MessageHeader { channel_id: channel, sequence, log_time, .. } = header;
            return Err(Damage::UndefinedChannel { channel, sequence, log_time });
        }
        let position = Position { chunk_offset: self.offset, index_in_chunk: self.messages };
        self.messages += 1;
        counts.messages += 1;
        self.places.take(&header, self.next as u64 + self.left_out);
        let start = self.next + HEAD_LEN + MESSAGE_HEADER_LEN;
        if self.records.lacks(header.channel_id) {
            self.next = start;
            self.left_out += length - HEADER_LEN;
            return Ok(None);
        }
        self.next = start + (length - HEADER_LEN) as usize;
        let mut data = self.records.bytes.slice(start..self.next);
        if self.unpacks_messages
            && let Some(unpacked) = chunk::unpack_message(&data)
        {
            (self.has_unpacked, self.unpacked) = (true, unpacked.len() as u64);
            data = unpacked.into();
        }
        Ok(Some(Item::Message { header, data, position }))
    }
}

/// Takes a definition; `None` if it is known already.
fn definition(
    opcode: u8,
    body: &[u8],
    definitions: &mut Definitions,
) -> Result<Option<Item>, Damage> {
    match parse_record(opcode, body)? {
        records::Record::Schema { header, data } => {
            let schema = Schema::new(header, &data);
            if !definitions.is_new_schema(&schema)? {
                return Ok(None);
            }
            definitions.schemas.insert(schema.id, schema.clone());
            Ok(Some(Item::Record(Record::Schema(schema))))
        }
        records::Record::Channel(channel) => {
            if !definitions.is_new_channel(&channel)? {
                return Ok(None);
            }
            definitions.require_schema_of(&channel)?;
            definitions.channels.insert(channel.id, channel.clone());
            Ok(Some(Item::Record(Record::Channel(channel))))
        }
        _ => Err(unreadable(opcode)),
    }
}

fn unreadable(opcode: u8) -> Damage {
    Damage::Unreadable { record: record_name(opcode) }
}
