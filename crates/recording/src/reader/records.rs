//! The records of a chunk, or one that stands outside of chunks, in memory.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::chunk;
use crate::damage::Damage;
use crate::fields::HEAD_LEN;
use crate::shared_bytes::SharedBytes;

/// Records with their heads, one behind the other.
#[derive(Default)]
pub(super) struct Records {
    pub(super) bytes: SharedBytes,
    /// Channels whose messages alone have their content in `bytes`; `None`: all.
    kept: Option<Arc<BTreeSet<u16>>>,
}

impl Records {
    /// Those in the record of a chunk, checked.
    pub(super) fn unpacked(record: &Arc<Vec<u8>>) -> Result<Self, Damage> {
        Ok(Records::whole(chunk::unpack(record)?))
    }

    /// Those in the record of a chunk, checked, without the content of messages on other channels.
    pub(super) fn skimmed(record: &Arc<Vec<u8>>, kept: Arc<BTreeSet<u16>>) -> Result<Self, Damage> {
        let bytes = chunk::skim(&record[HEAD_LEN..], &|channel| kept.contains(&channel))?;
        Ok(Records { bytes: bytes.into(), kept: Some(kept) })
    }

    /// All of these.
    pub(super) fn whole(bytes: SharedBytes) -> Self {
        Records { bytes, kept: None }
    }

    /// Whether the content of messages on other channels is left out.
    pub(super) fn is_skimmed(&self) -> bool {
        self.kept.is_some()
    }

    /// Whether the content of a channel's messages is left out.
    pub(super) fn lacks(&self, channel: u16) -> bool {
        self.kept.as_ref().is_some_and(|kept| !kept.contains(&channel))
    }
}
