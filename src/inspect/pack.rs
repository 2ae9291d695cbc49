//! The binary form of replies: a header in JSON, then arrays that a page takes as they are.
//!
//! The first four bytes are the length of the header (little endian), which is padded with spaces
//! so that the arrays begin at a multiple of eight bytes. `arrays` of the header names each with
//! its type, its length and the byte at which it begins, counted from the first array. Numbers are
//! little endian.

use serde::Serialize;
use serde_json::{Value, json};

/// Arrays begin at multiples of so many bytes.
const ALIGNMENT: usize = 8;

/// A reply in the making.
#[derive(Debug, Default)]
pub(super) struct Pack {
    fields: serde_json::Map<String, Value>,
    arrays: Vec<Value>,
    data: Vec<u8>,
}

impl Pack {
    /// Adds a field to the header.
    ///
    /// # Panics
    /// If the value has no form in JSON.
    pub fn field(&mut self, name: &str, value: impl Serialize) {
        let value = serde_json::to_value(value).expect("values of replies have a form in JSON");
        self.fields.insert(name.to_owned(), value);
    }

    /// Adds single-precision numbers.
    pub fn f32(&mut self, name: &str, values: impl ExactSizeIterator<Item = f32>) {
        self.array(name, "f32", values, |value| value.to_le_bytes());
    }

    /// Adds whole numbers of 32 bits.
    pub fn u32(&mut self, name: &str, values: impl ExactSizeIterator<Item = u32>) {
        self.array(name, "u32", values, |value| value.to_le_bytes());
    }

    /// Adds whole numbers of 16 bits.
    pub fn u16(&mut self, name: &str, values: impl ExactSizeIterator<Item = u16>) {
        self.array(name, "u16", values, |value| value.to_le_bytes());
    }

    /// Adds bytes.
    pub fn u8(&mut self, name: &str, values: impl ExactSizeIterator<Item = u8>) {
        self.array(name, "u8", values, |value| [value]);
    }

    fn array<T, const N: usize>(
        &mut self,
        name: &str,
        kind: &str,
        values: impl ExactSizeIterator<Item = T>,
        bytes: impl Fn(T) -> [u8; N],
    ) {
        self.data.resize(self.data.len().next_multiple_of(ALIGNMENT), 0);
        let (at, length) = (self.data.len(), values.len());
        self.arrays.push(json!({ "name": name, "type": kind, "at": at, "length": length }));
        self.data.reserve(length * N);
        for value in values {
            self.data.extend_from_slice(&bytes(value));
        }
    }

    /// The bytes of the reply.
    pub fn finish(mut self) -> Vec<u8> {
        self.fields.insert("arrays".to_owned(), Value::Array(self.arrays));
        let mut header = Value::Object(self.fields).to_string().into_bytes();
        let padded = (4 + header.len()).next_multiple_of(ALIGNMENT) - 4;
        header.resize(padded, b' ');
        let mut bytes = Vec::with_capacity(4 + header.len() + self.data.len());
        bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
        bytes.append(&mut header);
        bytes.append(&mut self.data);
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_begin_where_the_header_says() {
        let mut pack = Pack::default();
        pack.field("name", "a\"b");
        pack.u8("flags", [1, 2, 3].into_iter());
        pack.f32("x", [0.5, f32::NAN].into_iter());
        let bytes = pack.finish();
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        assert_eq!((4 + length) % ALIGNMENT, 0);
        assert_eq!(header["name"], "a\"b");
        assert_eq!(header["arrays"][0], json!({"name":"flags","type":"u8","at":0,"length":3}));
        assert_eq!(header["arrays"][1]["at"], 8);
        let data = &bytes[4 + length..];
        assert_eq!(data[..3], [1, 2, 3]);
        assert_eq!(data[8..12], 0.5_f32.to_le_bytes());
        assert_eq!(data.len(), 16);
    }
}
