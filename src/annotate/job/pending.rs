//! What waits to be written, in the order of the input.

use std::collections::VecDeque;

use crate::annotate::checkpoint::CompletedCloud;
use crate::annotate::clustered::Clustered;
use crate::annotate::message::Written;
use crate::annotate::report::FrameReport;
use crate::annotate::tracking::Untracked;
use crate::annotate::writing::{Annotated, Writing};
use crate::error::Result;
use crate::frames::EncodedCloud;
use divmerge_recording::workers::Ticket;
use divmerge_recording::{Item, SourceChunk};

/// Bytes of the input's messages, for each thread, that may wait for clouds before them.
const WAITING_PER_THREAD: usize = 16 << 20;
/// The same, however many threads there are.
const MOST_WAITING: usize = 64 << 20;
/// Bytes in memory of something that waits, about, beside those of its messages.
const BESIDE_MESSAGES: usize = 1 << 10;

/// Clouds that are clustered or wait for their turn: one for each thread, and one to follow; where
/// several go through a network together, as many batches as keep four threads busy.
pub(super) fn most_clouds(threads: usize, batch: usize) -> usize {
    match batch {
        0 | 1 => threads + 1,
        batch => threads.min(4) * batch + 1,
    }
}

/// Something to be written, and how many bytes of the input are read when it is.
pub(super) struct Pending {
    pub(super) bytes: u64,
    pub(super) item: PendingItem,
}

pub(super) enum PendingItem {
    Chunk(SourceChunk),
    Item(Item),
    Cloud(Box<PendingCloud>),
    /// The end of a part of the input, where a slice is annotated.
    EndOfPart,
}

/// A cloud being clustered.
pub(super) struct PendingCloud {
    pub(super) encoded: EncodedCloud,
    /// Its number in [`Tracking`](super::followed::Tracking), if its objects are followed.
    pub(super) followed: Option<u64>,
    pub(super) result: Ticket<Result<CloudResult>>,
}

/// What becomes of a cloud: this run annotates it, or a run before completed it.
pub(super) enum CloudResult {
    /// Clustered and annotated; with what a checkpoint keeps of it to follow its objects.
    Annotated(Box<Clustered>, Annotated, Option<String>),
    /// Clustered; its objects are followed.
    Untracked(Box<Clustered>, Box<Untracked>),
    /// The same with its tracks.
    Tracked(FrameReport, Annotated, Option<String>),
    /// A slice has it, and it has its tracks now.
    Joined(FrameReport, Annotated),
    Completed(CompletedCloud),
}

impl CloudResult {
    /// What becomes of a clustered cloud; of a slice its tracks are found later.
    pub(super) fn of(
        encoded: &EncodedCloud,
        (clustered, written): (Clustered, Written),
        (writing, is_of_slice): (Writing, bool),
    ) -> Result<CloudResult> {
        let clustered = Box::new(clustered);
        Ok(match written {
            Written::Annotated(annotated) => CloudResult::Annotated(clustered, annotated, None),
            Written::Untracked(mut untracked) if is_of_slice => {
                let kept = untracked.kept.take();
                let annotated = untracked.write_untracked(encoded, writing)?;
                CloudResult::Annotated(clustered, annotated, kept)
            }
            Written::Untracked(untracked) => CloudResult::Untracked(clustered, untracked),
        })
    }
}

impl PendingItem {
    fn is_ready(&mut self) -> bool {
        match self {
            PendingItem::Cloud(cloud) => cloud.result.is_ready(),
            PendingItem::Chunk(_) | PendingItem::Item(_) | PendingItem::EndOfPart => true,
        }
    }

    /// Clouds and bytes of messages.
    fn size(&self) -> (usize, usize) {
        match self {
            PendingItem::Cloud(cloud) => (1, cloud.encoded.bytes()),
            PendingItem::Item(item) => (0, item.size()),
            PendingItem::EndOfPart => (0, 0),
            PendingItem::Chunk(chunk) => (0, chunk.size()),
        }
    }
}

/// What waits to be written, the next first.
#[derive(Default)]
pub(super) struct Queue {
    items: VecDeque<Pending>,
    clouds: usize,
    /// Bytes of messages, and those beside them.
    bytes: usize,
}

impl Queue {
    pub(super) fn push(&mut self, pending: Pending) {
        let (clouds, bytes) = pending.item.size();
        self.clouds += clouds;
        self.bytes += bytes + BESIDE_MESSAGES;
        self.items.push_back(pending);
    }

    pub(super) fn pop(&mut self) -> Option<Pending> {
        let pending = self.items.pop_front()?;
        let (clouds, bytes) = pending.item.size();
        self.clouds -= clouds;
        self.bytes -= bytes + BESIDE_MESSAGES;
        Some(pending)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Clouds that wait.
    pub(super) fn clouds(&self) -> usize {
        self.clouds
    }

    /// The number of the first item if it is a cloud whose objects are followed.
    pub(super) fn first_followed(&self) -> Option<u64> {
        match &self.items.front()?.item {
            PendingItem::Cloud(cloud) => cloud.followed,
            _ => None,
        }
    }

    /// Whether the first item can be written without waiting; `None` if there is none.
    pub(super) fn is_first_ready(&mut self) -> Option<bool> {
        self.items.front_mut().map(|first| first.item.is_ready())
    }

    /// Whether more waits than keeps so many threads busy.
    pub(super) fn is_full(&self, threads: usize, batch: usize) -> bool {
        self.clouds >= most_clouds(threads, batch)
            || self.bytes > MOST_WAITING.min(threads * WAITING_PER_THREAD)
    }
}
