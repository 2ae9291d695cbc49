//! A summary whose checksum is right and whose words are not.

use std::collections::BTreeMap;

use mcap::records::op;

use super::fixtures::{CHUNKED, Folder, Shape, messages, problem_of, read_all, recording};
use crate::fields::{HEAD_LEN, split_head};
use crate::index::ChunkPlace;
use crate::plan::Plan;
use crate::workers::Workers;
use crate::{Overview, ReadFilter, Record, RecordingReader, window_around};

/// Bytes of the footer's record and of the magic behind it.
const END_LEN: usize = HEAD_LEN + 8 + 8 + 4 + 8;

/// The recording with a changed summary: `lie` gets the opcode and content of each record of it and
/// says whether it stays. Its checksum is made right again.
fn lying(recording: &[u8], lie: &mut dyn FnMut(u8, &mut Vec<u8>) -> bool) -> Vec<u8> {
    let end = recording.len() - END_LEN;
    let footer = &recording[end + HEAD_LEN..];
    let start = u64::from_le_bytes(footer[..8].try_into().unwrap()) as usize;
    let (mut bytes, mut next) = (recording[..start].to_vec(), start);
    while next < end {
        let (opcode, length) = split_head(&recording[next..]).unwrap();
        let body = next + HEAD_LEN..next + HEAD_LEN + length as usize;
        next = body.end;
        let mut body = recording[body].to_vec();
        if lie(opcode, &mut body) {
            bytes.push(opcode);
            bytes.extend((body.len() as u64).to_le_bytes());
            bytes.extend(body);
        }
    }
    bytes.extend(&recording[end..end + HEAD_LEN + 8]);
    bytes.extend(0_u64.to_le_bytes());
    let crc = crc32fast::hash(&bytes[start..]);
    bytes.extend(crc.to_le_bytes());
    bytes.extend(mcap::MAGIC);
    bytes
}

/// Stands for the last field.
const SIZE: usize = usize::MAX;

#[test]
fn a_summary_that_is_only_written_anew_is_believed() {
    let folder = Folder::new();
    let path = folder.write("in.mcap", &lying(&recording(CHUNKED), &mut |_, _| true));
    let overview = Overview::read(&path).unwrap();
    assert!(overview.from_summary);
    let filter = ReadFilter { to_ns: Some(0), ..ReadFilter::default() };
    assert!(!Plan::new(&overview, &filter).gaps.is_empty());
}

#[test]
fn no_chunk_is_passed_over_whose_own_header_says_otherwise() {
    let folder = Folder::new();
    for compression in [None, Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)] {
        let whole = recording(Shape { compression, ..CHUNKED });
        let all = messages(&read_all(&folder.write("whole.mcap", &whole)).unwrap()).len();
        // The places of the start and of the end time in the index of a chunk, and of its unpacked
        // size.
        for (place, value) in [(0, 0), (0, 999), (8, 1_100), (8, u64::MAX), (SIZE, 1)] {
            let bytes = lying(&whole, &mut |opcode, body| {
                if opcode == op::CHUNK_INDEX {
                    let place = if place == SIZE { body.len() - 8 } else { place };
                    body[place..place + 8].copy_from_slice(&value.to_le_bytes());
                }
                true
            });
            let mut overview = Overview::read(&folder.write("lie.mcap", &bytes)).unwrap();
            // As if the statistics had told the same lie.
            overview.from_summary = true;
            let (from_ns, to_ns) = (Some(990), Some(1_050));
            let filter = ReadFilter { from_ns, to_ns, ..ReadFilter::default() };
            assert!(Plan::new(&overview, &filter).is_empty(), "{place} {value}");
            assert_eq!(ChunkPlace::all(&overview, &|_| true), None);
            assert_eq!(window_around(&overview, &[3], 1_000), (None, None));
            let reader = RecordingReader::open_filtered(&overview, &filter, &Workers::none());
            let mut reader = reader.unwrap();
            let mut found = 0;
            while let Some(record) = reader.next_record().unwrap() {
                found += usize::from(matches!(record, Record::Message { .. }));
            }
            assert_eq!(found, all);
        }
    }
}

#[test]
fn times_and_counts_that_differ_from_those_of_the_chunks_are_not_believed() {
    let folder = Folder::new();
    let whole = recording(CHUNKED);
    let true_one = Overview::read(&folder.write("whole.mcap", &whole)).unwrap();
    assert!(true_one.from_summary);
    // The places of the start and of the end time in the statistics.
    for place in [26, 34] {
        let bytes = lying(&whole, &mut |opcode, body| {
            if opcode == op::STATISTICS {
                body[place..place + 8].copy_from_slice(&1_020_u64.to_le_bytes());
            }
            true
        });
        let found = Overview::read(&folder.write("lie.mcap", &bytes)).unwrap();
        assert!(!found.from_summary);
        assert_eq!((found.start_ns, found.end_ns), (true_one.start_ns, true_one.end_ns));
    }
}

/// The problem that ends the reading of all of a recording.
fn problem_of_reading(overview: &Overview) -> String {
    let everything = ReadFilter::default();
    let mut reader =
        RecordingReader::open_filtered(overview, &everything, &Workers::none()).unwrap();
    loop {
        match reader.next_record() {
            Ok(Some(_)) => {}
            end => break problem_of(end.map(drop)).1,
        }
    }
}

#[test]
fn a_channel_that_the_summary_leaves_out_is_found_or_an_error() {
    let folder = Folder::new();
    let whole = recording(CHUNKED);
    // The chunks' indexes still tell of it.
    let path = folder.write("lie.mcap", &lying(&whole, &mut without_bare));
    let overview = Overview::read(&path).unwrap();
    assert!(!overview.from_summary && overview.channels.contains_key(&0));
    // Nothing in the summary does.
    let mut without_chunks =
        |opcode: u8, body: &mut Vec<u8>| opcode != op::CHUNK_INDEX && without_bare(opcode, body);
    let path = folder.write("lie.mcap", &lying(&whole, &mut without_chunks));
    let overview = Overview::read(&path).unwrap();
    assert!(overview.from_summary && !overview.channels.contains_key(&0));
    let problem = problem_of_reading(&overview);
    assert!(problem.contains("channel 0 (`/bare`)"), "{problem}");
}

/// Leaves the channel 0, `/bare`, out of definitions and statistics.
fn without_bare(opcode: u8, body: &mut Vec<u8>) -> bool {
    if opcode == op::STATISTICS {
        let (counts, count) = counts_without(&body[46..], 0);
        let messages = u64::from_le_bytes(body[..8].try_into().unwrap()) - count;
        body[..8].copy_from_slice(&messages.to_le_bytes());
        let channels = u32::from_le_bytes(body[10..14].try_into().unwrap()) - 1;
        body[10..14].copy_from_slice(&channels.to_le_bytes());
        body.truncate(42);
        body.extend((counts.len() as u32 * 10).to_le_bytes());
        for (channel, count) in counts {
            body.extend(channel.to_le_bytes());
            body.extend(count.to_le_bytes());
        }
    }
    opcode != op::CHANNEL || body[..2] != [0, 0]
}

/// Messages by channel, as the statistics have them, without one channel, and its messages.
fn counts_without(entries: &[u8], left_out: u16) -> (BTreeMap<u16, u64>, u64) {
    let mut counts: BTreeMap<u16, u64> = entries
        .as_chunks::<10>()
        .0
        .iter()
        .map(|entry| {
            let count = u64::from_le_bytes(entry[2..].try_into().unwrap());
            (u16::from_le_bytes([entry[0], entry[1]]), count)
        })
        .collect();
    let count = counts.remove(&left_out).unwrap_or_default();
    (counts, count)
}

#[test]
fn a_definition_that_differs_from_that_of_the_summary_is_an_error() {
    let folder = Folder::new();
    let whole = recording(CHUNKED);
    // The first letter of the name and of the topic.
    for (kind, letter, word) in [(op::SCHEMA, 6, "schema"), (op::CHANNEL, 8, "channel")] {
        let bytes = lying(&whole, &mut |opcode, body| {
            if opcode == kind {
                body[letter] ^= 1;
            }
            opcode != op::CHUNK_INDEX
        });
        let path = folder.write("lie.mcap", &bytes);
        let overview = Overview::read(&path).unwrap();
        assert!(overview.from_summary);
        let problem = problem_of_reading(&overview);
        assert!(problem.contains(&format!("{word} ")), "{problem}");
        assert!(problem.contains("is defined twice"), "{problem}");
    }
}
