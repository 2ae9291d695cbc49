//! Compressed chunks that have no end, or more in them than anyone wants: a small recording that
//! unpacks to clouds of gigabytes is read as far as `--max-unpacked` says.

use std::fs::File;
use std::path::PathBuf;
use std::process::{Command, Output};

use divmerge::messages::clouds::{CloudMessage, Datatype, PointField};
use tempfile::TempDir;

use crate::broken::{chunk, encoded, first_error, lz4_of, with_chunk, zstd_of};
use crate::cli::{path, text};
use crate::recorded::{Shape, file, put, records};

const POINTS: usize = 1_000_000;

/// Bytes of the end of a recording without a summary: end of the data, footer, magic.
const END: usize = (9 + 4) + (9 + 20) + 8;

/// Bytes of a cloud of [`POINTS`] points at the origin.
const CLOUD: usize = 16 * POINTS;

/// A chunk of one cloud of zeros.
fn chunk_of_zeros() -> Vec<u8> {
    let field = |(name, offset): (&str, u32)| PointField {
        name: name.into(),
        offset,
        datatype: Datatype::Float32,
        count: 1,
    };
    let cloud = encoded(&CloudMessage {
        frame_id: "lidar".into(),
        height: 1,
        width: POINTS as u32,
        fields: [("x", 0), ("y", 4), ("z", 8)].map(field).to_vec(),
        point_step: 16,
        row_step: CLOUD as u32,
        data: vec![0; CLOUD].into(),
        ..CloudMessage::default()
    });
    let mut message = Vec::new();
    put(&mut message, 5, &[&1_u16.to_le_bytes()[..], &[0; 20], &cloud].concat());
    chunk("zstd", message.len() as u64, &zstd_of(&message))
}

/// A recording of so many clouds of zeros.
fn clouds_of_zeros(count: usize) -> (TempDir, PathBuf) {
    let shape = Shape {
        per_chunk: None,
        compression: "",
        has_crc: false,
        has_index: false,
        has_summary: false,
        has_statistics: false,
    };
    let mut chunks = Vec::new();
    put(&mut chunks, 6, &chunk_of_zeros());
    let mut bytes = file(&records(&[]), shape, |_, _| ());
    let end = bytes.len() - END;
    bytes.splice(end..end, chunks.repeat(count));
    let folder = tempfile::tempdir().expect("a folder");
    let recording = folder.path().join("zeros.mcap");
    std::fs::write(&recording, bytes).expect("written");
    (folder, recording)
}

/// Annotates a recording, read from standard input, in 2 GB of memory at most.
fn annotate_in_two_gigabytes(recording: &PathBuf, more: &str) -> Output {
    let output = recording.with_extension("annotated.mcap");
    let command = format!(
        "ulimit -v 2000000; exec '{}' annotate - -o '{}' --no-layout --threads 1 {more}",
        env!("CARGO_BIN_EXE_divmerge"),
        path(&output)
    );
    let stdin = File::open(recording).expect("a recording");
    Command::new("sh").args(["-c", &command]).stdin(stdin).output().expect("a shell")
}

#[test]
fn a_small_file_of_sixteen_gigabytes_of_clouds_is_refused() {
    let count = (16_usize << 30) / CLOUD + 1;
    let (folder, recording) = clouds_of_zeros(count);
    assert!(recording.metadata().expect("a file").len() < 5_000_000);
    let output = folder.path().join("out.mcap");
    for (command, more) in [("info", None), ("annotate", Some(path(&output)))] {
        let mut arguments = vec![command, path(&recording)];
        arguments.extend(more.into_iter().flat_map(|output| ["-o", output]));
        let done = crate::cli::divmerge(&arguments);
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(1), "{said}");
        assert!(said.contains("more than 4294967296 bytes"), "{said}");
        assert!(said.contains("--max-unpacked") && said.contains("zeros.mcap"), "{said}");
    }
    assert!(!output.exists());
}

#[test]
fn clouds_are_annotated_up_to_the_limit_of_unpacked_bytes() {
    let (folder, recording) = clouds_of_zeros(4);
    let files = || std::fs::read_dir(folder.path()).expect("a folder").count();
    let done = annotate_in_two_gigabytes(&recording, "--max-unpacked 40M");
    let said = text(&done.stderr);
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(said.contains("unpacks to more than 41943040 bytes"), "{said}");
    assert_eq!(files(), 1, "only the input");

    let done = annotate_in_two_gigabytes(&recording, "--max-unpacked 80M");
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains("4 frames"), "{}", text(&done.stdout));
    assert_eq!(files(), 2);
}

#[test]
fn a_chunk_whose_compression_has_no_end_is_an_error() {
    let inner = [&[0x90][..], &3_u64.to_le_bytes(), b"abc"].concat();
    for (compression, data) in [("zstd", zstd_of(&inner)), ("lz4", lz4_of(&inner))] {
        for cut in 1..=8 {
            let data = &data[..data.len() - cut];
            let (_folder, path) = with_chunk(&chunk(compression, inner.len() as u64, data));
            let error = first_error(&path);
            assert!(error.contains("cannot be decompressed"), "{compression} {cut}: {error}");
        }
    }
}
