//! The records of a chunk, or one that is outside.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use mcap::records::{self, AttachmentHeader, Channel, MessageHeader, op};

use super::super::chunk;
use super::super::encode::MESSAGE_HEADER_LEN;
use super::super::parse::parse_record;
use super::super::record::{Position, Record, Schema};
use super::super::scan::{Fields, HEAD_LEN};
use super::super::words::{crc_mismatch, record_name};
use super::RecordingReader;
use crate::error::Result;

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

/// A record of the batch; messages and private records stay there.
pub(super) enum Found {
    Owned(Record<'static>),
    Message(MessageHeader, Range<usize>, Position),
    Private(u8, Range<usize>),
}

impl RecordingReader {
    pub(super) fn open_batch(&mut self, offset: u64, in_chunk: bool, bytes: Vec<u8>) {
        let bytes = Arc::new(bytes);
        self.batch = Batch { bytes, offset, in_chunk, ..Batch::default() };
    }

    /// Takes the next record of the batch, whose records are known to be whole.
    pub(super) fn next_of_batch(&mut self) -> Result<Option<Found>> {
        let offset = self.batch.offset;
        let rest = &self.batch.bytes[self.batch.next..];
        let (opcode, length) = chunk::split_head(rest).unwrap_or_default();
        let start = self.batch.next + HEAD_LEN;
        let place = start..start + length as usize;
        self.batch.next = place.end;
        let body = &self.batch.bytes[place.clone()];
        match opcode {
            op::MESSAGE => {
                let Some(header) = message_header(body) else {
                    return Err(self.unreadable(offset, opcode));
                };
                self.found_message(header, place).map(Some)
            }
            op::SCHEMA | op::CHANNEL => self.found_definition(opcode, place),
            op::ATTACHMENT if !self.batch.in_chunk => {
                self.counts.attachments += 1;
                let record =
                    attachment(body).map_err(|problem| self.source.damage(offset, problem))?;
                Ok(Some(Found::Owned(record)))
            }
            op::METADATA if !self.batch.in_chunk => {
                self.counts.metadata += 1;
                match parse_record(opcode, body) {
                    Some(records::Record::Metadata(metadata)) => {
                        Ok(Some(Found::Owned(Record::Metadata(metadata))))
                    }
                    _ => Err(self.unreadable(offset, opcode)),
                }
            }
            0x80.. => Ok(Some(Found::Private(opcode, place))),
            0x10.. => Ok(Some(Found::Owned(Record::Damaged {
                offset,
                problem: format!(
                    "a record of {length} bytes with opcode {opcode:#04x}, which this version of \
                     the format does not know, is left out"
                ),
            }))),
            _ => Err(self.source.damage(
                offset,
                format!("{} (opcode {opcode:#04x}) inside a chunk", record_name(opcode)),
            )),
        }
    }

    fn found_message(&mut self, header: MessageHeader, place: Range<usize>) -> Result<Found> {
        let offset = self.batch.offset;
        if !self.channels.contains_key(&header.channel_id) {
            return Err(self.source.damage(
                offset,
                format!(
                    "a message (sequence {}, log time {} ns) of channel {}, which has not been \
                     defined",
                    header.sequence, header.log_time, header.channel_id
                ),
            ));
        }
        let position = Position { chunk_offset: offset, index_in_chunk: self.batch.messages };
        self.batch.messages += 1;
        self.counts.messages += 1;
        let data = place.start + MESSAGE_HEADER_LEN..place.end;
        Ok(Found::Message(header, data, position))
    }

    fn found_definition(&mut self, opcode: u8, place: Range<usize>) -> Result<Option<Found>> {
        let offset = self.batch.offset;
        match parse_record(opcode, &self.batch.bytes[place]) {
            Some(records::Record::Schema { header, data }) => {
                let schema = owned_schema(header, &data);
                if !self.is_new_schema(offset, &schema)? {
                    return Ok(None);
                }
                self.schemas.insert(schema.id, schema.clone());
                Ok(Some(Found::Owned(Record::Schema(schema))))
            }
            Some(records::Record::Channel(channel)) => {
                if !self.is_new_channel(offset, &channel)? {
                    return Ok(None);
                }
                if channel.schema_id != 0 && !self.schemas.contains_key(&channel.schema_id) {
                    return Err(self.source.damage(offset, unknown_schema(&channel)));
                }
                self.channels.insert(channel.id, channel.clone());
                Ok(Some(Found::Owned(Record::Channel(channel))))
            }
            _ => Err(self.unreadable(offset, opcode)),
        }
    }

    pub(super) fn is_new_schema(&self, offset: u64, schema: &Schema) -> Result<bool> {
        if schema.id == 0 {
            let problem = format!("schema `{}` has the id 0, which means no schema", schema.name);
            return Err(self.source.damage(offset, problem));
        }
        match self.schemas.get(&schema.id) {
            None => Ok(true),
            Some(known) if known == schema => Ok(false),
            Some(known) => Err(self.source.damage(
                offset,
                format!(
                    "schema {} is defined twice, as `{}` and differently as `{}`",
                    schema.id, known.name, schema.name
                ),
            )),
        }
    }

    pub(super) fn is_new_channel(&self, offset: u64, channel: &Channel) -> Result<bool> {
        match self.channels.get(&channel.id) {
            None => Ok(true),
            Some(known) if known == channel => Ok(false),
            Some(known) => Err(self.source.damage(
                offset,
                format!(
                    "channel {} is defined twice, as `{}` and differently as `{}`",
                    channel.id, known.topic, channel.topic
                ),
            )),
        }
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

fn attachment(body: &[u8]) -> std::result::Result<Record<'static>, String> {
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
    let (header, data, covered, stored) = parse().ok_or("an attachment record cannot be parsed")?;
    let computed = crc32fast::hash(covered);
    if stored != 0 && stored != computed {
        let what = format!("attachment `{}`:", header.name);
        return Err(crc_mismatch(&what, stored, computed));
    }
    Ok(Record::Attachment { header, data: Cow::Owned(data.to_vec()) })
}

pub(super) fn owned_schema(header: records::SchemaHeader, data: &[u8]) -> Schema {
    Schema { id: header.id, name: header.name, encoding: header.encoding, data: data.to_vec() }
}

pub(super) fn unknown_schema(channel: &Channel) -> String {
    format!(
        "channel {} (`{}`) has schema {}, which has not been defined",
        channel.id, channel.topic, channel.schema_id
    )
}
