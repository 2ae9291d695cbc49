//! A slice of a recording: its annotations alone, and behind those of each part of the input what
//! became of its clouds.

use super::state::Job;
use crate::annotate::slice_files::{CHECKPOINTS, SLICE_METADATA, slice_metadata};
use crate::error::Result;
use divmerge_recording::{Position, Record};

impl Job<'_> {
    /// Begins a slice with what it is, if the output is to be one.
    pub(super) fn begin_slice(&mut self) -> Result<()> {
        match &self.options.slice {
            Some(slice) => {
                // Annotated clouds may stand on the channels of the clouds themselves.
                for channel in self.clouds.keys() {
                    self.writer.declare(self.overview.channels[channel].clone());
                }
                let metadata = slice_metadata(slice, &self.parameters);
                Ok(self.writer.write_metadata(SLICE_METADATA, &metadata)?)
            }
            None => Ok(()),
        }
    }

    /// Whether a message at this place is to be annotated.
    pub(super) fn is_in_slice(&self, position: Position) -> bool {
        let slice = self.options.slice.as_ref();
        slice.is_none_or(|slice| slice.contains(position.chunk_offset))
    }

    /// Whether nothing of the slice can follow behind a byte of the input.
    pub(in crate::annotate) fn is_behind_slice(&self, offset: u64) -> bool {
        self.options.slice.as_ref().is_some_and(|slice| offset >= slice.end)
    }

    /// Bytes of the slice that are done, and all of them; without a slice those of the input.
    pub(super) fn of_slice(&self, bytes: u64) -> (u64, u64) {
        match &self.options.slice {
            Some(slice) => {
                (bytes.clamp(slice.start, slice.end) - slice.start, slice.end - slice.start)
            }
            None => (bytes, self.overview.file_size),
        }
    }

    /// Ends what is made of a part of the input: its annotations stand in chunks of their own, as
    /// they do behind a chunk that is copied, and the checkpoints behind them.
    pub(super) fn end_part(&mut self) -> Result<()> {
        if self.checkpoints.is_empty() {
            return Ok(());
        }
        let data = std::mem::take(&mut self.checkpoints).into();
        Ok(self.writer.copy(&Record::Private { opcode: CHECKPOINTS, data, in_chunk: false })?)
    }
}
