//! Folders of `.bin`, `.pcd` and `.npy` files.

use divmerge::datasets::scans::{Scan, ScanFormat};
use divmerge::error::FrameError;
use divmerge::messages::clouds::CloudFormat;

use super::{
    POINTS, bytes, check_xyz_intensity, convert, converted, folder, messages, numbers, write,
};
use crate::cli::path;

/// The header of a .pcd file of x y z intensity and a ring, with padding between.
pub(super) fn pcd(encoding: &str, shape: [usize; 2]) -> String {
    let [height, width] = shape;
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z _ intensity ring\n\
         SIZE 4 4 4 1 4 2\nTYPE F F F U F U\nCOUNT 1 1 1 3 1 1\nWIDTH {width}\nHEIGHT {height}\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {encoding}\n",
        height * width
    )
}

/// The points of such a file as bytes, 21 each.
pub(super) fn pcd_points() -> Vec<u8> {
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

pub(super) fn compressed(fields: &[u8]) -> Vec<u8> {
    let packed = stored(fields);
    let sizes = [packed.len() as u32, fields.len() as u32].map(u32::to_le_bytes).concat();
    [sizes, packed].concat()
}

/// The points field by field, padding left out.
pub(super) fn pcd_columns() -> Vec<u8> {
    let points = pcd_points();
    let column = |range: std::ops::Range<usize>| {
        points.chunks(21).flat_map(move |point| point[range.clone()].to_vec()).collect::<Vec<_>>()
    };
    [column(0..4), column(4..8), column(8..12), column(15..19), column(19..21)].concat()
}

pub(super) fn pcd_lines() -> String {
    let points = numbers(4);
    let line = |(number, p): (usize, &[f32])| {
        format!("{} {} {} 0 0 0 {} {number}\n", p[0], p[1], p[2], p[3])
    };
    points.chunks(4).enumerate().map(line).collect()
}

pub(super) fn npy(descr: &str, is_fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let fortran = if is_fortran { "True" } else { "False" };
    let header = format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}");
    let header = format!("{header:<117}\n");
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
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
        &[
            "2 problems",
            "b.bin: malformed scan: 30 bytes are no multiple of 16",
            "c.bin: malformed scan: the file is empty",
        ],
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

/// Checks that each content is malformed, and what is said of it.
fn malformed(contents: &[(Vec<u8>, &str)], format: ScanFormat) {
    for (content, part) in contents {
        match Scan::parse(content.clone(), format, None) {
            Err(FrameError::Malformed { problem, .. }) => {
                assert!(problem.contains(part), "`{part}` in: {problem}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn broken_pcd_files_are_told_with_what_is_wrong() {
    let header = pcd("binary", [1, 7]);
    let with = |from: &str, to: &str| header.replace(from, to).into_bytes();
    let body = |head: String, body: &[u8]| [head.as_bytes(), body].concat();
    malformed(
        &[
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
            (
                body(header.clone(), &pcd_points()[1..]),
                "146 bytes of points where the header has 147",
            ),
            (body(header.clone(), &[pcd_points(), vec![1]].concat()), "148 bytes"),
            (body(header.replace("FIELDS x y", "FIELDS x x"), &pcd_points()), "no field `y`"),
            (body(pcd("ascii", [1, 8]), pcd_lines().as_bytes()), "7 points where the header has 8"),
            (body(pcd("ascii", [1, 6]), pcd_lines().as_bytes()), "more than the 6 points"),
            (body(pcd("ascii", [1, 1]), b"1 2 3 0 0 0 x 1\n"), "`x` is no number for `intensity`"),
            (body(pcd("ascii", [1, 1]), b"1 2 3 0 0 0 4\n"), "point 0: no number for `ring`"),
            (
                body(pcd("ascii", [1, 1]), b"1 2 3 0 0 0 4 65536\n"),
                "`65536` is no number for `ring`",
            ),
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
        ],
        ScanFormat::Pcd,
    );
}

#[test]
fn broken_npy_files_are_told_with_what_is_wrong() {
    let flat = bytes(&numbers(4));
    malformed(
        &[
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
            (
                npy("'<f4'", false, "(4294967296, 4294967296, 3)", &flat),
                "more than a message can hold",
            ),
            (npy("'<f4'", false, "(7, -4)", &flat), "cannot be read at"),
        ],
        ScanFormat::Npy,
    );
}
