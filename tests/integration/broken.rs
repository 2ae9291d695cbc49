//! Messages, chunks and recordings that lie, one named case each. The fuzz harness (`fuzz/`) finds
//! others; what it found is here with the fewest bytes that show it.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;

use divmerge::annotate::{
    AnnotateConfig, AnnotateOptions, AnnotationReport, MessageTypes, RunEvent, Semantics, annotate,
    annotate_message,
};
use divmerge::frames::EncodedCloud;
use divmerge::messages::clouds::{CloudFormat, CloudMessage, Datatype, PointField};
use divmerge::messages::definitions::POINT_CLOUD2;
use divmerge::pipeline::{self, Config};
use divmerge::recording::{
    MessageHeader, Overview, Record, RecordingReader, RecordingWriter, WriteOptions,
};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::{PointCloud, Result};
use tempfile::TempDir;

use crate::recorded::{Plain, Shape, file, put, records};
use crate::recordings::assert_passed_through;

const BINARY: &str = env!("CARGO_BIN_EXE_divmerge");

/// Two points of x, y, z as FLOAT32, to be made wrong.
fn two_points(data: &[u8]) -> CloudMessage<'_> {
    let field = |name: &str, offset: u32| PointField {
        name: name.into(),
        offset,
        datatype: Datatype::Float32,
        count: 1,
    };
    CloudMessage {
        stamp_sec: 1,
        stamp_nanosec: 2,
        frame_id: "lidar".into(),
        height: 1,
        width: 2,
        fields: vec![field("x", 0), field("y", 4), field("z", 8)],
        is_bigendian: false,
        point_step: 12,
        row_step: 24,
        data: data.into(),
        is_dense: true,
        ..CloudMessage::default()
    }
}

pub fn encoded(cloud: &CloudMessage) -> Vec<u8> {
    let mut message = Vec::new();
    cloud.encode(&mut message).expect("sizes that agree");
    message
}

fn plain_message() -> Vec<u8> {
    encoded(&two_points(&[63; 24]))
}

/// What annotating the message alone comes to.
fn annotated(message: &[u8]) -> Result<()> {
    let (method, types) = (AnnotateConfig::default(), MessageTypes::default());
    let encoded = EncodedCloud::of_message(CloudFormat::Ros2, message.to_vec());
    annotate_message(&encoded, &method, &types, &mut Default::default()).map(drop)
}

/// Puts a `u32` in place of each aligned word of a message in turn and calls `check`.
fn with_each_word(message: &[u8], word: u32, mut check: impl FnMut(usize, &[u8])) {
    for at in (4..message.len() - 3).step_by(4) {
        let mut lying = message.to_vec();
        lying[at..at + 4].copy_from_slice(&word.to_le_bytes());
        check(at, &lying);
    }
}

#[test]
fn sizes_that_lie_are_errors() {
    let message = plain_message();
    for word in [u32::MAX, u32::MAX / 12, 1 << 31, 1 << 24] {
        with_each_word(&message, word, |at, lying| {
            let cloud = CloudFormat::Ros2.decode(lying);
            // What can be that large without contradiction: stamp, offsets and counts of fields.
            let Ok(cloud) = cloud else { return };
            assert!(cloud.data.len() <= message.len(), "word {at}");
            assert_eq!(cloud.points().count(), 2, "word {at}");
        });
    }
}

#[test]
fn a_row_step_that_overflows_is_an_error() {
    let cloud = two_points(&[0; 24]);
    let message = encoded(&cloud);
    // height x row_step, and width x point_step, are zero in 32 bits.
    for (height, width, point_step, row_step) in [
        (1 << 16, 2, 12, 1 << 16),
        (1, 1 << 31, 2, 24),
        (u32::MAX, u32::MAX, u32::MAX, u32::MAX),
        (0, u32::MAX, u32::MAX, u32::MAX),
    ] {
        let mut lying = message.clone();
        let at = |word: &[u8]| message.windows(word.len()).position(|w| w == word).expect("there");
        let shape = at(&[1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);
        let steps = at(&[12, 0, 0, 0, 24, 0, 0, 0]);
        for (at, value) in
            [(shape, height), (shape + 4, width), (steps, point_step), (steps + 4, row_step)]
        {
            lying[at..at + 4].copy_from_slice(&u32::to_le_bytes(value));
        }
        let error = CloudFormat::Ros2.decode(&lying).expect_err("sizes that disagree").to_string();
        assert!(error.contains("row") || error.contains("data"), "{error}");
    }
}

#[test]
fn a_field_beyond_the_point_is_an_error() {
    let data = [63; 24];
    for offset in [9, 12, u32::MAX - 3, u32::MAX] {
        let mut cloud = two_points(&data);
        cloud.fields[2].offset = offset;
        let error = annotated(&encoded(&cloud)).expect_err("beyond the point").to_string();
        assert!(error.contains("`z`") && error.contains(&offset.to_string()), "{error}");
    }
}

#[test]
fn of_two_fields_of_a_name_the_first_counts() {
    let data: Vec<u8> =
        [1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0].into_iter().flat_map(f32::to_le_bytes).collect();
    let mut cloud = two_points(&data);
    cloud.fields.push(PointField { offset: 8, ..cloud.fields[0].clone() });
    let message = encoded(&cloud);
    let read = CloudFormat::Ros2.decode(&message).expect("a message");
    assert_eq!(read.to_cloud(None).expect("a cloud").x, [1.0, 4.0]);
    annotated(&message).expect("annotated");
}

#[test]
fn times_that_are_no_numbers_change_nothing() {
    let data: Vec<u8> = [5.0_f32, 0.0, 0.0, f32::NAN, 5.0, 0.1, 0.0, f32::INFINITY]
        .into_iter()
        .flat_map(f32::to_le_bytes)
        .collect();
    let mut cloud = two_points(&data);
    cloud.fields.push(PointField { name: "time".into(), offset: 12, ..cloud.fields[0].clone() });
    (cloud.point_step, cloud.row_step) = (16, 32);
    // A stamp of the header's that no clock has: negative, with more nanoseconds than a second.
    (cloud.stamp_sec, cloud.stamp_nanosec) = (i64::from(i32::MIN), u32::MAX);
    let message = encoded(&cloud);
    annotated(&message).expect("annotated");
    let (_folder, input) = recording(&[(7, message)]);
    let report = annotate_all(&input).expect("annotated").1;
    assert_eq!(report.topics["/points"].frames, 1);
}

#[test]
fn time_that_goes_backwards_stays_in_its_order() {
    let message = plain_message();
    let times = [5_u64, 4, u64::MAX, 0, 4];
    let messages: Vec<_> = times.map(|time| (time, message.clone())).to_vec();
    let (_folder, input) = recording(&messages);
    let (output, report) = annotate_all(&input).expect("annotated");
    assert_eq!(report.topics["/points"].frames, 5);
    assert_passed_through(&input, &output);
    let overview = Overview::read(&output).expect("a recording");
    assert_eq!((overview.start_ns, overview.end_ns), (Some(0), Some(u64::MAX)));
}

fn recording(messages: &[(u64, Vec<u8>)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("made.mcap");
    let options = WriteOptions { profile: "ros2".into(), ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(&path, &options).expect("a writer");
    let schema = POINT_CLOUD2.add_to(&mut writer).expect("schema");
    let channel_id =
        writer.add_channel("/points", schema, "cdr", &BTreeMap::new()).expect("channel");
    for (sequence, (log_time, message)) in (0..).zip(messages) {
        let header =
            MessageHeader { channel_id, sequence, log_time: *log_time, publish_time: *log_time };
        writer.write_message(&header, message).expect("message");
    }
    writer.finish().expect("finished");
    (folder, path)
}

fn annotate_all(input: &Path) -> Result<(PathBuf, AnnotationReport)> {
    let output = input.with_extension("out.mcap");
    let options = AnnotateOptions {
        config: AnnotateConfig { semantics: Semantics::All, ..AnnotateConfig::default() },
        ..AnnotateOptions::default()
    };
    let report = annotate(input, &output, &options, &mut |_: RunEvent| ControlFlow::Continue(()))?;
    Ok((output, report))
}

/// A recording of one chunk with this body.
pub fn with_chunk(body: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("lying.mcap");
    let mut bytes = b"\x89MCAP0\r\n".to_vec();
    put(&mut bytes, 1, &[0; 8]);
    put(&mut bytes, 6, body);
    put(&mut bytes, 15, &[0; 4]);
    put(&mut bytes, 2, &[0; 20]);
    bytes.extend(b"\x89MCAP0\r\n");
    std::fs::write(&path, bytes).expect("written");
    (folder, path)
}

/// A chunk's body that claims `claimed` bytes of records.
pub fn chunk(compression: &str, claimed: u64, data: &[u8]) -> Vec<u8> {
    let mut body = [0, 0, claimed].map(u64::to_le_bytes).concat();
    body.extend([0; 4]);
    body.extend((compression.len() as u32).to_le_bytes());
    body.extend(compression.as_bytes());
    body.extend((data.len() as u64).to_le_bytes());
    body.extend(data);
    body
}

pub fn zstd_of(bytes: &[u8]) -> Vec<u8> {
    zstd::bulk::compress(bytes, 1).expect("memory")
}

pub fn lz4_of(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).expect("memory");
    std::io::Write::write_all(&mut encoder, bytes).expect("memory");
    encoder.finish().0
}

pub fn first_error(path: &Path) -> String {
    let mut reader = RecordingReader::open(path).expect("a recording");
    loop {
        match reader.next_record() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("no error"),
            Err(error) => return error.to_string(),
        }
    }
}

/// What the binary says of a recording that it cannot read, with a gigabyte of memory to do so.
fn error_in_a_gigabyte(path: &Path) -> String {
    let command = format!("ulimit -v 1000000; exec '{}' info '{}'", BINARY, path.display());
    let output = Command::new("sh").args(["-c", &command]).output().expect("a shell");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    said
}

#[test]
fn a_chunk_that_claims_100_gb_is_not_believed() {
    let packed = [("", b"x".to_vec()), ("zstd", zstd_of(b"x")), ("lz4", lz4_of(b"x"))];
    for (compression, data) in packed {
        for claimed in [100_000_000_000, 2_000_000_000] {
            let (_folder, path) = with_chunk(&chunk(compression, claimed, &data));
            let error = error_in_a_gigabyte(&path);
            assert!(error.contains(&format!("claims {claimed} bytes")), "{error}");
            assert!(error.contains("lying.mcap") && error.contains("byte "), "{error}");
            assert!(annotate_all(&path).is_err());
        }
    }
}

#[test]
fn a_chunk_that_claims_more_or_less_than_it_holds_is_an_error() {
    let inner = [&[0x90][..], &3_u64.to_le_bytes(), b"abc"].concat();
    let packed = [("", inner.clone()), ("zstd", zstd_of(&inner)), ("lz4", lz4_of(&inner))];
    for (compression, data) in packed {
        for claimed in [0, 11, 13, 1000, 100 << 20] {
            let (_folder, path) = with_chunk(&chunk(compression, claimed, &data));
            let error = first_error(&path);
            assert!(error.contains("claims"), "{compression} {claimed}: {error}");
        }
    }
}

#[test]
fn a_small_chunk_that_truly_inflates_to_a_lot_is_not_unpacked() {
    // A private record of 400 MB of zeros in some 40 kB.
    let size = 400_u64 << 20;
    let mut encoder = zstd::Encoder::new(Vec::new(), 1).expect("memory");
    let head = [&[0x90][..], &(size - 9).to_le_bytes()].concat();
    std::io::copy(
        &mut std::io::Read::chain(&*head, std::io::Read::take(std::io::repeat(0), size - 9)),
        &mut encoder,
    )
    .expect("memory");
    let data = encoder.finish().expect("memory");
    assert!(data.len() < 100_000);
    // It may say so, or not.
    for claimed in [size, 1000, 200 << 20] {
        let (_folder, path) = with_chunk(&chunk("zstd", claimed, &data));
        let error = error_in_a_gigabyte(&path);
        assert!(error.contains(&format!("claims {claimed} bytes")), "{error}");
    }
}

#[test]
fn an_unknown_compression_is_named() {
    let (_folder, path) = with_chunk(&chunk("brotli", 10, b"0123456789"));
    assert!(first_error(&path).contains("`brotli`"));
}

const SHAPE: Shape = Shape {
    per_chunk: Some(2),
    compression: "",
    has_crc: false,
    has_index: true,
    has_summary: true,
    has_statistics: true,
};

#[test]
fn every_length_of_a_recording_may_lie() {
    let plain: Vec<Plain> = records(&[plain_message()]);
    let whole = file(&plain, SHAPE, |_, _| ());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("lying.mcap");
    for at in 8..whole.len() - 8 {
        for word in [0, 1, u64::MAX, u64::MAX >> 1, 100_000_000_000] {
            let mut lying = whole.clone();
            lying[at..at + 8].copy_from_slice(&u64::to_le_bytes(word));
            std::fs::write(&path, &lying).expect("written");
            let Ok(mut reader) = RecordingReader::open(&path) else { continue };
            while let Ok(Some(record)) = reader.next_record() {
                if let Record::Message { data, .. } = record {
                    assert!(data.len() < whole.len(), "byte {at}");
                }
            }
        }
    }
}

#[test]
fn a_name_that_claims_four_gigabytes_is_not_made_room_for() {
    let plain: Vec<Plain> = records(&[plain_message()]);
    for kind in [3_u8, 4, 12] {
        let mut lying = plain.clone();
        for (_, body) in lying.iter_mut().filter(|(opcode, _)| *opcode == kind) {
            let at = match kind {
                3 => 2,
                4 => 4,
                _ => 0,
            };
            body[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("lying.mcap");
        // Without a summary all of it is read.
        let shape = Shape { has_summary: false, ..SHAPE };
        std::fs::write(&path, file(&lying, shape, |_, _| ())).expect("written");
        let error = error_in_a_gigabyte(&path);
        assert!(error.contains("cannot be parsed") && error.contains("byte "), "{error}");
    }
}

#[test]
fn a_cloud_of_a_billion_rows_of_nothing_is_empty() {
    let mut cloud = two_points(&[]);
    (cloud.height, cloud.width, cloud.row_step) = (1_000_000_000, 0, 0);
    annotated(&encoded(&cloud)).expect("annotated");
}

#[test]
fn no_points_of_four_gigabytes_each_need_no_room() {
    let mut cloud = two_points(&[]);
    (cloud.height, cloud.width, cloud.point_step, cloud.row_step) = (1, 0, u32::MAX - 20, 0);
    annotated(&encoded(&cloud)).expect("annotated");
}

/// Clouds at the edge of what numbers can be.
#[test]
fn clouds_as_far_as_floats_go_are_clustered() {
    let far = [f32::MAX, -f32::MAX, 1e38, 1e19, 1e-45, 0.0, f32::NAN, f32::INFINITY, 3.0];
    let points: Vec<[f32; 3]> =
        far.iter().flat_map(|&x| far.iter().flat_map(move |&y| far.map(|z| [x, y, z]))).collect();
    let column = |axis: usize| points.iter().map(|point| point[axis]).collect();
    let cloud = PointCloud::new(column(0), column(1), column(2)).expect("equally long");
    let ground = GroundParams::default();
    for cloud in [cloud.clone(), cloud.organised(81, 9).expect("all points")] {
        for config in [Config::paper(), Config::authors(), Config::best()] {
            for mask in [MaskSource::All, MaskSource::NotGround(&ground)] {
                let stages = pipeline::run(&cloud, mask, &config);
                assert_eq!(stages.labels.reason.len(), cloud.len());
            }
        }
    }
}
