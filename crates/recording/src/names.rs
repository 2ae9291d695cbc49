//! Names of records, and the checksum of the format.

use mcap::records::op;

/// Name of a record, with its article.
pub(crate) const fn record_name(opcode: u8) -> &'static str {
    match opcode {
        op::HEADER => "a header record",
        op::FOOTER => "a footer record",
        op::SCHEMA => "a schema record",
        op::CHANNEL => "a channel record",
        op::MESSAGE => "a message record",
        op::CHUNK => "a chunk record",
        op::MESSAGE_INDEX => "a message index record",
        op::CHUNK_INDEX => "a chunk index record",
        op::ATTACHMENT => "an attachment record",
        op::ATTACHMENT_INDEX => "an attachment index record",
        op::STATISTICS => "a statistics record",
        op::METADATA => "a metadata record",
        op::METADATA_INDEX => "a metadata index record",
        op::SUMMARY_OFFSET => "a summary offset record",
        op::DATA_END => "a data end record",
        0x80.. => "a private record",
        _ => "a record of unknown kind",
    }
}

/// CRC-32, the checksum of the format.
pub fn checksum(bytes: &[u8]) -> u32 {
    crc32fast::hash(bytes)
}
