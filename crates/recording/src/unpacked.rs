//! How much a recording may unpack to. A small file can hold gigabytes of zeros, and whoever reads
//! it pays for them.

use std::sync::atomic::{AtomicU64, Ordering};

/// How many times smaller than its unpacked records a file may be without being told, as a chunk.
const TIMES_SMALLER: u64 = 64;

/// Bytes to which any file may unpack without being told: sixteen of the largest chunks that are
/// believed whatever their size in the file.
const ALWAYS: u64 = 4 << 30;

/// 0: nothing was told.
static MOST: AtomicU64 = AtomicU64::new(0);

/// Sets to how many bytes each recording may unpack that this process reads from now on. Without
/// this, it is 64 times the bytes of its file, or 4 GiB if that is more.
pub fn limit_unpacked(bytes: u64) {
    MOST.store(bytes.max(1), Ordering::Relaxed);
}

/// Counts the bytes that a recording unpacks to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnpackedBytes {
    bytes: u64,
    pub(crate) most: u64,
}

impl UnpackedBytes {
    /// None yet, of a file of some bytes; 0 of a stream.
    pub(crate) fn of_file(size: u64) -> Self {
        let most = match MOST.load(Ordering::Relaxed) {
            0 => size.saturating_mul(TIMES_SMALLER).max(ALWAYS),
            told => told,
        };
        UnpackedBytes { bytes: 0, most }
    }

    /// Counts some more, and says whether that is still allowed.
    pub(crate) fn take(&mut self, bytes: u64) -> bool {
        self.bytes = self.bytes.saturating_add(bytes);
        self.bytes <= self.most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_may_unpack_to_a_multiple_of_itself() {
        let mut small = UnpackedBytes::of_file(500_000);
        assert!(small.take(4 << 30) && !small.take(1));
        let mut large = UnpackedBytes::of_file(1 << 30);
        assert!(large.take(64 << 30) && !large.take(1) && !large.take(u64::MAX));
    }
}
