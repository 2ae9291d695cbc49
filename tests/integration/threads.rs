//! Annotating on several threads, and chunks that are taken over as they are.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::Result;
use divmerge::annotate::{
    AnnotateConfig, AnnotateOptions, AnnotationReport, RunEvent, Semantics, annotate,
};
use divmerge::datasets::drive::write_drive;
use divmerge::recording::{
    Compression, Item, Overview, Part, Record, RecordingReader, RecordingWriter, WriteOptions,
};
use divmerge::simulate::{Drive, Scene, Sensor};
use tempfile::TempDir;

use crate::recordings::{self, assert_passed_through, records};

/// Frames that fill several chunks.
const FRAMES: usize = 32;

/// A VLP-16 drive of several chunks.
fn drive(frames: usize, compression: Compression) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.mcap");
    let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
    let options = WriteOptions { compression, ..WriteOptions::default() };
    write_drive(&drive, frames, &path, &options, |_| ControlFlow::Continue(())).expect("written");
    (folder, path)
}

fn options(threads: usize) -> AnnotateOptions {
    let config = AnnotateConfig { semantics: Semantics::Auto, ..AnnotateConfig::default() };
    AnnotateOptions { config, threads, force: true, ..AnnotateOptions::default() }
}

fn run(input: &Path, options: &AnnotateOptions) -> Result<(Vec<u8>, AnnotationReport)> {
    let (output, report) = recordings::run(input, options)?;
    Ok((std::fs::read(output).expect("the output"), report))
}

/// What happened, but for how far the input was read: frames and warnings in their order.
fn events(input: &Path, options: &AnnotateOptions) -> Vec<String> {
    let mut events = Vec::new();
    let output = input.with_extension("annotated.mcap");
    let _ = annotate(input, &output, options, &mut |event| {
        match event {
            RunEvent::Frame(frame) => {
                events.push(format!("{} {}", frame.key.topic, frame.key.number))
            }
            RunEvent::Tracked(frame) => {
                let tracks: Vec<u32> = frame.objects.iter().map(|object| object.track).collect();
                events.push(format!("{} {}: tracks {tracks:?}", frame.topic, frame.number))
            }
            RunEvent::Warning(warning) => events.push(warning.to_owned()),
            RunEvent::Progress { .. } => {}
        }
        ControlFlow::Continue(())
    });
    events
}

/// Chunks of a recording: place and length of their records in the file.
fn chunks(bytes: &[u8]) -> Vec<&[u8]> {
    const CHUNK: u8 = 0x06;
    const DATA_END: u8 = 0x0f;
    let (mut chunks, mut at) = (Vec::new(), 8);
    loop {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("a length"));
        let end = at + 9 + length as usize;
        match bytes[at] {
            CHUNK => chunks.push(&bytes[at..end]),
            DATA_END => return chunks,
            _ => {}
        }
        at = end;
    }
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    chunks(bytes).contains(&part)
}

#[test]
fn the_bytes_are_the_same_on_any_number_of_threads() {
    let (_folder, input) = drive(FRAMES, Compression::Zstd);
    let start = Overview::read(&input).expect("a recording").start_ns.expect("messages");
    let window = |options| AnnotateOptions { from_ns: Some(start + 250_000_000), ..options };
    let lz4 = |options| AnnotateOptions { compression: Some(Compression::Lz4), ..options };
    for change in
        [&|options| options, &window, &lz4] as [&dyn Fn(AnnotateOptions) -> AnnotateOptions; 3]
    {
        let [(one, _), (two, _), (eight, _)] =
            [1, 2, 8].map(|threads| run(&input, &change(options(threads))).expect("annotated"));
        assert!(one == two && one == eight);
        let [one, eight] = [1, 8].map(|threads| events(&input, &change(options(threads))));
        assert_eq!(one, eight);
        assert!(one.len() >= 17, "{one:?}");
    }
}

#[test]
fn every_chunk_of_the_source_is_in_the_output_as_it_is() {
    let (_folder, input) = drive(FRAMES, Compression::Zstd);
    let source = std::fs::read(&input).expect("the input");
    assert!(chunks(&source).len() > 2, "a drive of several chunks");
    let (output, report) = run(&input, &options(2)).expect("annotated");
    for chunk in chunks(&source) {
        assert!(contains(&output, chunk));
    }
    assert_eq!(report.profile.write.verbatim_chunks, chunks(&source).len() as u64);
    let length: u64 = chunks(&source).iter().map(|chunk| chunk.len() as u64).sum();
    assert_eq!(report.profile.write.verbatim_bytes, length);
    assert_passed_through(&input, &input.with_extension("annotated.mcap"));
}

#[test]
fn additions_follow_right_behind_the_chunk_of_their_clouds() {
    let (_folder, input) = drive(FRAMES, Compression::Zstd);
    run(&input, &options(2)).expect("annotated");
    let output = input.with_extension("annotated.mcap");
    let overview = Overview::read(&output).expect("a recording");
    let is_added = |channel: u16| {
        let topic = &overview.channels[&channel].topic;
        topic.ends_with("/instances") || topic.ends_with("/objects")
    };
    let is_cloud = |channel: u16| overview.channels[&channel].topic == "/lidar/points";
    let mut owed = 0;
    let mut reader = RecordingReader::open(&output).expect("a recording");
    while let Some(part) = reader.next_part().expect("readable") {
        let Part::Chunk(chunk) = part else { continue };
        let of = |test: &dyn Fn(u16) -> bool| {
            let channel = |item: &Item| match item {
                Item::Message { header, .. } => Some(header.channel_id),
                Item::Record(_) => None,
            };
            chunk.items.iter().filter_map(channel).filter(|&channel| test(channel)).count()
        };
        let (clouds, added) = (of(&is_cloud), of(&is_added));
        assert!(clouds == 0 || added == 0, "additions in chunks of their own");
        assert!(clouds == 0 || owed == 0, "a chunk of clouds before the additions to the last");
        owed = owed + 2 * clouds - added;
    }
    assert_eq!(owed, 0);
}

#[test]
fn another_compression_and_a_window_fall_back_to_messages() {
    let (_folder, input) = drive(FRAMES, Compression::Zstd);
    let source = std::fs::read(&input).expect("the input");
    let count = chunks(&source).len();
    for compression in [Compression::Lz4, Compression::None] {
        let (output, report) =
            run(&input, &AnnotateOptions { compression: Some(compression), ..options(2) })
                .expect("annotated");
        assert_eq!(report.profile.write.verbatim_chunks, 0);
        assert!(chunks(&source).iter().all(|chunk| !contains(&output, chunk)));
        assert_passed_through(&input, &input.with_extension("annotated.mcap"));
    }
    // A window that cuts one chunk: those behind it stay.
    let start = Overview::read(&input).expect("a recording").start_ns.expect("messages");
    let cut = AnnotateOptions { from_ns: Some(start + 50_000_000), ..options(2) };
    let (output, report) = run(&input, &cut).expect("annotated");
    assert_eq!(report.profile.write.verbatim_chunks, count as u64 - 1);
    assert!(!contains(&output, chunks(&source)[0]));
    assert!(chunks(&source)[1..].iter().all(|chunk| contains(&output, chunk)));
    assert_eq!(
        Overview::read(&input.with_extension("annotated.mcap")).unwrap().start_ns,
        Some(start + 100_000_000)
    );
}

#[test]
fn the_source_s_compression_is_kept_unless_another_is_asked_for() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let (_folder, input) = drive(FRAMES, compression);
        let source = std::fs::read(&input).expect("the input");
        let (output, report) = run(&input, &options(2)).expect("annotated");
        assert!(chunks(&source).iter().all(|chunk| contains(&output, chunk)));
        assert_eq!(report.profile.write.verbatim_chunks, chunks(&source).len() as u64);
        let overview = Overview::read(&input.with_extension("annotated.mcap")).expect("whole");
        assert_eq!(overview.compression.keys().collect::<Vec<_>>(), [compression.name()]);
    }
}

#[test]
fn a_recording_without_chunks_is_copied_message_by_message() {
    let (_folder, input) = drive(6, Compression::Zstd);
    let bare = input.with_file_name("bare.mcap");
    let file = std::fs::File::create(&bare).expect("a file");
    let mut writer = mcap::WriteOptions::new().use_chunks(false).create(file).expect("a writer");
    for record in records(&input) {
        match record {
            Record::Schema(schema) => {
                let (id, name) = (schema.id, &schema.name);
                writer.add_schema_with_id(id, name, &schema.encoding, &schema.data).map(drop)
            }
            Record::Channel(channel) => {
                let (id, schema, topic) = (channel.id, channel.schema_id, &channel.topic);
                let (encoding, metadata) = (&channel.message_encoding, &channel.metadata);
                writer.add_channel_with_id(id, schema, topic, encoding, metadata).map(drop)
            }
            Record::Message { header, data, .. } => writer.write_to_known_channel(&header, &data),
            _ => Ok(()),
        }
        .expect("written");
    }
    writer.finish().expect("finished");
    assert!(chunks(&std::fs::read(&bare).expect("bytes")).is_empty());
    let (one, report) = run(&bare, &options(1)).expect("annotated");
    assert_eq!(report.profile.write.verbatim_chunks, 0);
    assert_passed_through(&bare, &bare.with_extension("annotated.mcap"));
    let (eight, _) = run(&bare, &options(8)).expect("annotated");
    assert!(one == eight);
}

#[test]
fn a_cut_chunk_is_written_again_and_those_before_it_stay() {
    let (_folder, input) = drive(FRAMES, Compression::Zstd);
    let whole = std::fs::read(&input).expect("the input");
    let count = chunks(&whole).len();
    let last = chunks(&whole)[count - 1];
    let at = whole.windows(last.len()).position(|bytes| bytes == last).expect("the last chunk");
    std::fs::write(&input, &whole[..at + last.len() * 2 / 3]).expect("written");
    let (output, report) = run(&input, &options(2)).expect("annotated");
    assert!(report.truncated.is_some());
    assert_eq!(report.profile.write.verbatim_chunks, count as u64 - 1);
    assert!(chunks(&whole)[..count - 1].iter().all(|chunk| contains(&output, chunk)));
    let (one, _) = run(&input, &options(1)).expect("annotated");
    assert!(one == output);
}

#[test]
fn a_damaged_chunk_is_an_error_behind_the_frames_before_it() {
    let (folder, input) = drive(FRAMES, Compression::Zstd);
    let mut bytes = std::fs::read(&input).expect("the input");
    let last = chunks(&bytes).last().expect("chunks").to_vec();
    let at = bytes.windows(last.len()).position(|bytes| bytes == last).expect("the last chunk");
    bytes[at + last.len() / 2] ^= 0x10;
    std::fs::write(&input, &bytes).expect("written");
    for threads in [1, 2, 8] {
        let error = run(&input, &options(threads)).expect_err("damaged").to_string();
        assert!(error.contains(&format!("byte {at}")), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 1);
    }
    let [one, eight] = [1, 8].map(|threads| events(&input, &options(threads)));
    assert!(one == eight && one.len() > 5, "{one:?}");
}

#[test]
fn an_interruption_in_the_middle_leaves_nothing() {
    let (folder, input) = drive(FRAMES, Compression::Zstd);
    for threads in [1, 2, 8] {
        let (output, mut frames) = (folder.path().join("out.mcap"), 0);
        let broken = annotate(&input, &output, &options(threads), &mut |event| {
            frames += usize::from(matches!(event, RunEvent::Frame(_)));
            if frames < 7 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        assert!(broken.expect_err("interrupted").to_string().contains("interrupted"));
        assert_eq!(frames, 7);
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 1);
    }
}

#[test]
fn clouds_in_flight_are_bounded_whatever_the_length() {
    for frames in [8, FRAMES] {
        let (_folder, input) = drive(frames, Compression::Zstd);
        for threads in [1, 2, 4] {
            let (_, report) = run(&input, &options(threads)).expect("annotated");
            let most = report.profile.most_clouds_in_flight;
            assert!((1..=threads + 1).contains(&most), "{most} on {threads} threads");
        }
    }
}

#[test]
fn a_copy_by_parts_is_the_same_recording() {
    let (_folder, input) = drive(FRAMES, Compression::Zstd);
    let overview = Overview::read(&input).expect("a recording");
    let output = input.with_extension("copy.mcap");
    let options = WriteOptions { profile: overview.profile.clone(), ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(&output, &options).expect("a writer");
    let mut reader = RecordingReader::open(&input).expect("a recording");
    while let Some(part) = reader.next_part().expect("readable") {
        match part {
            Part::Chunk(chunk) => writer.copy_chunk(&chunk).expect("copied"),
            Part::Items(items) => {
                for item in items {
                    if let Item::Record(record) = item {
                        writer.copy(&record).expect("copied");
                    }
                }
            }
        }
    }
    writer.finish().expect("finished");
    let copy = Overview::read(&output).expect("a recording");
    assert!(copy.from_summary);
    assert_eq!(copy.message_counts, overview.message_counts);
    assert_eq!((copy.schemas, copy.channels), (overview.schemas, overview.channels));
    let strip = |records: Vec<Record<'static>>| -> Vec<_> {
        let message = |record| match record {
            Record::Message { header, data, .. } => Some((header, data)),
            _ => None,
        };
        records.into_iter().filter_map(message).collect()
    };
    assert_eq!(strip(records(&input)), strip(records(&output)));
}
