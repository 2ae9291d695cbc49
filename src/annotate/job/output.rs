//! What goes out: whatever is pending is written in the order of the input, and the output is
//! completed.

use std::ops::ControlFlow;

use super::pending::{Pending, PendingItem};
use super::state::Job;
use crate::annotate::event::RunEvent;
use crate::annotate::metadata::{METADATA_NAME, TRACKS_METADATA_NAME, metadata, track_metadata};
use crate::annotate::report::AnnotationReport;
use crate::annotate::resume::{clean_up, journal_of};
use crate::error::{Error, Result};
use crate::frames::choose_topics;
use divmerge_recording::{Damage, Item, Record, RecordingReader};

impl Job<'_> {
    /// Writes all that is waiting.
    pub(in crate::annotate) fn settle_all(&mut self) -> Result<()> {
        self.decide_all()?;
        while !self.queue.is_empty() {
            self.settle()?;
        }
        Ok(())
    }

    /// Writes what is at the front.
    pub(super) fn settle(&mut self) -> Result<()> {
        if self.queue.is_first_ready() == Some(false) {
            self.batch.run(&self.workers);
        }
        let Some(Pending { bytes, item }) = self.queue.pop() else {
            return Ok(());
        };
        match item {
            PendingItem::Chunk(chunk) => {
                self.writer.copy_chunk(&chunk)?;
                self.report.messages += chunk.message_count();
                self.progress(bytes)
            }
            PendingItem::Item(Item::Message { header, data, .. }) => {
                self.writer.write_shared(&header, data)?;
                self.report.messages += 1;
                self.progress(bytes)
            }
            PendingItem::Item(Item::Record(record)) => self.record(&record),
            PendingItem::Cloud(cloud) => {
                self.cloud(*cloud)?;
                self.progress(bytes)
            }
            PendingItem::Turn(turn) => {
                self.turn(*turn)?;
                self.progress(bytes)
            }
            PendingItem::EndOfPart => self.end_part(),
        }
    }

    fn progress(&mut self, bytes: u64) -> Result<()> {
        let (bytes, total) = self.of_slice(bytes);
        match (self.on_event)(RunEvent::Progress { bytes, total }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Interrupted { path: self.report.output.clone() }),
        }
    }

    pub(super) fn record(&mut self, record: &Record) -> Result<()> {
        match record {
            Record::Damaged { offset, damage } => {
                self.warn(format!("{damage} (byte {offset})"));
            }
            Record::Truncated { offset, damage } => {
                let cut = match damage {
                    Damage::SecondRecording { .. } => format!("{damage} (byte {offset})"),
                    _ => format!(
                        "cut off: {damage} (byte {offset}); annotated up to the last readable \
                         message"
                    ),
                };
                self.warn(cut.clone());
                self.report.truncated = Some(cut);
            }
            other => self.writer.copy(other)?,
        }
        Ok(())
    }

    /// Ends with an error; what an interrupted run had done is left if it can be resumed.
    pub(in crate::annotate) fn give_up(mut self, error: Error) -> Error {
        self.warn_of_clouds();
        if let (Error::Interrupted { .. }, Some(journal)) = (&error, &mut self.journal) {
            journal.keep();
            let partial = self.writer.leave();
            let journal = journal_of(&self.report.output);
            return Error::Left { partial, journal };
        }
        error
    }

    /// Completes the output. The reader is at the end of the input.
    pub(in crate::annotate) fn finish(
        mut self,
        mut reader: RecordingReader,
    ) -> Result<AnnotationReport> {
        if let Err(error) = self.push_last_turns().and_then(|()| self.settle_all()) {
            return Err(self.give_up(error));
        }
        if self.is_stream {
            choose_topics(&self.overview, &self.options.topics, None)?;
        }
        if let Some(completed) = &mut self.completed {
            completed.finish()?;
        }
        self.declare_added()?;
        self.warn_of_clouds();
        self.report_tracks();
        for warning in std::mem::take(&mut self.watch).warnings() {
            self.warn(warning);
        }
        if reader.has_unpacked_messages() {
            let unpacked = "its messages are compressed each by itself (rosbag2's \
                            compression_mode: message); the output has them unpacked";
            self.warn(unpacked.to_owned());
        }
        if self.options.slice.is_none() {
            self.report.input_sha256 = reader.finish()?;
        }
        self.report.input_bytes_read = reader.bytes_read();
        self.report.fetched = reader.fetched();
        if self.options.slice.is_none() {
            self.writer.write_declared()?;
            let metadata = metadata(&self.report, self.parameters.metadata());
            self.writer.write_metadata(METADATA_NAME, &metadata)?;
            for (topic, report) in &self.report.topics {
                if !report.tracks.is_empty() {
                    let tracks = track_metadata(topic, &report.tracks);
                    self.writer.write_metadata(TRACKS_METADATA_NAME, &tracks)?;
                }
            }
        }
        (self.report.output_bytes, self.report.profile.write) = self.writer.finish_timed()?;
        if self.journal.is_some() {
            drop(self.completed.take());
            clean_up(&self.report.output);
        }
        Ok(self.report)
    }
}
