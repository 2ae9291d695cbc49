//! The one loop over a recording's records.

use std::collections::BTreeMap;
use std::ops::RangeBounds;
use std::sync::Arc;

use super::counter::CloudCounter;
use super::selection::Selection;
use crate::error::Result;
use divmerge_recording::workers::Workers;
use divmerge_recording::{Overview, Position, ReadFilter, Record, RecordingReader, is_past};

/// A walk over the records of a recording that numbers the messages of some channels by topic.
pub(crate) struct Walk {
    reader: RecordingReader,
    filter: ReadFilter,
    topics: BTreeMap<u16, Arc<str>>,
    counter: CloudCounter,
    /// Whether the walk ends behind the last selected message.
    ends_early: bool,
}

/// A record of a walk.
pub(crate) struct WalkStep<'a> {
    /// The record.
    pub(crate) record: Record<'a>,
    /// Of a selected message, its number on its topic, from 0.
    pub(crate) number: Option<u64>,
}

impl Walk {
    /// Opens a recording at the selected messages of some channels. By the recording's index,
    /// chunks without one are not read.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open_filtered`].
    pub(crate) fn open(
        overview: &Overview,
        topics: BTreeMap<u16, Arc<str>>,
        selection: &Selection,
    ) -> Result<Self> {
        let numbered = topics.iter().map(|(&id, topic)| (id, topic.to_string())).collect();
        let filter = ReadFilter {
            from_ns: selection.from_ns,
            to_ns: selection.to_ns,
            numbered,
            numbers: selection.frames,
            others: false,
            skims_large_chunks: true,
            ..ReadFilter::default()
        };
        let mut reader = RecordingReader::open_filtered(overview, &filter, &Workers::none())?;
        reader.unpack_messages();
        Ok(Walk { reader, filter, topics, counter: CloudCounter::default(), ends_early: true })
    }

    /// Opens a recording whose records are all given, selected or not.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open_filtered`].
    pub(crate) fn over_everything(
        overview: &Overview,
        topics: BTreeMap<u16, Arc<str>>,
        selection: &Selection,
    ) -> Result<Self> {
        let filter = ReadFilter {
            from_ns: selection.from_ns,
            to_ns: selection.to_ns,
            numbers: selection.frames,
            ..ReadFilter::default()
        };
        let everything = ReadFilter::default();
        let mut reader = RecordingReader::open_filtered(overview, &everything, &Workers::none())?;
        reader.unpack_messages();
        Ok(Walk { reader, filter, topics, counter: CloudCounter::default(), ends_early: false })
    }

    /// The next record; `None` at the end, or behind the last selected frame of every topic.
    ///
    /// # Errors
    /// Those of [`RecordingReader::next_record`].
    pub(crate) fn next(&mut self) -> Result<Option<WalkStep<'_>>> {
        let Walk { reader, filter, topics, counter, ends_early } = self;
        let is_behind = |topic: &Arc<str>| is_past(&filter.numbers, counter.seen(topic));
        if *ends_early && topics.values().all(is_behind) {
            return Ok(None);
        }
        let Some(record) = reader.next_record()? else { return Ok(None) };
        let mut number = None;
        match &record {
            Record::Message { header, .. } => {
                if let Some(topic) = topics.get(&header.channel_id) {
                    let counted = counter.count(topic);
                    number = Some(counted).filter(|_| {
                        filter.is_in_window(header.log_time) && filter.numbers.contains(&counted)
                    });
                }
            }
            Record::Skipped { counts } => {
                for (channel, &count) in counts {
                    counter.skip(&topics[channel], count);
                }
            }
            _ => {}
        }
        Ok(Some(WalkStep { record, number }))
    }

    /// Bytes of the file up to which it has been walked, and all of them.
    pub(crate) fn progress(&self) -> (u64, u64) {
        (self.reader.offset(), self.reader.file_size())
    }

    /// Bytes that were read of the file so far.
    pub(crate) fn bytes_read(&self) -> u64 {
        self.reader.bytes_read()
    }
}

/// Where a message lies, in words.
pub(crate) fn describe_position(position: Position) -> String {
    format!(
        "message {} of the chunk at byte {}",
        position.index_in_chunk + 1,
        position.chunk_offset
    )
}
