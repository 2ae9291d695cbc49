//! Recordings of every shape that the format allows, made at random and annotated: by the format's
//! own reader, the input's records are a subsequence of the output's, byte for byte, and the
//! output's index says what is in it.

mod recorder;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::annotate::{AnnotateOptions, RunEvent, annotate};
use divmerge::datasets::drive::cloud_message;
use divmerge::messages::definitions::POINT_CLOUD2;
use divmerge::recording::Compression;
use divmerge::simulate::{Drive, Scene, Sensor};
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use recorder::{Raw, Recorder, attachment, channel, message, metadata, schema};

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes[at..at + 2].try_into().expect("two bytes"))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}

/// What a file has besides its records.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Share of the records that stand in chunks.
    chunked: f64,
    has_message_indexes: bool,
    has_crcs: bool,
    has_summary: bool,
    has_statistics: bool,
    has_chunk_indexes: bool,
    repeats_definitions: bool,
    /// Compression of all chunks; else each has its own.
    compression: Option<&'static str>,
    seed: u64,
}

impl Shape {
    fn new(seed: u64) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let compressions = [Some(""), Some("lz4"), Some("zstd"), None];
        Shape {
            chunked: [0.0, 0.9, 1.0, 1.0][random.random_range(0..4)],
            has_message_indexes: random.random_bool(0.7),
            has_crcs: random.random_bool(0.7),
            has_summary: random.random_bool(0.7),
            has_statistics: random.random_bool(0.8),
            has_chunk_indexes: random.random_bool(0.8),
            repeats_definitions: random.random_bool(0.5),
            compression: compressions[random.random_range(0..4)],
            seed,
        }
    }
}

/// Small clouds.
fn clouds() -> Vec<Vec<u8>> {
    let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
    let cloud = |number| {
        let mut frame = drive.frame(number);
        let keep = 400;
        let fewer = frame.cloud.with(|cloud| {
            (cloud.height, cloud.width) = (1, keep);
            for column in [&mut cloud.x, &mut cloud.y, &mut cloud.z] {
                column.truncate(keep);
            }
            for column in [&mut cloud.ring, &mut cloud.class] {
                column.as_mut().expect("a column").truncate(keep);
            }
        });
        frame.cloud = fewer.expect("as many of each");
        frame.intensity.truncate(keep);
        frame.time_offset_ns.truncate(keep);
        frame.true_instance.truncate(keep);
        let mut message = Vec::new();
        cloud_message(&frame, &mut message).expect("a message");
        message
    };
    (0..3).map(cloud).collect()
}

/// A recording of a shape: two cloud topics, one of them of two channels, a topic without a schema,
/// one without messages, two schemas that are equal; log times out of order.
fn recording(shape: Shape, clouds: &[Vec<u8>]) -> Vec<u8> {
    let mut recorder = Recorder::new(shape);
    let mut random = Pcg64Mcg::seed_from_u64(shape.seed ^ 0x77);
    for id in [3, 900] {
        recorder.define(schema(id, POINT_CLOUD2.name, &POINT_CLOUD2.data));
    }
    recorder.define(schema(4, "std_msgs/msg/String", b"string data"));
    let channels = [
        channel(7, 3, "/front", "cdr"),
        channel(9, 900, "/rear", "cdr"),
        channel(600, 3, "/front", "cdr"),
        channel(0, 0, "/bare", "json"),
        channel(65_000, 4, "/silent", "cdr"),
        channel(11, 4, "/words", "cdr"),
    ];
    channels.iter().for_each(|channel| recorder.define(channel.clone()));
    let mut times = [u64::MAX, 0];
    for i in 0..random.random_range(20..60_u32) {
        let id = [7, 9, 600, 0, 0, 11, 11, 11][random.random_range(0..8)];
        let log_time = 1_000_000 + u64::from(i) * 100 - random.random_range(0..500);
        let noise: Vec<u8> =
            (0..random.random_range(0..300)).map(|_| random.random_range(0..=255)).collect();
        let data = if [7, 9, 600].contains(&id) { &clouds[i as usize % 3] } else { &noise };
        times = [times[0].min(log_time), times[1].max(log_time)];
        recorder.put(message(id, i, [log_time, log_time / 2], data));
        match random.random_range(0..30) {
            0 => recorder.bare(&attachment("notes.txt", &noise, shape.has_crcs)),
            1 => recorder.bare(&metadata("rosbag2")),
            2 => recorder.put((0x80, noise.clone())),
            3 => recorder.bare(&(0xff, noise.clone())),
            4 if shape.repeats_definitions => {
                for definition in recorder.definitions.clone() {
                    recorder.put(definition);
                }
            }
            5..12 => recorder.close_chunk(),
            _ => {}
        }
    }
    recorder.finish(times)
}

/// What a file holds by the format's own reader, but for its bookkeeping; repeated definitions
/// once.
fn content(file: &[u8]) -> Vec<Raw> {
    let (mut reader, mut rest) = (LinearReader::new(), file);
    let (mut records, mut defined) = (Vec::new(), BTreeSet::new());
    while let Some(event) = reader.next_event() {
        match event.expect("a recording that can be read") {
            LinearReadEvent::ReadRequest(wanted) => {
                let (piece, behind) = rest.split_at(wanted.min(rest.len()));
                reader.insert(piece.len()).copy_from_slice(piece);
                reader.notify_read(piece.len());
                rest = behind;
            }
            LinearReadEvent::Record { opcode, data } => {
                let record = (opcode, data.to_vec());
                let is_kept = match opcode {
                    op::SCHEMA | op::CHANNEL => defined.insert(record.clone()),
                    op::MESSAGE | op::ATTACHMENT | op::METADATA | 0x80.. => true,
                    _ => false,
                };
                records.extend(is_kept.then_some(record));
            }
        }
    }
    records
}

/// Attachments are given a checksum where they have none.
fn without_checksum((opcode, mut content): Raw) -> Raw {
    if opcode == op::ATTACHMENT {
        content.truncate(content.len() - 4);
    }
    (opcode, content)
}

fn assert_subsequence(input: &[u8], output: &[u8], is_ordered: bool, what: &str) {
    let [before, after] = [input, output]
        .map(|file| content(file).into_iter().map(without_checksum).collect::<Vec<Raw>>());
    let is_definition = |record: &&Raw| matches!(record.0, op::SCHEMA | op::CHANNEL);
    let mut rest = after.iter();
    for record in before.iter().filter(|record| is_ordered || !is_definition(record)) {
        let is_there = rest.any(|other| other == record);
        assert!(is_there, "{what}: a record {} is missing or out of order", record.0);
    }
    for record in before.iter().filter(is_definition) {
        assert!(after.contains(record), "{what}: a definition is missing");
    }
}

/// The summary says what is in the file.
fn assert_truthful(file: &[u8], what: &str) {
    let summary = mcap::Summary::read(file).expect("a summary").expect("a summary");
    let statistics = summary.stats.clone().expect("statistics");
    let records = content(file);
    let of = |opcode: u8| records.iter().filter(move |record| record.0 == opcode);
    let mut counts = BTreeMap::<u16, u64>::new();
    of(op::MESSAGE).for_each(|record| *counts.entry(u16_at(&record.1, 0)).or_default() += 1);
    assert_eq!(statistics.channel_message_counts, counts, "{what}");
    assert_eq!(statistics.message_count, counts.values().sum::<u64>(), "{what}");
    let times = of(op::MESSAGE).map(|record| u64_at(&record.1, 6));
    assert_eq!(statistics.message_start_time, times.clone().min().unwrap_or(0), "{what}");
    assert_eq!(statistics.message_end_time, times.max().unwrap_or(0), "{what}");
    assert_eq!(statistics.schema_count as usize, of(op::SCHEMA).count(), "{what}");
    assert_eq!(statistics.channel_count as usize, of(op::CHANNEL).count(), "{what}");
    assert_eq!(statistics.chunk_count as usize, summary.chunk_indexes.len(), "{what}");
    let mut indexed = 0;
    // The format's reader takes a chunk without message indexes for an error; one without messages
    // has none.
    for chunk in summary.chunk_indexes.iter().filter(|c| !c.message_index_offsets.is_empty()) {
        let indexes = summary.read_message_indexes(file, chunk).expect("indexes");
        for entry in indexes.values().flatten() {
            let message = summary.seek_message(file, chunk, entry).expect("a message");
            assert_eq!(message.log_time, entry.log_time, "{what}");
            assert!(
                (chunk.message_start_time..=chunk.message_end_time).contains(&message.log_time)
            );
            indexed += 1;
        }
    }
    assert_eq!(indexed, statistics.message_count, "{what}");
    assert_eq!(statistics.attachment_count as usize, of(op::ATTACHMENT).count(), "{what}");
    for index in &summary.attachment_indexes {
        let found = mcap::read::attachment(file, index).expect("an attachment");
        assert_eq!(found.name, index.name, "{what}");
    }
    assert_eq!(statistics.metadata_count as usize, of(op::METADATA).count(), "{what}");
    for index in &summary.metadata_indexes {
        assert_eq!(mcap::read::metadata(file, index).expect("metadata").name, index.name);
    }
}

pub fn run(input: &Path, options: &AnnotateOptions) -> Vec<u8> {
    let output = input.with_extension("out.mcap");
    annotate(input, &output, options, &mut |_: RunEvent| ControlFlow::Continue(()))
        .expect("annotated");
    std::fs::read(output).expect("the output")
}

pub fn each_shape(check: impl Fn(Shape, &Path, &[u8])) {
    let folder = tempfile::tempdir().expect("a folder");
    let path: PathBuf = folder.path().join("in.mcap");
    let clouds = clouds();
    for seed in 0..60 {
        let shape = Shape::new(seed);
        let bytes = recording(shape, &clouds);
        std::fs::write(&path, &bytes).expect("written");
        check(shape, &path, &bytes);
        assert!(std::fs::read(&path).expect("the input") == bytes, "the input was touched");
    }
}

#[test]
fn the_input_is_a_subsequence_of_the_output() {
    each_shape(|shape, path, bytes| {
        let compressions =
            [None, Some(Compression::None), Some(Compression::Lz4), Some(Compression::Zstd)];
        for (compression, unchecked) in
            compressions.into_iter().flat_map(|c| [(c, false), (c, true)])
        {
            let what = format!("{shape:?} {compression:?} {unchecked}");
            let options = |threads| AnnotateOptions {
                compression,
                unchecked,
                threads,
                force: true,
                ..AnnotateOptions::default()
            };
            let output = run(path, &options(1));
            assert_subsequence(bytes, &output, !unchecked, &what);
            assert_truthful(&output, &what);
            assert!(run(path, &options(3)) == output, "{what}: threads change the bytes");
        }
    });
}

#[cfg(unix)]
#[test]
fn the_same_through_a_pipe() {
    each_shape(|shape, path, bytes| {
        let pipe = path.with_extension("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo");
        assert!(made.success());
        let options = AnnotateOptions { threads: 2, force: true, ..AnnotateOptions::default() };
        let output = std::thread::scope(|scope| {
            scope.spawn(|| std::fs::write(&pipe, bytes).expect("written"));
            run(&pipe, &options)
        });
        std::fs::remove_file(&pipe).expect("removed");
        let what = format!("{shape:?} through a pipe");
        assert_subsequence(bytes, &output, true, &what);
        assert_truthful(&output, &what);
        let messages = |file: &[u8]| {
            content(file).into_iter().filter(|record| record.0 == op::MESSAGE).count()
        };
        assert_eq!(messages(&output), messages(&run(path, &options)), "{what}");
    });
}
