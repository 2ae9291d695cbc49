//! The small pieces that records are made of.

use mcap::records::MessageHeader;

/// Bytes of a record's opcode and length.
pub(crate) const HEAD_LEN: usize = 1 + 8;

/// Bytes of a message's own header: channel, sequence, log and publish time.
pub(crate) const MESSAGE_HEADER_LEN: usize = 2 + 4 + 8 + 8;

/// The most bytes that one record, or the records of one chunk, may hold. A length is believed up
/// to here.
pub(crate) const MAX_RECORD: u64 = 2 << 30;

/// The fields of a record that are not parsed yet: little endian, strings behind their length.
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*bytes)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.take().map(u8::from_le_bytes)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    pub(crate) fn bytes(&mut self, length: u64) -> Option<&'a [u8]> {
        let (bytes, rest) = self.0.split_at_checked(usize::try_from(length).ok()?)?;
        self.0 = rest;
        Some(bytes)
    }

    /// Bytes behind their length of 32 bits.
    pub(crate) fn block(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.bytes(length.into())
    }

    pub(crate) fn str(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.block()?).ok()
    }
}

/// The head of a record.
pub(crate) fn head(opcode: u8, length: u64) -> [u8; HEAD_LEN] {
    let mut head = [opcode; HEAD_LEN];
    head[1..].copy_from_slice(&length.to_le_bytes());
    head
}

/// Opcode and length of the record that `bytes` begins with.
pub(crate) fn split_head(bytes: &[u8]) -> Option<(u8, u64)> {
    let mut fields = Fields(bytes);
    Some((fields.u8()?, fields.u64()?))
}

/// The header that the content of a message record begins with.
pub(crate) fn message_header(body: &[u8]) -> Option<MessageHeader> {
    let mut fields = Fields(body);
    Some(MessageHeader {
        channel_id: fields.u16()?,
        sequence: fields.u32()?,
        log_time: fields.u64()?,
        publish_time: fields.u64()?,
    })
}
