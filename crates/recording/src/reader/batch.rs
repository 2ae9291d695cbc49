//! The records of a chunk, or one that is outside of chunks.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use mcap::records::{self, AttachmentHeader, MessageHeader, op};

use super::counts::Counts;
use super::definitions::Definitions;
use crate::damage::Damage;
use crate::fields::{Fields, HEAD_LEN, MESSAGE_HEADER_LEN, split_head};
use crate::names::record_name;
use crate::parse::parse_record;
use crate::part::{Item, SharedBytes};
use crate::record::{Position, Record, Schema};

/// Records that are in memory with their heads: those of a chunk, or one that was outside.
#[derive(Default)]
pub(super) struct Batch {
    pub(super) bytes: Arc<Vec<u8>>,
    pub(super) next: usize,
    pub(super) offset: u64,
    pub(super) in_chunk: bool,
    pub(super) messages: u32,
    /// Whether it is a whole chunk, checked.
    pub(super) is_copyable: bool,
}

impl Batch {
    /// A batch of the records in `bytes`, which lie at `offset` in the file and are whole.
    pub(super) fn new(offset: u64, in_chunk: bool, bytes: Vec<u8>) -> Self {
        Batch { bytes: Arc::new(bytes), offset, in_chunk, ..Batch::default() }
    }

    /// Whether records are left.
    pub(super) fn has_next(&self) -> bool {
        self.next < self.bytes.len()
    }

    /// Takes the next record; `None` for a definition that is repeated.
    pub(super) fn take_next(
        &mut self,
        definitions: &mut Definitions,
        counts: &mut Counts,
    ) -> Result<Option<Item>, Damage> {
        let (opcode, length) = split_head(&self.bytes[self.next..]).unwrap_or_default();
        let start = self.next + HEAD_LEN;
        let place = start..start + length as usize;
        self.next = place.end;
        let body = &self.bytes[place.clone()];
        match opcode {
            op::MESSAGE => {
                let header = message_header(body).ok_or(unreadable(opcode))?;
                self.message(header, place, definitions, counts).map(Some)
            }
            op::SCHEMA | op::CHANNEL => definition(opcode, body, definitions),
            op::ATTACHMENT if !self.in_chunk => {
                counts.attachments += 1;
                attachment(body).map(|record| Some(Item::Record(record)))
            }
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

    fn message(
        &mut self,
        header: MessageHeader,
        place: Range<usize>,
        definitions: &Definitions,
        counts: &mut Counts,
    ) -> Result<Item, Damage> {
        if !definitions.channels.contains_key(&header.channel_id) {
            let MessageHeader { channel_id: channel, sequence, log_time, .. } = header;
            return Err(Damage::UndefinedChannel { channel, sequence, log_time });
        }
        let position = Position { chunk_offset: self.offset, index_in_chunk: self.messages };
        self.messages += 1;
        counts.messages += 1;
        let place = place.start + MESSAGE_HEADER_LEN..place.end;
        Ok(Item::Message { header, data: SharedBytes::new(&self.bytes, place), position })
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

fn message_header(body: &[u8]) -> Option<MessageHeader> {
    let mut fields = Fields(body);
    Some(MessageHeader {
        channel_id: fields.u16()?,
        sequence: fields.u32()?,
        log_time: fields.u64()?,
        publish_time: fields.u64()?,
    })
}

fn attachment(body: &[u8]) -> Result<Record<'static>, Damage> {
    let mut fields = Fields(body);
    let mut parse = || {
        let header = AttachmentHeader {
            log_time: fields.u64()?,
            create_time: fields.u64()?,
            name: fields.str()?.to_owned(),
            media_type: fields.str()?.to_owned(),
        };
        let length = fields.u64()?;
        let data = fields.bytes(length)?;
        let covered = body.len() - fields.0.len();
        Some((header, data, &body[..covered], fields.u32()?))
    };
    let (header, data, covered, stored) = parse().ok_or(unreadable(op::ATTACHMENT))?;
    let name = format!("attachment `{}`:", header.name);
    Damage::check(&name, stored, crc32fast::hash(covered))?;
    Ok(Record::Attachment { header, data: Cow::Owned(data.to_vec()) })
}

fn unreadable(opcode: u8) -> Damage {
    Damage::Unreadable { record: record_name(opcode) }
}
