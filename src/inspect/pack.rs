//! The binary form of replies: a header in JSON, then arrays that a page takes as they are.
//!
//! The first four bytes are the length of the header (little endian), which is padded with spaces
//! so that the arrays begin at a multiple of eight bytes. `arrays` of the header names each with
//! its type, its length and the byte at which it begins, counted from the first array. Numbers are
//! little endian. Each array has a sum; of one that a page has already, by its sum, the bytes are
//! left out, and `at` is null.

use std::collections::HashMap;
use std::hash::Hasher;

use rustc_hash::FxHasher;
use serde::Serialize;
use serde_json::{Value, json};

/// Arrays begin at multiples of so many bytes.
const ALIGNMENT: usize = 8;

/// Sums of arrays, by name.
pub(super) type Sums = HashMap<String, String>;

/// A reply in the making.
#[derive(Debug, Default)]
pub(super) struct Pack {
    /// The sums of the arrays that the page has, by name.
    known: Sums,
    fields: serde_json::Map<String, Value>,
    arrays: Vec<Value>,
    data: Vec<u8>,
}

impl Pack {
    /// A reply to a page that has some arrays.
    pub fn beside(known: Sums) -> Self {
        Pack { known, ..Pack::default() }
    }

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
        self.data.reserve(length * N);
        for value in values {
            self.data.extend_from_slice(&bytes(value));
        }
        let sum = sum(&self.data[at..]);
        let is_known = self.known.get(name) == Some(&sum);
        if is_known {
            self.data.truncate(at);
        }
        let at = (!is_known).then_some(at);
        let array = json!({ "name": name, "type": kind, "at": at, "length": length, "sum": sum });
        self.arrays.push(array);
    }

    /// The sums of its arrays.
    pub fn sums(&self) -> Sums {
        let text = |array: &Value, key: &str| array[key].as_str().unwrap_or_default().to_owned();
        self.arrays.iter().map(|array| (text(array, "name"), text(array, "sum"))).collect()
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

/// The sum of bytes, which tells arrays apart that a page has from those it has not.
fn sum(bytes: &[u8]) -> String {
    let mut hasher = FxHasher::default();
    hasher.write(bytes);
    hasher.write_usize(bytes.len());
    format!("{:016x}", hasher.finish())
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
        let places = [0, 1].map(|n| header["arrays"][n]["at"].as_u64());
        assert_eq!(places, [Some(0), Some(8)]);
        let data = &bytes[4 + length..];
        assert_eq!(data[..3], [1, 2, 3]);
        assert_eq!(data[8..12], 0.5_f32.to_le_bytes());
        assert_eq!(data.len(), 16);
    }

    #[test]
    fn what_a_page_has_is_left_out() {
        let packed = |known: Sums, last: u8| {
            let mut pack = Pack::beside(known);
            pack.u8("same", [7; 300].into_iter());
            pack.u8("other", [last].into_iter());
            pack
        };
        let first = packed(Sums::new(), 1);
        let (sums, all) = (first.sums(), first.finish());
        let second = packed(sums, 2).finish();
        let length = u32::from_le_bytes(second[..4].try_into().unwrap()) as usize;
        let header: Value = serde_json::from_slice(&second[4..4 + length]).unwrap();
        assert!(header["arrays"][0]["at"].is_null() && header["arrays"][0]["length"] == 300);
        assert_eq!(second[4 + length..], [2]);
        assert!(second.len() < all.len());
    }
}
