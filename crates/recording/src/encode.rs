//! Records as bytes, from the structures of `mcap`.

use std::io::Cursor;

use binrw::BinWrite;
use mcap::records::{MessageHeader, SchemaHeader, op};

use crate::fields::{MESSAGE_HEADER_LEN, head};
use crate::record::Schema;

/// A structure of the format that is written without arguments.
pub(crate) trait Structure: for<'a> BinWrite<Args<'a> = ()> {}

impl<T: for<'a> BinWrite<Args<'a> = ()>> Structure for T {}

/// The bytes of a structure.
pub(crate) fn bytes(structure: &impl Structure) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    structure.write_le(&mut bytes).expect("memory takes any structure");
    bytes.into_inner()
}

/// A record that is one structure.
pub(crate) fn record(opcode: u8, structure: &impl Structure) -> Vec<u8> {
    let content = bytes(structure);
    [&head(opcode, content.len() as u64), content.as_slice()].concat()
}

/// A record of any bytes.
pub(crate) fn plain(opcode: u8, content: &[u8]) -> Vec<u8> {
    [&head(opcode, content.len() as u64), content].concat()
}

/// A schema record.
pub(crate) fn schema(schema: &Schema) -> Vec<u8> {
    let Schema { id, name, encoding, data } = schema;
    let header = SchemaHeader { id: *id, name: name.clone(), encoding: encoding.clone() };
    let length = (data.len() as u32).to_le_bytes();
    plain(op::SCHEMA, &[bytes(&header).as_slice(), &length, data].concat())
}

/// Appends a message record, up to its data of this length.
pub(crate) fn put_message_start(header: &MessageHeader, length: usize, into: &mut Vec<u8>) {
    into.extend_from_slice(&head(op::MESSAGE, (MESSAGE_HEADER_LEN + length) as u64));
    into.extend_from_slice(&header.channel_id.to_le_bytes());
    into.extend_from_slice(&header.sequence.to_le_bytes());
    into.extend_from_slice(&header.log_time.to_le_bytes());
    into.extend_from_slice(&header.publish_time.to_le_bytes());
}
