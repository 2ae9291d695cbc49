//! Bytes that several parts of the program keep without a copy.

use std::ops::{Deref, Range};
use std::sync::Arc;

/// Bytes to keep or to use in another thread without a copy. The bytes around them are kept, too.
#[derive(Debug, Clone, Default)]
pub struct SharedBytes {
    all: Arc<Vec<u8>>,
    place: Range<usize>,
}

impl SharedBytes {
    pub(crate) fn new(all: &Arc<Vec<u8>>, place: Range<usize>) -> Self {
        SharedBytes { all: Arc::clone(all), place }
    }

    /// Some of these bytes.
    pub(crate) fn slice(&self, place: Range<usize>) -> Self {
        let start = self.place.start;
        SharedBytes::new(&self.all, start + place.start..start + place.end)
    }
}

impl From<Vec<u8>> for SharedBytes {
    fn from(bytes: Vec<u8>) -> Self {
        SharedBytes::from(Arc::new(bytes))
    }
}

impl From<Arc<Vec<u8>>> for SharedBytes {
    fn from(all: Arc<Vec<u8>>) -> Self {
        let place = 0..all.len();
        SharedBytes { all, place }
    }
}

impl Deref for SharedBytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.all[self.place.clone()]
    }
}
