//! What is to follow in the file, in its order: chunks that are being compressed, and the records
//! between them.

use std::collections::VecDeque;
use std::io;
use std::path::PathBuf;
use std::time::Instant;

use mcap::records::{AttachmentHeader, AttachmentIndex, MetadataIndex};

use super::options::WriteTimes;
use super::output::Output;
use super::summary::Summary;
use crate::error::Result;
use crate::pack::PackedChunk;
use crate::workers::{Ticket, Workers};

/// Something with a place in the file.
pub(super) enum Placement {
    /// A chunk that is being compressed.
    Packing(Ticket<io::Result<PackedChunk>>),
    /// A chunk as it lies in another file.
    Verbatim(PackedChunk),
    /// A private record, or a piece of an attached file.
    Bytes(Vec<u8>),
    /// The beginning of an attachment record, its header again, and how many bytes of the attached
    /// file follow.
    Attachment(Vec<u8>, AttachmentHeader, u64),
    /// A metadata record and its name.
    Metadata(Vec<u8>, String),
}

impl Placement {
    fn is_ready(&mut self) -> bool {
        match self {
            Placement::Packing(chunk) => chunk.is_ready(),
            _ => true,
        }
    }
}

/// The file, and what is to follow in it.
pub(super) struct Queue {
    output: Output,
    waiting: VecDeque<Placement>,
    pub(super) summary: Summary,
    pub(super) workers: Workers,
    pub(super) times: WriteTimes,
}

impl Queue {
    pub(super) fn new(output: Output) -> Self {
        Queue {
            output,
            waiting: VecDeque::new(),
            summary: Summary::default(),
            workers: Workers::none(),
            times: WriteTimes::default(),
        }
    }

    /// Queues something, and places what is ready. Where more is waiting than keeps the threads
    /// busy, this waits for the front of it.
    pub(super) fn push(&mut self, placement: Placement) -> Result<()> {
        self.waiting.push_back(placement);
        let most = if self.workers.is_parallel() { self.workers.threads() + 2 } else { 0 };
        self.place_all_but(most)
    }

    /// As [`Queue::push`], and places everything.
    pub(super) fn push_large(&mut self, placement: Placement) -> Result<()> {
        self.waiting.push_back(placement);
        self.place_all_but(0)
    }

    fn place_all_but(&mut self, most: usize) -> Result<()> {
        while let Some(mut next) = self.waiting.pop_front() {
            if self.waiting.len() < most && !next.is_ready() {
                self.waiting.push_front(next);
                break;
            }
            self.place(next)?;
        }
        Ok(())
    }

    fn place(&mut self, next: Placement) -> Result<()> {
        let offset = self.output.offset;
        match next {
            Placement::Packing(chunk) => {
                let started = Instant::now();
                let chunk = chunk.wait().map_err(|source| self.output.error(source))?;
                self.times.wait.take_since(started, 0);
                self.times.compress.take(chunk.ms, chunk.uncompressed_size);
                self.times.compressed_bytes += chunk.compressed_size;
                self.place_chunk(&chunk)
            }
            Placement::Verbatim(chunk) => self.place_chunk(&chunk),
            Placement::Bytes(bytes) => self.write(&[&bytes]),
            Placement::Attachment(start, header, data_size) => {
                let AttachmentHeader { log_time, create_time, name, media_type } = header;
                self.summary.attachments.push(AttachmentIndex {
                    offset,
                    // With the file and its checksum.
                    length: start.len() as u64 + data_size + size_of::<u32>() as u64,
                    log_time,
                    create_time,
                    data_size,
                    name,
                    media_type,
                });
                self.write(&[&start])
            }
            Placement::Metadata(record, name) => {
                let length = record.len() as u64;
                self.summary.metadata.push(MetadataIndex { offset, length, name });
                self.write(&[&record])
            }
        }
    }

    fn place_chunk(&mut self, chunk: &PackedChunk) -> Result<()> {
        let (indexes, index) = chunk.index(self.output.offset);
        self.summary.add_chunk(&index);
        let [start, data, large] = &chunk.parts;
        self.write(&[start, data, large, &indexes])
    }

    pub(super) fn write(&mut self, parts: &[&[u8]]) -> Result<()> {
        let (started, before) = (Instant::now(), self.output.offset);
        parts.iter().try_for_each(|part| self.output.write(part))?;
        self.times.write.take_since(started, self.output.offset - before);
        Ok(())
    }

    /// Places everything and the summary, makes sure that it is on the disk, and gives the file its
    /// name. Returns its bytes and what writing took.
    pub(super) fn finish(mut self) -> Result<(u64, WriteTimes)> {
        self.place_all_but(0)?;
        let summary = std::mem::take(&mut self.summary);
        let end = summary.close(self.output.offset, self.output.checksum());
        self.write(&end.each_ref().map(Vec::as_slice))?;
        let started = Instant::now();
        self.output.sync()?;
        self.times.write.take_since(started, 0);
        let size = self.output.offset;
        self.output.close()?;
        Ok((size, self.times))
    }

    /// Leaves the file under its temporary name, without what is not placed yet.
    pub(super) fn leave(self) -> PathBuf {
        self.output.leave()
    }
}
