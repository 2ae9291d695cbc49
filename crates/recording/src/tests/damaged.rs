//! Recordings of every shape, cut and damaged, and files that are none.

use super::fixtures::{
    CHUNKED, Folder, Shape, has_warning, messages, problem_of, read_all, recording, shapes,
};
use crate::{Error, Overview, Record, RecordingReader};

#[test]
fn a_file_cut_anywhere_gives_a_prefix_of_its_messages() {
    let folder = Folder::new();
    for shape in shapes().into_iter().filter(|shape| shape.has_data_crc) {
        let whole = recording(shape);
        let original = messages(&read_all(&folder.write("in.mcap", &whole)).unwrap());
        let mut most = 0;
        for length in (1..whole.len()).step_by(97).chain(whole.len() - 40..whole.len()) {
            let path = folder.write("cut.mcap", &whole[..length]);
            if length < mcap::MAGIC.len() {
                assert!(problem_of(read_all(&path)).1.contains("cut off"));
                continue;
            }
            let records = read_all(&path).unwrap();
            assert!(matches!(records.last(), Some(Record::Truncated { .. })), "{shape:?} {length}");
            let found = messages(&records);
            assert!(found == original[..found.len()], "{shape:?} {length}");
            assert!(found.len() >= most, "{shape:?} {length}");
            most = found.len();
            let overview = Overview::read(&path).unwrap();
            assert_eq!(overview.message_count, found.len() as u64);
            assert!(!overview.is_complete && !overview.problems.is_empty());
        }
        assert_eq!(most, original.len());
    }
}

#[test]
fn a_tail_of_zeros_is_taken_for_a_cut() {
    let folder = Folder::new();
    for shape in shapes().into_iter().filter(|shape| shape.has_data_crc) {
        let whole = recording(shape);
        for length in (100..whole.len()).step_by(97) {
            let cut = read_all(&folder.write("cut.mcap", &whole[..length])).unwrap();
            // Zeros at the end of a message outside of chunks count as reserved.
            let fewest = messages(&cut).len().saturating_sub(1);
            let mut bytes = whole[..length].to_vec();
            bytes.resize(length + 5000, 0);
            let path = folder.write("zeros.mcap", &bytes);
            let records = read_all(&path).unwrap();
            let found = messages(&records);
            assert!(found.len() >= fewest, "{shape:?} {length}");
            let all = messages(&cut);
            assert!(found.iter().eq(&all[..found.len()]), "{shape:?} {length}");
            let Some(Record::Truncated { damage, .. }) = records.last() else {
                panic!("{shape:?} {length}: {:?}", records.last())
            };
            assert!(damage.to_string().contains("zero bytes follow"), "{damage}");
            assert!(!Overview::read(&path).unwrap().is_complete);
        }
        // Behind the end they take nothing away.
        let bytes = [whole.as_slice(), &[0; 5000]].concat();
        let path = folder.write("zeros.mcap", &bytes);
        let records = read_all(&path).unwrap();
        assert_eq!(messages(&records), messages(&read_all(&folder.write("in", &whole)).unwrap()));
        assert!(has_warning(&records) && Overview::read(&path).unwrap().is_complete);
    }
    let path = folder.write("none.mcap", &[0; 3000]);
    assert!(problem_of(read_all(&path)).1.contains("nothing but 3000 zero bytes"));
}

#[test]
fn a_second_recording_behind_the_first_is_said() {
    let folder = Folder::new();
    let whole = recording(CHUNKED);
    for second in [whole.clone(), whole[..500].to_vec()] {
        let path = folder.write("two.mcap", &[whole.as_slice(), &second].concat());
        let records = read_all(&path).unwrap();
        assert_eq!(messages(&records).len(), 40);
        let Some(Record::Truncated { offset, damage }) = records.last() else { panic!() };
        assert_eq!(*offset, whole.len() as u64);
        let what_to_do = format!("tail -c +{} FILE", whole.len() + 1);
        assert!(damage.to_string().contains(&what_to_do), "{damage}");
        let overview = Overview::read(&path).unwrap();
        assert!(!overview.is_complete && overview.message_count == 40);
    }
}

#[test]
fn messages_are_saved_from_a_chunk_that_is_cut() {
    let folder = Folder::new();
    let shape = Shape { compression: None, ..CHUNKED };
    let whole = recording(shape);
    let records = read_all(&folder.write("in.mcap", &whole)).unwrap();
    let last = 38;
    let Record::Message { position, .. } = &messages(&records)[last] else { unreachable!() };
    // In the middle of the last chunk of several messages.
    let path = folder.write("cut.mcap", &whole[..position.chunk_offset as usize + 600]);
    let saved = messages(&read_all(&path).unwrap());
    let first_of_chunk = last - position.index_in_chunk as usize;
    assert!(saved.len() > first_of_chunk && saved.len() <= last, "{}", saved.len());
}

/// Bytes that no checksum covers may change without notice where there is no data section checksum:
/// the heads and fields of records outside chunks (the header's profile, message indexes, metadata,
/// times in chunk headers), and whole messages outside chunks. So unchunked recordings are damaged
/// here only where they have that checksum; the messages of all others are always covered.
#[test]
fn no_flipped_byte_passes_unnoticed() {
    let folder = Folder::new();
    let is_covered = |shape: &Shape| shape.is_chunked || shape.has_data_crc;
    for (i, shape) in shapes().into_iter().filter(is_covered).enumerate() {
        let whole = recording(shape);
        let original = messages(&read_all(&folder.write("in.mcap", &whole)).unwrap());
        for offset in (i * 5..whole.len()).step_by(61).chain(0..40) {
            let mut bytes = whole.clone();
            bytes[offset] ^= [0xff, 0x01, 0x80][offset % 3];
            let path = folder.write("flipped.mcap", &bytes);
            if let Ok(records) = read_all(&path) {
                let is_same = messages(&records) == original;
                assert!(is_same || has_warning(&records), "{shape:?} {offset}");
            }
            let _ = Overview::read(&path);
        }
    }
}

#[test]
fn a_damaged_chunk_is_named_with_its_place_and_topics() {
    let folder = Folder::new();
    let shape = Shape { compression: None, ..CHUNKED };
    let mut bytes = recording(shape);
    let records = read_all(&folder.write("in.mcap", &bytes)).unwrap();
    let Record::Message { position, .. } = &messages(&records)[0] else { unreachable!() };
    bytes[position.chunk_offset as usize + 300] ^= 1;
    let (offset, problem) = problem_of(read_all(&folder.write("in.mcap", &bytes)));
    assert_eq!(offset, position.chunk_offset);
    assert!(problem.starts_with("chunk CRC mismatch: stored "), "{problem}");
    assert!(problem.ends_with("; the chunk holds messages of /bare, /twice"), "{problem}");
}

#[test]
fn damage_behind_the_data_costs_no_message() {
    let folder = Folder::new();
    let whole = recording(CHUNKED);
    let original = messages(&read_all(&folder.write("in.mcap", &whole)).unwrap());
    // In the topic of a channel: /bare.
    let at = whole.windows(5).rposition(|window| window == b"/bare").unwrap();
    let mut bytes = whole.clone();
    bytes[at + 1] = b'f';
    let path = folder.write("in.mcap", &bytes);
    let records = read_all(&path).unwrap();
    assert_eq!(messages(&records), original);
    assert!(matches!(records.last(), Some(Record::Damaged { .. })));
    let overview = Overview::read(&path).unwrap();
    assert!(!overview.from_summary);
    assert_eq!(overview.problems.len(), 1);
    assert_eq!(overview.channels[&0].topic, "/bare");
}

#[test]
fn a_length_that_lies_allocates_nothing() {
    let folder = Folder::new();
    for shape in shapes() {
        let whole = recording(shape);
        let header_len = u64::from_le_bytes(whole[9..17].try_into().unwrap()) as usize;
        // The first record behind the header; and, in an uncompressed chunk, the first inside it.
        let first = 8 + 9 + header_len;
        let inside = shape.is_chunked.then_some(first + 9 + 40);
        for at in [first].into_iter().chain(inside) {
            for claim in [u64::MAX, u64::MAX - 8, 1 << 62, 1 << 40, 3 << 30] {
                let mut bytes = whole.clone();
                bytes[at + 1..at + 9].copy_from_slice(&claim.to_le_bytes());
                let path = folder.write("lie.mcap", &bytes);
                assert!(read_all(&path).is_err(), "{shape:?} {at} {claim}");
                // Cut as well, so that the reader tries to save what is there.
                let path = folder.write("lie.mcap", &bytes[..bytes.len() - 9]);
                let _ = read_all(&path);
            }
        }
    }
}

#[test]
fn other_files_are_named() {
    let folder = Folder::new();
    let cases: [(&[u8], &str); 8] = [
        (b"", "empty"),
        (b"#ROSBAG V2.0\n", "ROS 1 bag"),
        (b"SQLite format 3\0", ".db3"),
        (b"\x1f\x8b\x08\0", "gzip"),
        (b"\x28\xb5\x2f\xfd\0", "zstd"),
        (b"\x89MCAP", "cut off"),
        (b"\x89MCAP1\r\n more", "version '1'"),
        (b"hello, world", "68 65 6c 6c 6f"),
    ];
    for (bytes, expected) in cases {
        let path = folder.write("other", bytes);
        for (offset, problem) in
            [problem_of(RecordingReader::open(&path)), problem_of(Overview::read(&path))]
        {
            assert_eq!(offset, 0);
            assert!(problem.contains(expected), "{problem}");
        }
    }
    let (_, problem) = problem_of(RecordingReader::open(folder.root()));
    assert!(problem.contains("folder"), "{problem}");
    let missing = RecordingReader::open(&folder.path("missing.mcap"));
    assert!(matches!(missing, Err(Error::Io { .. })));
}
