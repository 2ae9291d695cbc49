//! Protobuf's wire format, read where it lies: numbered values one behind the other
//! (<https://protobuf.dev/programming-guides/encoding>). Ours because `prost` copies a cloud's data
//! (docs/decisions/0007-formats-of-clouds.md).

/// A value in a message; the message's definition says what it means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Value<'a> {
    /// An integer of variable length: enumerations, `int64`, `int32`.
    Varint(u64),
    /// 64 bits: `double`.
    Fixed64(u64),
    /// Bytes with their length: text, bytes, a message within the message.
    Bytes(&'a [u8]),
    /// 32 bits: `fixed32`.
    Fixed32(u32),
}

/// The numbered values of a message in its order. The first that is not whole ends it with an error
/// in words.
pub(super) struct Values<'a> {
    message: &'a [u8],
    position: usize,
}

/// The values of a message.
pub(super) fn values(message: &[u8]) -> Values<'_> {
    Values { message, position: 0 }
}

impl<'a> Iterator for Values<'a> {
    type Item = Result<(u64, Value<'a>), String>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.position >= self.message.len() {
            return None;
        }
        let at = self.position;
        let value = self.value();
        if value.is_none() {
            self.position = self.message.len();
        }
        Some(value.ok_or_else(|| {
            format!(
                "the value at byte {at} of {} is cut off or of no known kind",
                self.message.len()
            )
        }))
    }
}

impl<'a> Values<'a> {
    fn value(&mut self) -> Option<(u64, Value<'a>)> {
        let key = self.varint()?;
        let value = match key & 7 {
            0 => Value::Varint(self.varint()?),
            1 => Value::Fixed64(u64::from_le_bytes(self.array()?)),
            2 => {
                let length = usize::try_from(self.varint()?).ok()?;
                Value::Bytes(self.bytes(length)?)
            }
            5 => Value::Fixed32(u32::from_le_bytes(self.array()?)),
            // 3 and 4 are groups, which no message of Foxglove has.
            _ => return None,
        };
        Some((key >> 3, value))
    }

    fn bytes(&mut self, length: usize) -> Option<&'a [u8]> {
        let bytes = self.message[self.position..].get(..length)?;
        self.position += length;
        Some(bytes)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.bytes(N)?.first_chunk().copied()
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let [byte] = self.array()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }
}

/// Appends the key of a value of bytes and their number, which must follow.
pub(super) fn put_length(number: u64, length: usize, out: &mut Vec<u8>) {
    put_varint(number << 3 | 2, out);
    put_varint(length as u64, out);
}

/// Appends an integer of variable length with its key.
pub(super) fn put_integer(number: u64, value: u64, out: &mut Vec<u8>) {
    put_varint(number << 3, out);
    put_varint(value, out);
}

/// Appends bytes with their key and number.
pub(super) fn put_bytes(number: u64, bytes: &[u8], out: &mut Vec<u8>) {
    put_length(number, bytes.len(), out);
    out.extend_from_slice(bytes);
}

fn put_varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(message: &[u8]) -> Result<Vec<(u64, Value<'_>)>, String> {
        values(message).collect()
    }

    #[test]
    fn known_bytes() {
        // The examples of the specification: 150 in field 1, `testing` in field 2.
        assert_eq!(read(&[0x08, 0x96, 0x01]), Ok(vec![(1, Value::Varint(150))]));
        let testing = [[0x12, 7].as_slice(), b"testing"].concat();
        assert_eq!(read(&testing), Ok(vec![(2, Value::Bytes(b"testing"))]));
        assert_eq!(read(&[0x15, 1, 0, 0, 0]), Ok(vec![(2, Value::Fixed32(1))]));
        assert_eq!(read(&[0x09, 2, 0, 0, 0, 0, 0, 0, 0]), Ok(vec![(1, Value::Fixed64(2))]));
        assert_eq!(read(&[]), Ok(vec![]));
        let minus_one = [&[0x08][..], &[0xff; 9], &[1]].concat();
        assert_eq!(read(&minus_one), Ok(vec![(1, Value::Varint(u64::MAX))]));
    }

    #[test]
    fn what_is_not_whole_is_an_error_and_the_end() {
        let endless = [&[0x08][..], &[0xff; 12]].concat();
        let lying = [0x12, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01];
        for message in [&[0x08][..], &[0x12, 2, 0], &[0x15, 0], &[0x0b], &endless, &lying] {
            let all: Vec<_> = values(message).collect();
            assert_eq!(all.len(), 1, "{message:?}");
            assert!(all[0].as_ref().is_err_and(|problem| problem.contains("byte 0 of")));
        }
    }

    #[test]
    fn integers_are_read_back() {
        for value in [0, 1, 127, 128, 300, u64::MAX] {
            let mut out = Vec::new();
            put_integer(2, value, &mut out);
            assert_eq!(read(&out), Ok(vec![(2, Value::Varint(value))]));
        }
    }

    #[test]
    fn a_length_is_read_back() {
        for length in [0, 1, 127, 128, 300, 5_000_000] {
            let mut out = Vec::new();
            put_length(6, length, &mut out);
            out.resize(out.len() + length, 7);
            assert_eq!(read(&out), Ok(vec![(6, Value::Bytes(&vec![7; length]))]));
        }
    }
}
