//! Numbers of objects and bytes of streams.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::Ref;

/// Hands out the numbers of a file's objects.
pub struct Refs(i32);

impl Refs {
    pub fn new() -> Self {
        Refs(0)
    }

    pub fn next(&mut self) -> Ref {
        self.0 += 1;
        Ref::new(self.0)
    }
}

/// Bytes behind the filter FlateDecode.
pub fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes all bytes")
}
