//! What is wanted of a recording, and which of its chunks need not be read for that.

use std::collections::{BTreeMap, VecDeque};
use std::ops::{Bound, Range};

use super::index::{Index, IndexedChunk};
use super::overview::Overview;
use super::writer::Compression;

/// Numbers of messages on their topic, from 0 in the order of the file.
pub type FrameRange = (Bound<u64>, Bound<u64>);

/// What is wanted of a recording. A reader gives at least this, and by the file's index passes over chunks that hold
/// nothing of it ([`super::RecordingReader::open_wanted`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Earliest log time in nanoseconds.
    pub from_ns: Option<u64>,
    /// Log time in nanoseconds from which on nothing is wanted.
    pub to_ns: Option<u64>,
    /// Channels whose messages are numbered, with their topics, over which the numbers run. Of chunks that are passed
    /// over their messages are counted.
    pub numbered: BTreeMap<u16, String>,
    /// Numbers that are wanted of each of those topics.
    pub frames: FrameRange,
    /// Bytes of the file in which chunks begin that are wanted.
    pub bytes: Range<u64>,
    /// Whether messages of other channels are wanted, too.
    pub others: bool,
    /// Chunks of this compression without a numbered message may be given as they lie, neither opened nor checked, by
    /// [`super::RecordingReader::next_part`].
    pub closed: Option<Compression>,
}

/// Every byte of a file.
const ALL_BYTES: Range<u64> = 0..u64::MAX;

impl Default for Wanted {
    /// Everything.
    fn default() -> Self {
        Wanted {
            from_ns: None,
            to_ns: None,
            numbered: BTreeMap::new(),
            frames: (Bound::Unbounded, Bound::Unbounded),
            bytes: ALL_BYTES,
            others: true,
            closed: None,
        }
    }
}

impl Wanted {
    /// Whether a log time lies in the window.
    pub fn is_in_window(&self, log_time: u64) -> bool {
        self.from_ns.is_none_or(|from| log_time >= from)
            && self.to_ns.is_none_or(|to| log_time < to)
    }

    /// Whether a chunk begins where it is wanted, and could hold log times of the window.
    fn overlaps(&self, chunk: &IndexedChunk) -> bool {
        let (first, last) = chunk.times;
        self.bytes.contains(&chunk.start)
            && self.from_ns.is_none_or(|from| last >= from)
            && self.to_ns.is_none_or(|to| first < to)
    }

    /// Whether everything is wanted, and opened.
    fn is_everything(&self) -> bool {
        self.others
            && self.from_ns.is_none()
            && self.to_ns.is_none()
            && self.bytes == ALL_BYTES
            && self.closed.is_none()
    }

    /// Whether a chunk need not be opened.
    fn may_stay_closed(&self, chunk: &IndexedChunk) -> bool {
        self.others
            && self.closed.is_some_and(|closed| closed.name() == chunk.compression)
            && chunk.has_message_indexes()
            && chunk.counts.is_empty()
            && self.is_in_window(chunk.times.0)
            && self.is_in_window(chunk.times.1)
    }

    /// Whether one of `count` numbers from `first` on is wanted.
    fn has_frame(&self, first: u64, count: u64) -> bool {
        let end = first.saturating_add(count);
        let starts_below = match self.frames.0 {
            Bound::Included(from) => end > from,
            Bound::Excluded(from) => end > from.saturating_add(1),
            Bound::Unbounded => true,
        };
        count > 0 && starts_below && !is_behind(&self.frames, first)
    }
}

/// Whether `number` and all that follow are past the last that is wanted.
pub(crate) fn is_behind(frames: &FrameRange, number: u64) -> bool {
    match frames.1 {
        Bound::Excluded(end) => number >= end,
        Bound::Included(last) => number > last,
        Bound::Unbounded => false,
    }
}

/// A stretch of the file that is passed over: whole chunks with their message indexes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Gap {
    pub(super) start: u64,
    pub(super) end: u64,
    /// Messages in it of the channels that are numbered.
    pub(super) counts: BTreeMap<u16, u64>,
}

/// A chunk that is not opened: where its message indexes end, and of how many channels they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Closed {
    pub(super) end: u64,
    pub(super) channels: usize,
}

/// Which stretches of the file are passed over, and which chunks not opened, by where they begin.
#[derive(Debug, Default)]
pub(super) struct Plan {
    pub(super) gaps: VecDeque<Gap>,
    pub(super) closed: BTreeMap<u64, Closed>,
    /// Bytes of the file that were read for this.
    pub(super) bytes_read: u64,
}

impl Plan {
    /// What need not be read of a recording; nothing is passed over where the index is missing, unchecked or odd.
    pub(super) fn new(overview: &Overview, wanted: &Wanted) -> Self {
        let nothing = Plan::default;
        if !overview.from_summary || wanted.is_everything() {
            return nothing();
        }
        let numbered = |channel: u16| wanted.numbered.contains_key(&channel);
        let Some(index) = Index::read(&overview.path, overview.file_size, &numbered) else {
            return nothing();
        };
        let gaps = Planner { wanted, topics: BTreeMap::new() }.gaps(&index.chunks);
        let closed = index.chunks.iter().filter(|chunk| wanted.may_stay_closed(chunk));
        let closed =
            closed.map(|chunk| (chunk.start, Closed { end: chunk.end, channels: chunk.channels }));
        Plan { gaps, closed: closed.collect(), bytes_read: index.bytes_read }
    }

    /// Whether every record is read and opened.
    pub(super) fn is_empty(&self) -> bool {
        self.gaps.is_empty() && self.closed.is_empty()
    }
}

struct Planner<'a> {
    wanted: &'a Wanted,
    /// Messages of each topic so far.
    topics: BTreeMap<&'a str, u64>,
}

impl Planner<'_> {
    fn gaps(&mut self, chunks: &[IndexedChunk]) -> VecDeque<Gap> {
        let mut gaps: VecDeque<Gap> = VecDeque::new();
        // Behind the last chunk in the window there is nothing left to be numbered.
        let last = chunks.iter().rposition(|chunk| self.wanted.overlaps(chunk));
        for (number, chunk) in chunks.iter().enumerate() {
            let is_past = last.is_none_or(|last| number > last) || self.is_past_all_frames();
            let counts: BTreeMap<u16, u64> =
                if is_past { BTreeMap::new() } else { chunk.counts.iter().copied().collect() };
            let is_needed = self.is_needed(chunk, &counts, is_past);
            self.count(&counts);
            if is_needed {
                continue;
            }
            match gaps.back_mut().filter(|gap| gap.end == chunk.start) {
                Some(gap) => {
                    gap.end = chunk.end;
                    for (channel, count) in counts {
                        *gap.counts.entry(channel).or_default() += count;
                    }
                }
                None => gaps.push_back(Gap { start: chunk.start, end: chunk.end, counts }),
            }
        }
        gaps
    }

    fn is_past_all_frames(&self) -> bool {
        let wanted = self.wanted;
        let topics = wanted.numbered.values();
        !wanted.others
            && !matches!(wanted.frames.1, Bound::Unbounded)
            && topics.map(String::as_str).all(|topic| {
                is_behind(&wanted.frames, self.topics.get(topic).copied().unwrap_or(0))
            })
    }

    fn is_needed(&self, chunk: &IndexedChunk, counts: &BTreeMap<u16, u64>, is_past: bool) -> bool {
        let wanted = self.wanted;
        // Without indexes of messages it may hold anything that has no time.
        if !chunk.has_message_indexes() {
            return true;
        }
        if is_past || !wanted.overlaps(chunk) {
            return false;
        }
        let mut of_topic: BTreeMap<&str, u64> = BTreeMap::new();
        for (channel, count) in counts {
            *of_topic.entry(&wanted.numbered[channel]).or_default() += count;
        }
        let first = |topic: &str| self.topics.get(topic).copied().unwrap_or(0);
        wanted.others || of_topic.iter().any(|(topic, &n)| wanted.has_frame(first(topic), n))
    }

    fn count(&mut self, counts: &BTreeMap<u16, u64>) {
        for (channel, count) in counts {
            *self.topics.entry(&self.wanted.numbered[channel]).or_default() += count;
        }
    }
}

/// Log times, from and to (left out), between which the message of some channels lies that is nearest to a log time,
/// as far as the index tells; all times where it does not.
pub(crate) fn window_around(
    overview: &Overview,
    channels: &[u16],
    log_time: u64,
) -> (Option<u64>, Option<u64>) {
    let is_of = |channel: u16| channels.contains(&channel);
    let index = Index::read(&overview.path, overview.file_size, &is_of);
    let Some(index) = index.filter(|_| overview.from_summary) else {
        return (None, None);
    };
    // Each chunk with such a message has one at most so far away. Chunks that tell of no messages, and messages
    // outside of chunks, are read whatever the window.
    let with_one = index.chunks.iter().filter(|chunk| !chunk.counts.is_empty());
    let reach = with_one.map(|chunk| {
        let (first, last) = chunk.times;
        first.abs_diff(log_time).max(last.abs_diff(log_time))
    });
    match reach.min() {
        None => (None, None),
        Some(reach) => (
            log_time.checked_sub(reach),
            log_time.checked_add(reach).and_then(|t| t.checked_add(1)),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CHUNKED, Folder, Shape, recording, shapes};
    use super::super::{Record, RecordingReader};
    use super::*;
    use crate::io::frames::{Which, cloud_message_at};
    use crate::workers::Workers;
    use mcap::records::MessageHeader;

    /// Numbers that look random (SplitMix64).
    struct Dice(u64);

    impl Dice {
        fn below(&mut self, end: u64) -> u64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (mixed ^ (mixed >> 31)) % end
        }
    }

    type Numbered = (u64, MessageHeader, Vec<u8>);

    /// The wanted messages with their numbers on their topic.
    fn messages(mut reader: RecordingReader, wanted: &Wanted) -> Vec<Numbered> {
        let (mut next, mut found) = (BTreeMap::<String, u64>::new(), Vec::new());
        while let Some(record) = reader.next_record().unwrap() {
            match record {
                Record::Passed { counts } => {
                    for (channel, count) in counts {
                        *next.entry(wanted.numbered[&channel].clone()).or_default() += count;
                    }
                }
                Record::Message { header, data, .. } => {
                    let topic = wanted.numbered.get(&header.channel_id);
                    let number = topic.map_or(0, |topic| {
                        let next = next.entry(topic.clone()).or_default();
                        *next += 1;
                        *next - 1
                    });
                    let is_of = wanted.others || topic.is_some() && wanted.has_frame(number, 1);
                    if is_of && wanted.is_in_window(header.log_time) {
                        found.push((number, header, data.into_owned()));
                    }
                }
                Record::Damaged { problem, .. } => panic!("{problem}"),
                _ => {}
            }
        }
        found
    }

    #[test]
    fn nothing_that_is_wanted_is_passed_over() {
        let folder = Folder::new();
        let mut dice = Dice(1);
        let mut passed = 0;
        for shape in shapes() {
            let path = folder.write("in.mcap", &recording(shape));
            let overview = Overview::read(&path).unwrap();
            for _ in 0..100 {
                // Log times are 1000 to 1039, out of order, in chunks that overlap.
                let mut time = || (dice.below(5) > 0).then(|| 995 + dice.below(50));
                let (from_ns, to_ns) = (time(), time());
                let numbered = [(3, "/twice"), (4, "/twice"), (0, "/bare")];
                let others = dice.below(2) == 0;
                let some = numbered.iter().filter(|_| dice.below(5) > 1);
                let wanted = Wanted {
                    from_ns,
                    to_ns,
                    numbered: some.map(|&(id, topic)| (id, topic.to_owned())).collect(),
                    others,
                    ..Wanted::default()
                };
                let (first, end) = (dice.below(20), dice.below(30));
                let wanted = match wanted.others {
                    true => wanted,
                    false => {
                        Wanted { frames: (Bound::Included(first), Bound::Excluded(end)), ..wanted }
                    }
                };
                let some =
                    RecordingReader::open_wanted(&overview, &wanted, &Workers::none()).unwrap();
                let all = RecordingReader::open(&path).unwrap();
                assert_eq!(messages(some, &wanted), messages(all, &wanted), "{shape:?} {wanted:?}");
                passed += Plan::new(&overview, &wanted).gaps.len();
            }
        }
        assert!(passed > 300, "{passed} gaps");
    }

    #[test]
    fn without_a_checksum_over_the_index_everything_is_read() {
        let folder = Folder::new();
        let mut bytes = recording(CHUNKED);
        let crc = bytes.len() - 8 - 4;
        bytes[crc..crc + 4].fill(0);
        let overview = Overview::read(&folder.write("in.mcap", &bytes)).unwrap();
        assert!(overview.from_summary);
        let wanted = Wanted { to_ns: Some(0), ..Wanted::default() };
        assert!(Plan::new(&overview, &wanted).gaps.is_empty());
    }

    /// A long recording of small messages that look like clouds, in chunks of four, every tenth message out of its turn.
    fn long() -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut writer =
            mcap::WriteOptions::new().chunk_size(Some(4 << 10)).create(&mut bytes).unwrap();
        let schema = writer.add_schema("sensor_msgs/msg/PointCloud2", "ros2msg", b"").unwrap();
        let channel_id = writer.add_channel(schema, "/points", "cdr", &BTreeMap::new()).unwrap();
        let mut dice = Dice(2);
        for i in 0..1000_u64 {
            let data: Vec<u8> = (0..1000).map(|_| dice.below(256) as u8).collect();
            let log_time = 1000 * if i % 10 == 9 { i - 7 } else { i };
            let (sequence, publish_time) = (i as u32, i);
            let header = MessageHeader { channel_id, sequence, log_time, publish_time };
            writer.write_to_known_channel(&header, &data).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        bytes.into_inner()
    }

    #[test]
    fn a_message_by_number_or_time_costs_its_chunk() {
        let folder = Folder::new();
        let path = folder.write("long.mcap", &long());
        let size = std::fs::metadata(&path).unwrap().len();
        let overview = Overview::read(&path).unwrap();
        let channel = *overview.channels.first_key_value().unwrap().0;
        let numbered = BTreeMap::from([(channel, "/points".to_owned())]);
        let wanted = Wanted {
            frames: (Bound::Included(700), Bound::Included(700)),
            others: false,
            numbered,
            ..Wanted::default()
        };
        let reader = RecordingReader::open_wanted(&overview, &wanted, &Workers::none()).unwrap();
        let before = reader.bytes_read();
        let found = messages(reader, &wanted);
        assert_eq!((found.len(), found[0].1.sequence), (1, 700));
        assert!(before < size / 8, "{before} of {size} bytes for the index");

        for sequence in [0, 3, 402, 700, 999] {
            let frame = cloud_message_at(&path, None, Which::Frame(sequence)).unwrap();
            assert_eq!(frame.number, sequence);
            let near = cloud_message_at(&path, None, Which::Time(frame.log_time + 100)).unwrap();
            // Of two at one time the earlier.
            assert_eq!(near.log_time, frame.log_time);
            assert!(near.number <= frame.number);
        }
        let (from, to) = window_around(&overview, &[channel], 500_100);
        assert!(from.unwrap() > 450_000 && to.unwrap() < 550_000, "{from:?} {to:?}");
        assert_eq!(window_around(&overview, &[channel + 1], 5), (None, None));
    }

    #[test]
    fn shapes_without_chunks_are_read_through() {
        let folder = Folder::new();
        let shape = Shape { compression: None, is_chunked: false, ..CHUNKED };
        let overview = Overview::read(&folder.write("in.mcap", &recording(shape))).unwrap();
        let wanted = Wanted { to_ns: Some(0), ..Wanted::default() };
        assert!(Plan::new(&overview, &wanted).gaps.is_empty());
    }
}
