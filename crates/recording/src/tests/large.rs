//! Large records: what is attached comes in pieces, and messages that nobody wants are not held.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::Path;

use mcap::records::{AttachmentHeader, MessageHeader};

use super::fixtures::{Folder, copy, problem_of, read_all};
use crate::workers::Workers;
use crate::{
    Compression, Error, Item, Overview, Part, ReadFilter, Record, RecordingReader, RecordingWriter,
    SourceChunk, WriteOptions,
};

const MIB: usize = 1 << 20;

/// Bytes that no compression makes smaller.
fn noise(length: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let next = |_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 56) as u8
    };
    (0..length).map(next).collect()
}

fn header(channel_id: u16, log_time: u64) -> MessageHeader {
    MessageHeader { channel_id, sequence: log_time as u32, log_time, publish_time: log_time }
}

/// A recording of one chunk: messages of channels 1, 2 and 1, that of channel 2 large.
fn one_chunk(large: &[u8], compression: mcap::Compression) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new()
        .compression(Some(compression))
        .compression_threads(0)
        .chunk_size(None)
        .create(&mut bytes)
        .unwrap();
    for (id, topic) in [(1, "/points"), (2, "/map")] {
        writer.add_channel_with_id(id, 0, topic, "x", &BTreeMap::new()).unwrap();
    }
    for (time, (id, data)) in [(1, &b"first"[..]), (2, large), (1, b"last")].into_iter().enumerate()
    {
        writer.write_to_known_channel(&header(id, time as u64), data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// The chunk of a recording as a reader gives it that wants the messages of channel 1.
fn skimmed(path: &Path) -> crate::Result<SourceChunk> {
    let overview = Overview::read(path).unwrap();
    let numbered = BTreeMap::from([(1, "/points".to_owned())]);
    let filter = ReadFilter { numbered, skims_large_chunks: true, ..ReadFilter::default() };
    let mut reader = RecordingReader::open_filtered(&overview, &filter, &Workers::none()).unwrap();
    loop {
        if let Part::Chunk(chunk) = reader.next_part()?.expect("a chunk") {
            return Ok(chunk);
        }
    }
}

fn records_of(items: Vec<Item>) -> Vec<Record<'static>> {
    let record = |item| match item {
        Item::Message { header, data, position } => {
            Record::Message { header, data: data.to_vec().into(), position }
        }
        Item::Record(record) => record,
    };
    items.into_iter().map(record).collect()
}

#[test]
fn a_large_attachment_comes_in_pieces_and_is_copied() {
    let folder = Folder::new();
    // The last piece ends within the checksum, before it, and behind it.
    for beside in [0, 1, 60, 64, 1000] {
        let attached = noise(3 * MIB - beside);
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = mcap::Writer::new(&mut bytes).unwrap();
        writer
            .attach(&mcap::Attachment {
                log_time: 5,
                create_time: 6,
                name: "map.pcd".into(),
                media_type: "x".into(),
                data: (&attached).into(),
            })
            .unwrap();
        writer.finish().unwrap();
        drop(writer);
        let bytes = bytes.into_inner();
        let input = folder.write("in.mcap", &bytes);

        let (mut whole, mut pieces) = (Vec::new(), 0);
        for record in read_all(&input).unwrap() {
            if let Record::Attachment { size, start, data, .. } = record {
                assert_eq!((size, start), (attached.len() as u64, whole.len() as u64));
                assert!(data.len() <= MIB);
                whole.extend_from_slice(&data);
                pieces += 1;
            }
        }
        assert!(whole == attached && pieces >= 3, "{pieces} pieces");

        let output = folder.path(&format!("{beside}.mcap"));
        copy(&input, &output, Compression::Zstd).unwrap();
        let copied = fs::read(&output).unwrap();
        let summary = mcap::Summary::read(&copied).unwrap().unwrap();
        let index = &summary.attachment_indexes[0];
        let attachment = mcap::read::attachment(&copied, index).unwrap();
        assert!(attachment.data == attached);

        // A byte that is wrong is found, in whichever piece it lies.
        for at in [200, MIB + 5, 2 * MIB + 5] {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            let (_, problem) = problem_of(read_all(&folder.write("bad.mcap", &damaged)));
            assert!(problem.contains("attachment `map.pcd`: CRC mismatch"), "{problem}");
        }
    }
}

#[test]
fn pieces_of_an_attachment_are_written_one_behind_the_other() {
    let folder = Folder::new();
    let path = folder.path("out.mcap");
    let mut writer = RecordingWriter::create(&path, &WriteOptions::default()).unwrap();
    let piece = |start, data: &'static [u8]| Record::Attachment {
        header: AttachmentHeader {
            log_time: 0,
            create_time: 0,
            name: "notes".into(),
            media_type: String::new(),
        },
        size: 6,
        start,
        data: data.into(),
    };
    writer.copy(&piece(0, b"abc")).unwrap();
    let error = writer.write_metadata("between", &BTreeMap::new()).unwrap_err();
    assert!(matches!(error, Error::AttachmentPieces { written: 3, size: 6, .. }), "{error}");
    let error = writer.copy(&piece(4, b"ef")).unwrap_err();
    assert!(matches!(error, Error::AttachmentPieces { written: 3, size: 6, .. }), "{error}");
    assert!(writer.finish().is_err());
    assert!(!path.exists());
}

#[test]
fn what_nobody_wants_of_a_large_chunk_is_not_held() {
    let folder = Folder::new();
    let large = noise(33 * MIB);
    for compression in [mcap::Compression::Zstd, mcap::Compression::Lz4] {
        let input = folder.write("in.mcap", &one_chunk(&large, compression));
        let chunk = skimmed(&input).unwrap();
        let in_file = fs::metadata(&input).unwrap().len() as usize;
        assert!(chunk.size() <= in_file, "{} bytes of {in_file}", chunk.size());
        assert_eq!(chunk.message_count(), 3);
        let times = |record: &Record| match record {
            Record::Message { header, .. } => Some(header.log_time),
            _ => None,
        };
        let kept: Vec<u64> = records_of(chunk.items.clone()).iter().filter_map(times).collect();
        assert_eq!(kept, [0, 2]);

        // Copied as it lies, all of it is there.
        let output = folder.path(&format!("{compression:?}.mcap"));
        let mut writer = RecordingWriter::create(&output, &WriteOptions::default()).unwrap();
        writer.copy_chunk(&chunk).unwrap();
        writer.finish().unwrap();
        let without_header = |path| read_all(path).unwrap().split_off(1);
        assert!(
            super::fixtures::content(without_header(&output))
                == super::fixtures::content(without_header(&input))
        );
        let messages = mcap::MessageStream::new(&fs::read(&output).unwrap()).unwrap().count();
        assert_eq!(messages, 3);

        // Opened, it has what any reader gives.
        assert!(records_of(chunk.into_items()) == without_header(&input));
    }
}

#[test]
fn damage_of_a_large_chunk_is_found_though_it_is_not_held() {
    let folder = Folder::new();
    let bytes = one_chunk(&noise(33 * MIB), mcap::Compression::Zstd);
    let checksum = 8 + 9 + u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize + 9 + 24;
    for at in [checksum, 20 * MIB] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        let path = folder.write("bad.mcap", &damaged);
        assert_eq!(problem_of(skimmed(&path).map(drop)), problem_of(read_all(&path)));
    }
}

#[test]
fn a_large_message_has_a_chunk_of_its_own_and_is_compressed_if_that_pays() {
    let folder = Folder::new();
    for (large, compressed) in [(noise(33 * MIB), ""), (vec![0; 33 * MIB], "zstd")] {
        let write = |name: &str, is_shared: bool| {
            let path = folder.path(name);
            let mut writer = RecordingWriter::create(&path, &WriteOptions::default()).unwrap();
            let id = writer.add_channel("/map", 0, "x", &BTreeMap::new()).unwrap();
            for (time, data) in [&b"first"[..], &large, b"last"].into_iter().enumerate() {
                let header = header(id, time as u64);
                match is_shared {
                    true => writer.write_shared(&header, data.to_vec().into()).unwrap(),
                    false => writer.write_message(&header, data).unwrap(),
                }
            }
            writer.finish().unwrap();
            fs::read(path).unwrap()
        };
        let bytes = write("a.mcap", true);
        assert!(bytes == write("b.mcap", false), "other bytes");
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let compressions = summary.chunk_indexes.iter().map(|chunk| chunk.compression.as_str());
        assert!(compressions.eq(["zstd", compressed, "zstd"]));
        let read = mcap::MessageStream::new(&bytes).unwrap().map(|message| message.unwrap());
        assert!(read.map(|message| message.data).eq([&b"first"[..], &large, b"last"]));
        for name in ["a.mcap", "b.mcap"] {
            fs::remove_file(folder.path(name)).unwrap();
        }
    }
}
