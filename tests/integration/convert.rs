//! `divmerge convert`, and `export` of what it writes.

use std::path::{Path, PathBuf};

use divmerge::Error;
use divmerge::io::frames::CloudMessages;
use divmerge::io::ros::RosReader;
use divmerge::io::scans::{Columns, FolderOptions, Scan, ScanFolder, ScanFormat};
use divmerge::io::{CloudFormat, Overview, Record, RecordingReader, WriteOptions};
use proptest::prelude::*;
use tempfile::TempDir;

use crate::cli::{divmerge, path, text};
use crate::shared_data::shared_data;

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

/// The header of a .pcd file of x y z intensity and a ring, with padding between.
fn pcd(encoding: &str, shape: [usize; 2]) -> String {
    let [height, width] = shape;
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z _ intensity ring\n\
         SIZE 4 4 4 1 4 2\nTYPE F F F U F U\nCOUNT 1 1 1 3 1 1\nWIDTH {width}\nHEIGHT {height}\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {encoding}\n",
        height * width
    )
}

/// The points of such a file as bytes, 21 each.
fn pcd_points() -> Vec<u8> {
    let mut points = Vec::new();
    for (number, point) in numbers(4).chunks(4).enumerate() {
        points.extend(bytes(&point[..3]));
        points.extend([0; 3]);
        points.extend(bytes(&point[3..]));
        points.extend((number as u16).to_le_bytes());
    }
    points
}

/// LZF without any compression: runs of 32 bytes and less.
fn stored(data: &[u8]) -> Vec<u8> {
    data.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect()
}

fn compressed(fields: &[u8]) -> Vec<u8> {
    let packed = stored(fields);
    let sizes = [packed.len() as u32, fields.len() as u32].map(u32::to_le_bytes).concat();
    [sizes, packed].concat()
}

/// The points field by field, padding left out.
fn pcd_columns() -> Vec<u8> {
    let points = pcd_points();
    let column = |range: std::ops::Range<usize>| {
        points.chunks(21).flat_map(move |point| point[range.clone()].to_vec()).collect::<Vec<_>>()
    };
    [column(0..4), column(4..8), column(8..12), column(15..19), column(19..21)].concat()
}

fn pcd_lines() -> String {
    let points = numbers(4);
    let line = |(number, p): (usize, &[f32])| {
        format!("{} {} {} 0 0 0 {} {number}\n", p[0], p[1], p[2], p[3])
    };
    points.chunks(4).enumerate().map(line).collect()
}

fn npy(descr: &str, is_fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let fortran = if is_fortran { "True" } else { "False" };
    let header = format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}");
    let header = format!("{header:<117}\n");
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
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
fn every_format_gives_the_same_points() {
    let file = |head: String, body: &[u8]| [head.as_bytes(), body].concat();
    let flat = bytes(&numbers(4));
    let doubles: Vec<u8> = numbers(4).iter().flat_map(|&n| f64::from(n).to_be_bytes()).collect();
    let columns: Vec<u8> = (0..4)
        .flat_map(|c| numbers(4).chunks(4).flat_map(|p| p[c].to_le_bytes()).collect::<Vec<_>>())
        .collect();
    let shape = [1, POINTS];
    for (name, content) in [
        ("a.bin", flat.clone()),
        ("ascii.pcd", file(pcd("ascii", shape), pcd_lines().as_bytes())),
        ("binary.pcd", file(pcd("binary", shape), &pcd_points())),
        ("compressed.pcd", file(pcd("binary_compressed", shape), &compressed(&pcd_columns()))),
        ("page.pcd", file(pcd("binary", shape), &[pcd_points(), vec![0; 99]].concat())),
        ("f4.npy", npy("'<f4'", false, "(7, 4)", &flat)),
        ("big.npy", npy("'>f8'", false, "(7, 4)", &doubles)),
        ("fortran.npy", npy("'<f4'", true, "(7, 4)", &columns)),
        (
            "records.npy",
            npy(
                "[('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('intensity', '<f4')]",
                false,
                "(7,)",
                &flat,
            ),
        ),
    ] {
        let (message, _) = converted(name, &content, &[]);
        check_xyz_intensity(&message, name);
        let cloud = CloudFormat::Ros2.decode(&message).expect("a cloud");
        assert_eq!((cloud.height, cloud.width), (1, POINTS as u32), "{name}");
        if name.ends_with(".pcd") {
            assert_eq!(cloud.data, pcd_points(), "{name}: every byte, padding too");
            assert_eq!(cloud.column_u32("ring").expect("ring"), [0, 1, 2, 3, 4, 5, 6], "{name}");
        }
    }
}

#[test]
fn rows_stay_rows() {
    let content = [pcd("binary", [7, 1]).as_bytes(), &pcd_points()].concat();
    let (message, _) = converted("a.pcd", &content, &[]);
    let cloud = CloudFormat::Ros2.decode(&message).expect("a cloud");
    assert_eq!((cloud.height, cloud.width), (7, 1));
    // An image of 2 x 3 pixels of x y z, the second fortran's way.
    let image: Vec<f32> = (0..18).map(|n| n as f32).collect();
    let (message, _) = converted("a.npy", &npy("'<f4'", false, "(2, 3, 3)", &bytes(&image)), &[]);
    let cloud = CloudFormat::Ros2.decode(&message).expect("a cloud");
    assert_eq!((cloud.height, cloud.width), (2, 3));
    assert_eq!(cloud.column_u32("y").expect("y"), [1, 4, 7, 10, 13, 16]);
    let turned: Vec<f32> =
        (0..18).map(|n| ((n % 2) * 9 + (n / 2 % 3) * 3 + n / 6) as f32).collect();
    let (again, _) = converted("a.npy", &npy("'<f4'", true, "(2, 3, 3)", &bytes(&turned)), &[]);
    assert_eq!(CloudFormat::Ros2.decode(&again).expect("a cloud").data, cloud.data);
}

#[test]
fn columns_have_the_names_that_are_given_and_not_a_number_is_told() {
    let (message, said) =
        converted("a.pcd.bin", &bytes(&numbers(5)), &["--columns", "x,y,z,_,ring"]);
    let cloud = CloudFormat::Ros2.decode(&message).expect("a cloud");
    let names: Vec<_> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(names, ["x", "y", "z", "ring"]);
    assert_eq!((cloud.point_step, cloud.fields[3].offset), (20, 16));
    assert!(said.contains("10 per second") && said.contains("ring f4"), "{said}");
    let mut some = numbers(5);
    some[0] = f32::NAN;
    let (message, said) = converted("a.npy", &npy("'<f4'", false, "(7, 5)", &bytes(&some)), &[]);
    assert!(!CloudFormat::Ros2.decode(&message).expect("a cloud").is_dense);
    assert!(said.contains("intensity f4, column_5 f4"), "{said}");
}

#[test]
fn what_a_message_cannot_say_is_left_out_and_told() {
    let head = "VERSION .7\nFIELDS x y z t\nSIZE 4 4 4 8\nTYPE F F F U\nWIDTH 1\nHEIGHT 1\n\
                VIEWPOINT 1 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n1 -nan 3 1531883530949817123\n";
    let (message, said) = converted("a.pcd", head.as_bytes(), &[]);
    let cloud = CloudFormat::Ros2.decode(&message).expect("a cloud");
    assert_eq!((cloud.fields.len(), cloud.point_step), (3, 20));
    assert!(said.contains("skipped: field `t`") && said.contains("viewpoint"), "{said}");
    let descr =
        "[('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('', '|V3'), ('t', '<u8'), ('n', '<f4', (2,))]";
    let (message, said) = converted("a.npy", &npy(descr, false, "(1,)", &[0; 43]), &[]);
    let cloud = CloudFormat::Ros2.decode(&message).expect("a cloud");
    assert_eq!((cloud.point_step, cloud.fields[3].offset, cloud.fields[3].count), (43, 35, 2));
    assert!(said.contains("field `t`, whose type <u8"), "{said}");
}

#[test]
fn times_come_from_names_or_a_rate() {
    let times = |names: &[&str], more: &[&str]| {
        let here = folder();
        for (number, name) in names.iter().enumerate() {
            let mut points = numbers(4);
            points[0] = 100.0 + number as f32;
            write(&here.path().join("s").join(name), bytes(&points));
        }
        let output = here.path().join("out.mcap");
        let scans = here.path().join("s");
        let arguments = ["folder", path(&scans), "-o", path(&output)];
        let (code, said, errors) = convert(&[&arguments, more].concat());
        assert_eq!(code, Some(0), "{errors}");
        let first = |data: &[u8]| {
            let cloud = CloudFormat::Ros2.decode(data).expect("a cloud");
            assert_eq!(cloud.frame_id, "lidar");
            (cloud.column_f64("x").expect("x")[0] as usize - 100, cloud.stamp_ns())
        };
        let clouds = messages(&output, "/points");
        let clouds = clouds.iter().map(|(time, data)| (first(data), *time as i64));
        let order = clouds.map(|((which, stamp), time)| {
            assert_eq!(stamp, time);
            (which, time)
        });
        (order.collect::<Vec<_>>(), said)
    };
    const S: i64 = 1_000_000_000;
    let epoch = 946_684_800 * S;
    let (found, said) = times(&["scan10.bin", "scan9.bin"], &[]);
    assert_eq!(found, [(1, epoch), (0, epoch + S / 10)]);
    assert!(said.contains("10 per second"), "{said}");
    let (found, _) = times(&["b.bin", "a.bin"], &["--rate", "20", "--start", "1000000000.5"]);
    assert_eq!(found, [(1, 1_000_000_000 * S + S / 2), (0, 1_000_000_000 * S + S / 2 + S / 20)]);
    let (found, said) = times(&["1531883530.5.bin", "1531883530.25.bin"], &[]);
    assert_eq!(found, [(1, 1_531_883_530 * S + S / 4), (0, 1_531_883_530 * S + S / 2)]);
    assert!(said.contains("times from the file names"), "{said}");
    let (found, said) = times(&["1531883530.5.bin", "1531883530.25.bin"], &["--rate", "1"]);
    assert!(found[0].1 == epoch && said.contains("1 per second"), "{said}");
}

/// A folder that cannot be converted: what is said, each part of it; nothing is written.
fn refused(files: &[(&str, Vec<u8>)], more: &[&str], parts: &[&str]) {
    let here = folder();
    let scans = here.path().join("scans");
    std::fs::create_dir_all(&scans).expect("made");
    files.iter().for_each(|(name, content)| write(&scans.join(name), content));
    let output = here.path().join("out.mcap");
    let arguments = ["folder", path(&scans), "-o", path(&output)];
    let labels = path(&scans).to_owned() + "/labels";
    let more: Vec<&str> =
        more.iter().map(|&word| if word == "LABELS" { &labels } else { word }).collect();
    let (code, said, errors) = convert(&[&arguments[..], &more].concat());
    assert_eq!((code, said.as_str()), (Some(1), ""), "{errors}");
    for part in parts {
        assert!(errors.contains(part), "`{part}` in: {errors}");
    }
    let left: Vec<_> = std::fs::read_dir(here.path()).expect("listed").collect();
    assert_eq!(left.len(), 1, "{left:?}");
}

#[test]
fn broken_folders_are_named_and_nothing_is_written() {
    let good = || bytes(&numbers(4));
    refused(&[], &[], &["no .bin, .pcd or .npy"]);
    let mixed = [("a.bin", good()), ("b.pcd", vec![]), ("c.PCD", vec![])];
    refused(&mixed, &[], &["2 problems", "1 .bin", "a.bin", "2 .pcd", "b.pcd"]);
    let short = [("a.bin", good()), ("b.bin", vec![0; 30]), ("c.bin", vec![]), ("d.bin", good())];
    refused(
        &short,
        &[],
        &["2 problems", "b.bin: 30 bytes are no multiple of 16", "c.bin: the file is empty"],
    );
    refused(&[("a.bin", good())], &["--columns", "x,y,z,i,ring"], &["a.bin", "no multiple of 20"]);
    let twice = [("1531883530.bin", good()), ("1531883530.0.bin", good())];
    refused(&twice, &[], &["are of one time"]);
    let other = [
        ("a.npy", npy("'<f4'", false, "(7, 4)", &good())),
        ("b.npy", npy("'<f4'", false, "(7, 3)", &bytes(&numbers(3)))),
    ];
    refused(&other, &[], &["b.npy: the fields x f4, y f4, z f4 where the first scan has"]);
    let late = [("a.bin", good())];
    refused(&late, &["--start", "2147483648"], &["a.bin: a time after January 2038"]);
    let pcd_file = [("a.pcd", [pcd("binary", [1, 7]).into_bytes(), pcd_points()].concat())];
    refused(&pcd_file, &["--columns", "x,y,z"], &["names its fields itself"]);
    let labelled = [
        ("a.bin", good()),
        ("b.bin", good()),
        ("labels/a.label", vec![0; 28]),
        ("labels/c.label", vec![0; 28]),
    ];
    refused(
        &labelled,
        &["--labels", "LABELS"],
        &["no b.label for b.bin", "c.label without a scan"],
    );
    let labelled = [("a.bin", good()), ("labels/a.label", vec![0; 24])];
    refused(&labelled, &["--labels", "LABELS"], &["a.label: 6 labels for 7 points"]);
    let here = folder();
    let (code, _, errors) =
        convert(&["folder", "/no/such/folder", "-o", path(&here.path().join("o"))]);
    assert!(code == Some(1) && errors.contains("/no/such/folder"), "{errors}");
    for columns in ["x,y", "x,y,z,z", "x,,y,z"] {
        assert_eq!(convert(&["folder", ".", "-o", "o", "--columns", columns]).0, Some(2));
    }
}

#[test]
fn broken_files_are_told_with_what_is_wrong() {
    let header = pcd("binary", [1, 7]);
    let with = |from: &str, to: &str| header.replace(from, to).into_bytes();
    let body = |head: String, body: &[u8]| [head.as_bytes(), body].concat();
    let pcds = [
        (vec![], "no line DATA"),
        (b"\x00\xff\xfe\n".to_vec(), "not text"),
        (with("binary", "bzip2"), "unknown encoding `bzip2`"),
        (with("FIELDS x y z", "FIELDS x y"), "6 numbers in line SIZE for 5 fields"),
        (with("FIELDS x y z _", "FIELDS x y q _"), "0 bytes of points"),
        (with("SIZE 4 4 4", "SIZE 4 4 3"), "field `z` of 1 x 3 bytes"),
        (with("SIZE 4 4 4", "SIZE 4 4 x"), "`x` in line SIZE"),
        (with("TYPE F F F", "TYPE F F Q"), "unknown type Q"),
        (with("COUNT 1 1 1", "COUNT 1 1 0"), "field `z` of 0 x 4"),
        (with("POINTS 7", "POINTS 8"), "POINTS 8 where HEIGHT x WIDTH is 1 x 7"),
        (with("HEIGHT 1", "HEIGHT 1\nHEIGHT 1"), "two lines HEIGHT"),
        (with("WIDTH 7\nHEIGHT 1", "WIDTH 99999999999\nHEIGHT 1").to_vec(), "POINTS 7 where"),
        (body(header.clone(), &pcd_points()[1..]), "146 bytes of points where the header has 147"),
        (body(header.clone(), &[pcd_points(), vec![1]].concat()), "148 bytes"),
        (body(header.replace("FIELDS x y", "FIELDS x x"), &pcd_points()), "no field `y`"),
        (body(pcd("ascii", [1, 8]), pcd_lines().as_bytes()), "7 points where the header has 8"),
        (body(pcd("ascii", [1, 6]), pcd_lines().as_bytes()), "more than the 6 points"),
        (body(pcd("ascii", [1, 1]), b"1 2 3 0 0 0 x 1\n"), "`x` is no number for `intensity`"),
        (body(pcd("ascii", [1, 1]), b"1 2 3 0 0 0 4\n"), "point 0: no number for `ring`"),
        (body(pcd("ascii", [1, 1]), b"1 2 3 0 0 0 4 65536\n"), "`65536` is no number for `ring`"),
        (body(pcd("ascii", [1, 1]), b"1 2 3 0 0 0 4 1 7\n"), "`7` behind the last"),
        (body(pcd("binary_compressed", [1, 7]), &[0; 7]), "sizes of the compressed points"),
        (
            body(pcd("binary_compressed", [1, 8]), &compressed(&pcd_columns())),
            "126 bytes of points were compressed",
        ),
        (
            body(pcd("binary_compressed", [1, 7]), &compressed(&pcd_columns())[..50]),
            "42 bytes of points where",
        ),
    ];
    let flat = bytes(&numbers(4));
    let npys = [
        (vec![], "no header"),
        (b"\x93NUMPY\x04\x00\x00\x00".to_vec(), "version 4.0"),
        (b"\x93NUMPY\x01\x00\xff\x00{".to_vec(), "ends within its header"),
        (
            npy("'<f4'", false, "(7, 4)", &flat[1..]),
            "111 bytes of numbers where the header has 112",
        ),
        (npy("'<f4'", false, "(28,)", &flat), "an array of 1 dimensions"),
        (npy("'<f4'", false, "(14, 2)", &flat), "no 3 to 1024 columns"),
        (npy("'<f2'", false, "(14, 4)", &flat), "numbers of type <f2"),
        (npy("'<i8'", false, "(7, 4)", &flat), "numbers of type <i8"),
        (npy("'|O'", false, "(7, 4)", &flat), "unknown type `|O`"),
        (
            npy("[('x', '<f4'), ('y', '>f4'), ('z', '<f4')]", false, "(7,)", &flat),
            "both byte orders",
        ),
        (npy("[('x', [('a', '<f4')])]", false, "(7,)", &flat), "a field that cannot be read"),
        (npy("'<f4'", false, "(4294967296, 4294967296, 3)", &flat), "more than a message can hold"),
        (npy("'<f4'", false, "(7, -4)", &flat), "cannot be read at"),
    ];
    let problem = |content: Vec<u8>, format: ScanFormat| match Scan::parse(content, format, None) {
        Err(Error::Malformed { problem, .. }) => problem,
        other => panic!("{other:?}"),
    };
    for (content, part) in pcds {
        let problem = problem(content, ScanFormat::Pcd);
        assert!(problem.contains(part), "`{part}` in: {problem}");
    }
    for (content, part) in npys {
        let problem = problem(content, ScanFormat::Npy);
        assert!(problem.contains(part), "`{part}` in: {problem}");
    }
}

/// Files of a sequence in which everything fits: three scans, a car of id 3 and a road.
fn sequence(folder: &Path) {
    let words: Vec<u8> = (0..POINTS as u32)
        .flat_map(|point| if point < 4 { 10_u32 | 3 << 16 } else { 40 }.to_le_bytes())
        .collect();
    for scan in 0..3 {
        write(&folder.join(format!("velodyne/{scan:06}.bin")), bytes(&numbers(4)));
        write(&folder.join(format!("labels/{scan:06}.label")), &words);
    }
    write(&folder.join("times.txt"), "0.000000e+00\n1.037359e-01\n2.073381e-01\n");
    write(&folder.join("calib.txt"), format!("P0: {CAMERA}\nP2: {CAMERA}\nTr: {TR}\n"));
    // Camera 0 goes 2 m ahead and then turns to the right by a quarter.
    let poses = "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 2\n0 0 1 0 0 1 0 0 -1 0 0 2\n";
    write(&folder.join("poses.txt"), poses);
}

const CAMERA: &str = "700 0 600 45 0 700 180 0.5 0 0 1 0.003";

/// The scanner's x is the camera's z, its y the camera's -x, its z the camera's -y; it sits 0.25 m
/// behind.
const TR: &str = "0 -1 0 0 0 0 -1 0 1 0 0 -0.25";

fn kitti(arguments: &[&str]) -> (Option<i32>, String, String) {
    convert(&[&["semantickitti"], arguments].concat())
}

/// Stamp, frames, translation and quaternion of a TFMessage of one transform.
fn transform(data: &[u8]) -> (i64, String, String, [f64; 7]) {
    let mut cdr = RosReader::cdr("TFMessage", data).expect("a message");
    assert_eq!(cdr.u32().expect("length"), 1);
    let stamp =
        i64::from(cdr.i32().expect("s")) * 1_000_000_000 + i64::from(cdr.u32().expect("ns"));
    let frames = [(); 2].map(|()| cdr.string().expect("a frame"));
    let numbers = [(); 7].map(|()| cdr.f64().expect("a number"));
    assert_eq!(cdr.remaining(), 0);
    let [parent, child] = frames;
    (stamp, parent, child, numbers)
}

fn close(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9)
}

#[test]
fn a_sequence_becomes_a_recording() {
    let here = folder();
    let root = here.path().join("dataset");
    sequence(&root.join("sequences/04"));
    let output = here.path().join("04.mcap");
    let (code, said, errors) = kitti(&[path(&root), "-o", path(&output), "--labels"]);
    assert_eq!((code, errors.as_str()), (Some(0), ""));
    assert!(
        said.contains("3 clouds with 21 points, from sequence 04 on /velodyne_points"),
        "{said}"
    );

    const EPOCH: u64 = 946_684_800_000_000_000;
    let times = [0, 103_735_900, 207_338_100].map(|time| EPOCH + time);
    let clouds = messages(&output, "/velodyne_points");
    assert_eq!(clouds.iter().map(|(time, _)| *time).collect::<Vec<_>>(), times);
    for (time, data) in &clouds {
        check_xyz_intensity(data, "04");
        let cloud = CloudFormat::Ros2.decode(data).expect("a cloud");
        assert_eq!((cloud.stamp_ns() as u64, cloud.frame_id.as_str()), (*time, "velodyne"));
        assert_eq!(cloud.column_u32("label").expect("label"), [10, 10, 10, 10, 40, 40, 40]);
        assert_eq!(cloud.column_u32("true_instance").expect("id"), [3, 3, 3, 3, 0, 0, 0]);
    }
    let poses: Vec<_> = messages(&output, "/tf").iter().map(|(_, data)| transform(data)).collect();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // The camera began at x = 0.25 and went 2 m; 0.25 m behind it, when it looks to the right, is
    // to the left.
    let expected = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        [2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        [2.25, 0.25, 0.0, 0.0, 0.0, -half, half],
    ];
    assert_eq!(poses.len(), 3);
    for ((pose, expected), time) in poses.iter().zip(expected).zip(times) {
        assert_eq!((pose.0 as u64, pose.1.as_str(), pose.2.as_str()), (time, "map", "velodyne"));
        let found = pose.3.map(|number| number + 0.0);
        // A quaternion and its negative are one rotation.
        let sign = if found[6] < 0.0 { -1.0 } else { 1.0 };
        let turned: Vec<f64> = found[3..].iter().map(|number| sign * number).collect();
        assert!(close(&[&found[..3], &turned].concat(), &expected), "{found:?}");
    }
    let fixed = messages(&output, "/tf_static");
    assert_eq!(fixed.len(), 1);
    let (stamp, parent, child, pose) = transform(&fixed[0].1);
    assert_eq!((stamp as u64, parent.as_str(), child.as_str()), (EPOCH, "velodyne", "camera_0"));
    assert!(close(&pose[..3], &[0.25, 0.0, 0.0]), "{pose:?}");
    let overview = Overview::read(&output).expect("a recording");
    let topics: Vec<_> = overview.channels.values().map(|channel| channel.topic.as_str()).collect();
    assert_eq!(overview.profile, "ros2");
    assert!(
        topics.contains(&"/camera_2/camera_info") && !topics.contains(&"/camera_1/camera_info")
    );
    check_extras(&output, &root.join("sequences/04/calib.txt"));

    // Without labels, from the sequence's own folder: the same points.
    let bare = here.path().join("bare.mcap");
    let own = root.join("sequences/04");
    let (code, said, errors) = kitti(&[path(&own), "-o", path(&bare), "--compression", "none"]);
    assert!(code == Some(0) && said.contains("sequence 04"), "{said}{errors}");
    let clouds = messages(&bare, "/velodyne_points");
    assert_eq!(CloudFormat::Ros2.decode(&clouds[2].1).expect("a cloud").data, bytes(&numbers(4)));
    let again = here.path().join("again.mcap");
    kitti(&[path(&own), "-o", path(&again), "--compression", "none"]);
    assert!(std::fs::read(&bare).expect("read") == std::fs::read(&again).expect("read"));
}

/// The attachment and the metadata record.
fn check_extras(recording: &Path, calibration: &Path) {
    let mut reader = RecordingReader::open(recording).expect("a recording");
    let (mut attached, mut noted) = (0, 0);
    while let Some(record) = reader.next_record().expect("a record") {
        match record {
            Record::Attachment { header, data } => {
                assert_eq!(header.name, "calib.txt");
                assert_eq!(*data, std::fs::read(calibration).expect("calib.txt"));
                attached += 1;
            }
            Record::Metadata(metadata) => {
                assert_eq!(metadata.name, "divmerge_convert");
                let said = |key: &str| metadata.metadata[key].clone();
                assert_eq!(
                    [said("sequence"), said("frames"), said("poses")],
                    ["04", "3", "poses.txt"]
                );
                assert_eq!(said("labels"), "label, true_instance");
                noted += 1;
            }
            _ => {}
        }
    }
    assert_eq!((attached, noted), (1, 1));
}

#[test]
fn what_a_sequence_lacks_is_said() {
    let here = folder();
    let output = here.path().join("o.mcap");
    let run = |change: &dyn Fn(&Path)| {
        let own = here.path().join("00");
        let _ = std::fs::remove_dir_all(&own);
        sequence(&own);
        change(&own);
        let (code, _, errors) = kitti(&[path(&own), "-o", path(&output), "--force"]);
        assert_eq!(code, Some(0), "{errors}");
        let overview = Overview::read(&output).expect("a recording");
        let topics = overview.channels.values().map(|channel| channel.topic.clone());
        (errors, topics.collect::<Vec<_>>(), messages(&output, "/velodyne_points")[1].0)
    };
    let remove =
        |name: &'static str| move |own: &Path| std::fs::remove_file(own.join(name)).expect("gone");
    let (errors, topics, second) = run(&remove("times.txt"));
    assert!(errors.contains("no times.txt: ten scans a second instead"), "{errors}");
    assert!(second % 1_000_000_000 == 100_000_000 && topics.contains(&"/tf".to_owned()));
    let (errors, topics, _) = run(&remove("poses.txt"));
    assert!(errors.contains("no poses.txt: no /tf"), "{errors}");
    assert!(!topics.contains(&"/tf".to_owned()) && topics.contains(&"/tf_static".to_owned()));
    let (errors, topics, _) = run(&remove("calib.txt"));
    assert!(errors.contains("no calib.txt") && topics == ["/velodyne_points"], "{errors}");
    let (errors, topics, _) = run(&|own| write(&own.join("calib.txt"), format!("P0: {CAMERA}\n")));
    assert!(errors.contains("no Tr in calib.txt: no /tf"), "{errors}");
    assert_eq!(topics, ["/velodyne_points", "/camera_0/camera_info"]);
    let (errors, ..) = run(&|own| write(&own.join("times.txt"), "0\n1\n2\n3\n"));
    assert!(errors.contains("times.txt has 4 lines for 3 scans"), "{errors}");
}

#[test]
fn what_does_not_fit_is_named_and_nothing_is_written() {
    let here = folder();
    let own = here.path().join("00");
    let refused = |more: &[&str], parts: &[&str], change: &dyn Fn(&Path)| {
        let _ = std::fs::remove_dir_all(&own);
        sequence(&own);
        change(&own);
        let output = here.path().join("o.mcap");
        let (code, said, errors) = kitti(&[&[path(&own), "-o", path(&output)], more].concat());
        assert_eq!((code, said.as_str()), (Some(1), ""), "{errors}");
        for part in parts {
            assert!(errors.contains(part), "`{part}` in: {errors}");
        }
        assert_eq!(std::fs::read_dir(here.path()).expect("listed").count(), 1, "{errors}");
    };
    let remove = |file: PathBuf| std::fs::remove_file(file).expect("gone");
    refused(&[], &["1 problem:", "velodyne/000001.bin is missing"], &|own| {
        remove(own.join("velodyne/000001.bin"));
    });
    refused(
        &[],
        &["3 problems", "scan.bin is no scan", "000002.bin: 111 bytes", "000003.bin to 000006.bin"],
        &|own| {
            write(&own.join("velodyne/scan.bin"), "");
            write(&own.join("velodyne/000002.bin"), [0; 111]);
            write(&own.join("velodyne/000007.bin"), bytes(&numbers(4)));
            write(&own.join("poses.txt"), format!("{TR}\n").repeat(4));
            write(&own.join("times.txt"), "0\n1\n2\n3\n");
        },
    );
    let labels = [
        "000000.label is missing",
        "000001.label: 24 bytes where the scan's 7 points need 28",
        "000009.label belongs to no scan",
    ];
    refused(&["--labels"], &labels, &|own| {
        remove(own.join("labels/000000.label"));
        write(&own.join("labels/000001.label"), [0; 24]);
        write(&own.join("labels/000009.label"), [0; 28]);
    });
    refused(&["--labels"], &["no folder", "labels"], &|own| {
        std::fs::remove_dir_all(own.join("labels")).expect("gone");
    });
    refused(&["--labels"], &["000001.label: class 7 (7 points) is not in taxonomy"], &|own| {
        write(&own.join("labels/000001.label"), [7_u8, 0, 0, 0].repeat(7));
    });
    refused(
        &[],
        &["2 problems", "poses.txt has 2 lines for 3 scans", "times.txt: line 2: `x`"],
        &|own| {
            write(&own.join("poses.txt"), format!("{TR}\n{TR}\n"));
            write(&own.join("times.txt"), "0\nx\n2\n");
        },
    );
    refused(&[], &["poses.txt: line 1: 3 numbers", "calib.txt: line 1 has no colon"], &|own| {
        write(&own.join("poses.txt"), "1 2 3\n");
        write(&own.join("calib.txt"), "P0\n");
    });
    refused(
        &["--predictions", "/no/such"],
        &["no folder /no/such/sequences/00/predictions"],
        &|_| {},
    );
}

#[test]
fn several_sequences_go_to_a_folder() {
    let here = folder();
    let root = here.path().join("dataset");
    ["00", "07", "11"].iter().for_each(|name| sequence(&root.join("sequences").join(name)));
    let (code, _, errors) = kitti(&[path(&root), "-o", path(&here.path().join("o.mcap"))]);
    assert!(code == Some(1) && errors.contains("sequences 00, 07, 11"), "{errors}");
    let out = format!("{}/out/", path(here.path()));
    let (code, said, errors) = kitti(&[path(&root), "-o", &out, "--sequence", "00,11"]);
    assert!(code == Some(0) && said.contains("out/11.mcap"), "{said}{errors}");
    assert!(!Path::new(&out).join("07.mcap").exists());
    let (code, _, errors) = kitti(&[path(&root), "-o", &out]);
    assert!(code == Some(1) && errors.contains("00.mcap exists; use --force"), "{errors}");
    let (code, _, errors) = kitti(&[path(&root), "-o", &out, "--sequence", "05"]);
    assert!(
        code == Some(1) && errors.contains("no sequence 05 with scans; sequences: 00, 07, 11"),
        "{errors}"
    );
    let (code, _, errors) = kitti(&[path(&here.path().join("out")), "-o", &out]);
    assert!(code == Some(1) && errors.contains("no sequences/NN/velodyne"), "{errors}");
    // One that does not fit keeps all from being written.
    std::fs::remove_file(root.join("sequences/07/velodyne/000000.bin")).expect("gone");
    let (code, _, errors) = kitti(&[path(&root), "-o", &out, "--force", "--sequence", "07,11"]);
    assert!(code == Some(1) && errors.contains("000000.bin is missing"), "{errors}");
}

/// From sequences to label files and back, predictions of another method with them.
#[test]
fn labels_come_back_and_go_to_their_sequences() {
    let here = folder();
    let (root, network) = (here.path().join("dataset"), here.path().join("network"));
    for name in ["11", "12"] {
        sequence(&root.join("sequences").join(name));
        for scan in 0..3 {
            let file = format!("sequences/{name}/predictions/{scan:06}.label");
            write(&network.join(file), [18_u8, 0, 2, 0].repeat(POINTS));
        }
    }
    let out = format!("{}/out/", path(here.path()));
    let more = ["-o", &out, "--labels", "--predictions", path(&network)];
    let (code, _, errors) = kitti(&[&[path(&root)], &more[..]].concat());
    assert_eq!((code, errors.as_str()), (Some(0), ""));
    let recordings = ["11", "12"].map(|name| format!("{out}{name}.mcap"));
    let mine = here.path().join("mine");
    let fields = |class: &'static str, instance: &'static str| {
        ["--topic", "/velodyne_points", "--class-field", class, "--instance-field", instance]
    };
    let export = |arguments: &[&str]| {
        let done = divmerge(&[&["export"], arguments].concat());
        (done.status.code(), text(&done.stdout) + &text(&done.stderr))
    };
    let both = [&recordings[0][..], &recordings[1], "--root", path(&mine)];
    let (code, said) = export(&[&both, &fields("label", "true_instance")[..]].concat());
    assert_eq!(code, Some(0), "{said}");
    let same = |of: &Path, kind: &str| {
        for file in ["11/X/000000.label", "12/X/000002.label"] {
            let found = mine.join("sequences").join(file.replace('X', "predictions"));
            let expected = of.join("sequences").join(file.replace('X', kind));
            assert_eq!(
                std::fs::read(found).expect("found"),
                std::fs::read(expected).expect("there")
            );
        }
    };
    same(&root, "labels");
    let again = [&both, &fields("predicted_label", "predicted_instance")[..]].concat();
    let (code, said) = export(&again);
    assert!(code == Some(1) && said.contains("000000.label exists; use --force"), "{said}");
    assert_eq!(export(&[&again, &["--force"][..]].concat()).0, Some(0));
    same(&network, "predictions");
    write(&mine.join("sequences/11/predictions/000003.label"), "");
    let (code, said) = export(&[&again, &["--force"][..]].concat());
    assert!(code == Some(1) && said.contains("000003.label belongs to none"), "{said}");

    // Two of one sequence, one folder for two, a recording that does not say, a name that leads
    // elsewhere.
    let one = &recordings[0][..];
    let labels = fields("label", "true_instance");
    let (code, said) = export(&[&[one, one, "--root", path(&mine)], &labels[..]].concat());
    assert!(code == Some(1) && said.contains("both of sequence 11"), "{said}");
    let (code, said) = export(&[&[one, one, "--labels", path(&mine)], &labels[..]].concat());
    assert!(code == Some(1) && said.contains("use --root"), "{said}");
    let (_drive, drive) = crate::recordings::drive(1);
    let of_drive = [path(&drive), "--root", path(&mine), "--topic", "/lidar/points"];
    let (code, said) = export(&of_drive);
    assert!(code == Some(1) && said.contains("say --sequence"), "{said}");
    let (code, said) = export(&[&of_drive, &["--sequence", "../x"][..]].concat());
    assert!(code == Some(1) && said.contains("`../x` cannot be the name"), "{said}");
    assert_eq!(export(&[one]).0, Some(2));
    assert_eq!(export(&["--root", path(&mine)]).0, Some(2));
}

#[test]
fn real_labels_come_back_byte_by_byte() {
    let Some(data) = shared_data() else { return };
    let (root, here) = (data.join("semantickitti"), folder());
    let out = format!("{}/", path(here.path()));
    let (code, _, errors) = kitti(&[path(&root), "-o", &out, "--labels", "--compression", "lz4"]);
    assert_eq!(code, Some(0), "{errors}");
    let mut scans = 0;
    for scan in divmerge::io::semantic_kitti::labelled_scans(&root).expect("sequences") {
        let number = scan.scan.file_stem().and_then(|stem| stem.to_str()).expect("a number");
        let number: u64 = number.parse().expect("a number");
        let recording = here.path().join(format!("{}.mcap", scan.sequence));
        let message =
            CloudMessages::open(&recording, None, number..=number).expect("a topic").next();
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
    for scan in divmerge::io::semantic_kitti::labelled_scans(&root).expect("sequences") {
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
            (pcd("binary_compressed", shape).into_bytes(), compressed(&pcd_columns()), ScanFormat::Pcd),
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
