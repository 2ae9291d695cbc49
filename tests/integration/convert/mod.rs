//! `divmerge convert`, and `export` of what it writes.

mod formats;
mod sequences;

use std::path::Path;

use divmerge::Error;
use divmerge::datasets::scans::{Columns, FolderOptions, Scan, ScanFolder, ScanFormat};
use divmerge::frames::EncodedClouds;
use divmerge::messages::clouds::CloudFormat;
use divmerge::recording::{Overview, Record, RecordingReader, WriteOptions};
use proptest::prelude::*;
use tempfile::TempDir;

use crate::cli::{divmerge, path, text};
use crate::shared_data::shared_data;

use formats::{compressed, npy, pcd, pcd_columns, pcd_lines, pcd_points};
use sequences::kitti;

/// Seven points: x counts, y and z differ, intensity is a quarter.
const POINTS: usize = 7;

fn numbers(columns: usize) -> Vec<f32> {
    let number = |point: usize, column: usize| match column {
        0 => point as f32,
        3 => 0.25,
        column => (10 * column) as f32 - point as f32 / 2.0,
    };
    (0..POINTS).flat_map(|point| (0..columns).map(move |column| number(point, column))).collect()
}

fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn write(file: &Path, bytes: impl AsRef<[u8]>) {
    std::fs::create_dir_all(file.parent().expect("a folder")).expect("made");
    std::fs::write(file, bytes).expect("written");
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

fn convert(arguments: &[&str]) -> (Option<i32>, String, String) {
    let done = divmerge(&[&["convert"], arguments].concat());
    (done.status.code(), text(&done.stdout), text(&done.stderr))
}

/// The messages of a topic: log time and bytes.
fn messages(recording: &Path, topic: &str) -> Vec<(u64, Vec<u8>)> {
    let overview = Overview::read(recording).expect("a recording");
    let channels: Vec<u16> = overview.channels_of(topic).map(|channel| channel.id).collect();
    let mut reader = RecordingReader::open(recording).expect("a recording");
    let mut messages = Vec::new();
    while let Some(record) = reader.next_record().expect("a record") {
        if let Record::Message { header, data, .. } = record
            && channels.contains(&header.channel_id)
        {
            messages.push((header.log_time, data.into_owned()));
        }
    }
    messages
}

/// What one file in a folder of its own becomes.
fn converted(name: &str, content: &[u8], more: &[&str]) -> (Vec<u8>, String) {
    let here = folder();
    write(&here.path().join("scans").join(name), content);
    let output = here.path().join("out.mcap");
    let scans = here.path().join("scans");
    let arguments = ["folder", path(&scans), "-o", path(&output)];
    let (code, said, errors) = convert(&[&arguments, more].concat());
    assert_eq!(code, Some(0), "{name}: {errors}");
    let mut messages = messages(&output, "/points");
    assert_eq!(messages.len(), 1, "{name}");
    (messages.remove(0).1, said + &errors)
}

fn check_xyz_intensity(message: &[u8], what: &str) {
    let cloud = CloudFormat::Ros2.decode(message).expect("a cloud");
    let expected = numbers(4);
    for (column, name) in ["x", "y", "z", "intensity"].iter().enumerate() {
        let expected: Vec<f64> = expected.chunks(4).map(|point| point[column].into()).collect();
        assert_eq!(cloud.column_f64(name).expect(name), expected, "{what}: {name}");
    }
    assert!(cloud.is_dense, "{what}");
}

#[test]
fn real_labels_come_back_byte_by_byte() {
    let Some(data) = shared_data() else { return };
    let (root, here) = (data.join("semantickitti"), folder());
    let out = format!("{}/", path(here.path()));
    let (code, _, errors) = kitti(&[path(&root), "-o", &out, "--labels", "--compression", "lz4"]);
    assert_eq!(code, Some(0), "{errors}");
    let mut scans = 0;
    for scan in divmerge::datasets::semantic_kitti::labelled_scans(&root).expect("sequences") {
        let number = scan.scan.file_stem().and_then(|stem| stem.to_str()).expect("a number");
        let number: u64 = number.parse().expect("a number");
        let recording = here.path().join(format!("{}.mcap", scan.sequence));
        let message =
            EncodedClouds::open(&recording, None, number..=number).expect("a topic").next();
        let message = message.expect("a cloud").expect("readable");
        let cloud = CloudFormat::Ros2.decode(&message.data).expect("a cloud");
        let column = |name| cloud.column_u32(name).expect("a column");
        let words = column("label").into_iter().zip(column("true_instance"));
        let words: Vec<u8> =
            words.flat_map(|(class, id)| (class | id << 16).to_le_bytes()).collect();
        assert!(words == std::fs::read(&scan.labels).expect("labels"), "{}", scan.labels.display());
        let points: Vec<u8> = cloud.points().flat_map(|point| point[..16].to_vec()).collect();
        assert!(points == std::fs::read(&scan.scan).expect("a scan"), "{}", scan.scan.display());
        scans += 1;
    }
    assert_eq!(scans, 32);
}

/// docs/semantickitti.md: convert, annotate, export, evaluate, with the classes of the truth and
/// with another method's, which are here the truth's once more.
#[test]
fn real_sequences_go_all_the_way_to_figures() {
    let Some(data) = shared_data() else { return };
    let (root, here) = (data.join("semantickitti"), folder());
    let network = here.path().join("network");
    for scan in divmerge::datasets::semantic_kitti::labelled_scans(&root).expect("sequences") {
        let name = scan.labels.file_name().expect("a name");
        let folder = network.join("sequences").join(&scan.sequence).join("predictions");
        write(&folder.join(name), std::fs::read(&scan.labels).expect("labels"));
    }
    let recordings = format!("{}/recordings/", path(here.path()));
    let chosen = ["--sequence", "01,03", "--labels", "--predictions", path(&network)];
    let (code, _, errors) = kitti(&[&[path(&root), "-o", &recordings], &chosen[..]].concat());
    assert_eq!(code, Some(0), "{errors}");
    let run = |arguments: &[&str]| {
        let done = divmerge(arguments);
        assert_eq!(done.status.code(), Some(0), "{arguments:?}: {}", text(&done.stderr));
    };
    let figures = |name: &str, more: &[&str]| -> serde_json::Value {
        let annotated = ["01", "03"].map(|nn| format!("{}/{name}-{nn}.mcap", path(here.path())));
        for (nn, output) in ["01", "03"].iter().zip(&annotated) {
            let input = format!("{recordings}{nn}.mcap");
            run(&[&["annotate", &input, "-o", output], more].concat());
        }
        let mine = here.path().join(name);
        run(&["export", &annotated[0], &annotated[1], "--root", path(&mine)]);
        let json = mine.join("figures.json");
        let folders =
            ["--truth", path(&root), "--predictions", path(&mine), "--sequences", "01,03"];
        run(&[&["evaluate", "--json", path(&json)], &folders[..]].concat());
        serde_json::from_slice(&std::fs::read(json).expect("figures")).expect("JSON")
    };
    let mut found = figures("mine", &[]);
    let mut of_network = figures("submission", &["--semantics", "field:predicted_label"]);
    assert_eq!(found["scans"], 5);
    assert_eq!(found["classes"][0]["name"], "car");
    assert!(found["classes"][0]["pq"].as_f64() > Some(0.9), "{found}");
    for class in found["classes"].as_array().expect("classes").iter().skip(8) {
        assert!(class["true_points"] == 0 || class["pq"] == 1.0, "{class}");
    }
    found["predictions"].take();
    of_network["predictions"].take();
    assert_eq!(found, of_network);
}

#[test]
fn an_interrupted_conversion_leaves_nothing() {
    use std::ops::ControlFlow;
    let here = folder();
    let scans = here.path().join("scans");
    ["0.bin", "1.bin", "2.bin"]
        .iter()
        .for_each(|name| write(&scans.join(name), bytes(&numbers(4))));
    let folder = ScanFolder::open(&scans, &FolderOptions::default()).expect("scans");
    let output = here.path().join("out.mcap");
    let mut frames = 0;
    let done = folder.write(&output, "/points", "lidar", &WriteOptions::default(), || {
        frames += 1;
        if frames == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(done, Err(Error::Interrupted { .. })), "{done:?}");
    assert_eq!((folder.len(), frames), (3, 2));
    assert_eq!(std::fs::read_dir(here.path()).expect("listed").count(), 1);
}

proptest! {
    /// Whatever a file holds, reading it ends in a scan or an error.
    #[test]
    fn no_bytes_make_a_reader_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..300),
        flips in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 0..4),
    ) {
        let parse = |content: Vec<u8>, format| {
            if let Ok(scan) = Scan::parse(content, format, None) {
                let message = scan.message(0, "lidar").expect("x, y and z");
                message.encode(&mut Vec::new()).expect("sizes agree");
            }
        };
        let shape = [1, POINTS];
        let whole = [
            (pcd("ascii", shape).into_bytes(), pcd_lines().into_bytes(), ScanFormat::Pcd),
            (pcd("binary", shape).into_bytes(), pcd_points(), ScanFormat::Pcd),
            (
                pcd("binary_compressed", shape).into_bytes(),
                compressed(&pcd_columns()),
                ScanFormat::Pcd,
            ),
            (npy("'<f4'", true, "(7, 4)", &[]), self::bytes(&numbers(4)), ScanFormat::Npy),
            (npy("[('x', '<f4'), ('y', '<f4'), ('z', \
                '<f8')]", true, "(7,)", &[]), vec![0; 112], ScanFormat::Npy),
        ];
        for format in [ScanFormat::Bin, ScanFormat::Pcd, ScanFormat::Npy] {
            parse(bytes.clone(), format);
        }
        for (head, body, format) in whole {
            parse([head.clone(), bytes.clone()].concat(), format);
            let mut damaged = [head, body].concat();
            for (place, byte) in &flips {
                let at = place.index(damaged.len());
                damaged[at] = *byte;
            }
            parse(damaged, format);
        }
        let sizes = [bytes.len() as u32, 126].map(u32::to_le_bytes).concat();
        let packed = [pcd("binary_compressed", shape).into_bytes(), sizes, bytes.clone()].concat();
        parse(packed, ScanFormat::Pcd);
        let columns: Columns = "x,y,z,_,ring".parse().expect("names");
        let _ = Scan::parse(bytes, ScanFormat::Bin, Some(&columns));
    }
}
