//! What a filter may skip, and what not.

use std::collections::BTreeMap;
use std::ops::Bound;

use mcap::records::MessageHeader;

use super::fixtures::{CHUNKED, Folder, Shape, recording, shapes};
use crate::plan::Plan;
use crate::workers::Workers;
use crate::{Overview, ReadFilter, Record, RecordingReader, window_around};

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

/// The messages that pass, with their numbers on their topic.
fn messages(mut reader: RecordingReader, filter: &ReadFilter) -> Vec<Numbered> {
    let (mut next, mut found) = (BTreeMap::<String, u64>::new(), Vec::new());
    while let Some(record) = reader.next_record().unwrap() {
        match record {
            Record::Skipped { counts } => {
                for (channel, count) in counts {
                    *next.entry(filter.numbered[&channel].clone()).or_default() += count;
                }
            }
            Record::Message { header, data, .. } => {
                let topic = filter.numbered.get(&header.channel_id);
                let number = topic.map_or(0, |topic| {
                    let next = next.entry(topic.clone()).or_default();
                    *next += 1;
                    *next - 1
                });
                let is_of = filter.others || topic.is_some() && filter.has_number(number, 1);
                if is_of && filter.is_in_window(header.log_time) {
                    found.push((number, header, data.into_owned()));
                }
            }
            Record::Damaged { damage, .. } => panic!("{damage}"),
            _ => {}
        }
    }
    found
}

#[test]
fn nothing_that_is_filter_is_skipped_over() {
    let folder = Folder::new();
    let mut dice = Dice(1);
    let mut skipped = 0;
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
            let filter = ReadFilter {
                from_ns,
                to_ns,
                numbered: some.map(|&(id, topic)| (id, topic.to_owned())).collect(),
                others,
                ..ReadFilter::default()
            };
            let (first, end) = (dice.below(20), dice.below(30));
            let filter = match filter.others {
                true => filter,
                false => {
                    ReadFilter { numbers: (Bound::Included(first), Bound::Excluded(end)), ..filter }
                }
            };
            let some =
                RecordingReader::open_filtered(&overview, &filter, &Workers::none()).unwrap();
            let all = RecordingReader::open(&path).unwrap();
            assert_eq!(messages(some, &filter), messages(all, &filter), "{shape:?} {filter:?}");
            skipped += Plan::new(&overview, &filter).gaps.len();
        }
    }
    assert!(skipped > 300, "{skipped} gaps");
}

#[test]
fn without_a_checksum_over_the_index_everything_is_read() {
    let folder = Folder::new();
    let mut bytes = recording(CHUNKED);
    let crc = bytes.len() - 8 - 4;
    bytes[crc..crc + 4].fill(0);
    let overview = Overview::read(&folder.write("in.mcap", &bytes)).unwrap();
    assert!(overview.from_summary);
    let filter = ReadFilter { to_ns: Some(0), ..ReadFilter::default() };
    assert!(Plan::new(&overview, &filter).gaps.is_empty());
}

/// A long recording of small messages that look like clouds, in chunks of four, every tenth message
/// out of its turn.
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
    let filter = ReadFilter {
        numbers: (Bound::Included(700), Bound::Included(700)),
        others: false,
        numbered,
        ..ReadFilter::default()
    };
    let reader = RecordingReader::open_filtered(&overview, &filter, &Workers::none()).unwrap();
    let before = reader.bytes_read();
    let found = messages(reader, &filter);
    assert_eq!((found.len(), found[0].1.sequence), (1, 700));
    assert!(before < size / 8, "{before} of {size} bytes for the index");

    let (from, to) = window_around(&overview, &[channel], 500_100);
    assert!(from.unwrap() > 450_000 && to.unwrap() < 550_000, "{from:?} {to:?}");
    assert_eq!(window_around(&overview, &[channel + 1], 5), (None, None));
}

#[test]
fn shapes_without_chunks_are_read_through() {
    let folder = Folder::new();
    let shape = Shape { compression: None, is_chunked: false, ..CHUNKED };
    let overview = Overview::read(&folder.write("in.mcap", &recording(shape))).unwrap();
    let filter = ReadFilter { to_ns: Some(0), ..ReadFilter::default() };
    assert!(Plan::new(&overview, &filter).gaps.is_empty());
}
