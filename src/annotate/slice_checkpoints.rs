//! What became of the clouds of a recording, as its annotated slices have it.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use super::checkpoint::{Checkpoint, CheckpointSource, StoredMessage};
use super::slice_files::{CHECKPOINTS, SliceFile};
use crate::error::{Error, Result, SliceProblem};
use divmerge_recording::workers::Workers;
use divmerge_recording::{Item, Part, Record, RecordingReader, checksum};

/// What became of the clouds of a recording, slice after slice.
pub(super) struct SliceCheckpoints {
    files: VecDeque<SliceFile>,
    workers: Workers,
    open: Option<(SliceFile, RecordingReader)>,
    checkpoints: VecDeque<Checkpoint>,
    messages: VecDeque<StoredMessage>,
}

impl SliceCheckpoints {
    pub(super) fn new(slices: &[SliceFile], workers: &Workers) -> Self {
        SliceCheckpoints {
            files: slices.iter().cloned().collect(),
            workers: workers.clone(),
            open: None,
            checkpoints: VecDeque::new(),
            messages: VecDeque::new(),
        }
    }

    /// Reads on; whether there was anything.
    fn advance(&mut self) -> Result<bool> {
        let Some((_, reader)) = &mut self.open else {
            let Some(file) = self.files.pop_front() else {
                return Ok(false);
            };
            let reader = RecordingReader::open_unhashed(&file.path, &self.workers)?;
            self.open = Some((file, reader));
            return Ok(true);
        };
        match reader.next_part()? {
            Some(Part::Chunk(chunk)) => {
                let chunk = Arc::new(chunk);
                let stored = |item: &Item| match item {
                    Item::Message { data, .. } => {
                        Some(StoredMessage { data: data.clone(), chunk: Some(Arc::clone(&chunk)) })
                    }
                    Item::Record(_) => None,
                };
                self.messages.extend(chunk.items.iter().filter_map(stored));
            }
            Some(Part::Items(items)) => {
                for item in items {
                    self.item(item)?;
                }
            }
            None => {
                self.refuse_left()?;
                self.open = None;
            }
        }
        Ok(true)
    }

    fn item(&mut self, item: Item) -> Result<()> {
        match item {
            Item::Message { data, .. } => {
                self.messages.push_back(StoredMessage { data, chunk: None })
            }
            Item::Record(Record::Private { opcode: CHECKPOINTS, data, .. }) => {
                let lines = data.split(|&byte| byte == b'\n').filter(|line| !line.is_empty());
                let checkpoints: std::result::Result<Vec<Checkpoint>, _> =
                    lines.map(serde_json::from_slice).collect();
                let wrong = |error: serde_json::Error| {
                    self.wrong(SliceProblem::Checkpoints { reason: error.to_string() })
                };
                self.checkpoints.extend(checkpoints.map_err(wrong)?);
            }
            Item::Record(Record::Truncated { damage, .. }) => {
                return Err(self.wrong(SliceProblem::CutOff { damage }));
            }
            // Also where no message is lost by it: the checksum over everything covers what the
            // slice says of itself.
            Item::Record(Record::Damaged { damage, .. }) => {
                return Err(self.wrong(SliceProblem::Damaged { damage }));
            }
            Item::Record(_) => {}
        }
        Ok(())
    }

    /// Refuses messages that belong to no cloud.
    fn refuse_left(&self) -> Result<()> {
        match self.messages.is_empty() {
            true => Ok(()),
            false => Err(self.wrong(SliceProblem::OtherMessages)),
        }
    }

    /// An error about the slice that is read.
    fn wrong(&self, problem: SliceProblem) -> Error {
        let slice = self.open.as_ref().map(|(file, _)| file).or(self.files.front());
        let of = slice.map_or_else(PathBuf::new, |file| file.path.clone());
        Error::Slices { of, problem }
    }
}

impl CheckpointSource for SliceCheckpoints {
    fn next(&mut self) -> Result<Option<Checkpoint>> {
        while self.checkpoints.is_empty() {
            if !self.advance()? {
                return Ok(None);
            }
        }
        Ok(self.checkpoints.pop_front())
    }

    fn message(&mut self, wanted: u32) -> Result<Option<StoredMessage>> {
        let is_wanted = |stored: &StoredMessage| checksum(&stored.data) == wanted;
        Ok(self.messages.pop_front().filter(is_wanted))
    }

    fn missing(&self, problem: SliceProblem) -> Result<()> {
        Err(self.wrong(problem))
    }

    fn changed(&self, topic: &str, number: u64) -> Error {
        self.wrong(SliceProblem::ChangedCloud { topic: topic.to_owned(), number })
    }
}
