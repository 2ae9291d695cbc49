//! Where mutation starts: messages and files as they should be, small.
//!
//! Messages come from the simulator and, where there is a folder `../shared/data` beside the
//! checkout, from the real recordings in it, thinned to a few hundred points.

use std::path::Path;

use divmerge::cloud::UprightBox;
use divmerge::datasets::drive;
use divmerge::messages::clouds::CloudFormat;
use divmerge::messages::objects::{ObjectBox, ObjectEncoding, ObjectKind};
use divmerge::messages::ros::{ByteOrder, Layout};
use divmerge::recording::{Record, RecordingReader};
use divmerge::simulate::{Drive, Scene, Sensor};

/// Rows and columns that a thinned cloud has at most.
const SIDE: usize = 16;

/// PointCloud2 messages of ROS 2, little and big endian.
pub fn clouds() -> Vec<Vec<u8>> {
    clouds_of(CloudFormat::Ros2)
}

/// Cloud messages of a format, of either byte order where it has one.
pub fn clouds_of(format: CloudFormat) -> Vec<Vec<u8>> {
    let mut clouds = Vec::new();
    for sensor in [Sensor::Vlp16, Sensor::Hdl64e, Sensor::Os1_128] {
        let frame = Drive::new(sensor, Scene::Parking, 1).frame(0);
        let mut message = Vec::new();
        drive::cloud_message(&frame, &mut message).expect("a message");
        clouds.extend(thinned(&message, format, ByteOrder::Little));
        clouds.extend(thinned(&message, format, ByteOrder::Big));
    }
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/recordings");
    let mut files: Vec<_> =
        std::fs::read_dir(shared).into_iter().flatten().flatten().map(|file| file.path()).collect();
    files.sort();
    for file in files {
        for message in messages(&file) {
            clouds.extend(thinned(&message, format, ByteOrder::Little));
        }
    }
    clouds
}

/// The first few messages of a recording that read as clouds.
fn messages(file: &Path) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    let Ok(mut reader) = RecordingReader::open(file) else { return found };
    while let (true, Ok(Some(record))) = (found.len() < 6, reader.next_record()) {
        if let Record::Message { data, .. } = record
            && CloudFormat::Ros2.decode(&data).is_ok()
        {
            found.push(data.into_owned());
        }
    }
    found
}

/// A ROS 2 cloud with at most [`SIDE`] x [`SIDE`] of its points, evenly taken, in another format.
fn thinned(message: &[u8], format: CloudFormat, order: ByteOrder) -> Option<Vec<u8>> {
    let mut cloud = CloudFormat::Ros2.decode(message).ok()?;
    let points: Vec<&[u8]> = cloud.points().collect();
    let (height, width) = (cloud.height as usize, cloud.width as usize);
    let (rows, columns) = match height {
        0 | 1 => (1, width.min(SIDE * SIDE)),
        _ => (height.min(SIDE), width.min(SIDE)),
    };
    let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    let data: Vec<u8> = places
        .flat_map(|(row, column)| points[row * height / rows * width + column * width / columns])
        .copied()
        .collect();
    (cloud.height, cloud.width) = (rows as u32, columns as u32);
    cloud.row_step = cloud.width * cloud.point_step;
    cloud.data = data.into();
    let mut cloud = cloud.reformatted(format).ok()?;
    cloud.byte_order = order;
    let mut out = Vec::new();
    cloud.encode(&mut out).ok()?;
    Some(out)
}

/// MarkerArrays of no, one and several boxes.
pub fn markers() -> Vec<Vec<u8>> {
    let boxes: Vec<ObjectBox> = (1..5)
        .map(|id| ObjectBox {
            id,
            is_track: false,
            velocity: None,
            pose: UprightBox::new([f64::from(id), 2.0, 0.5], [4.0, 1.8, 1.5], 0.3).pose(),
            size: [4.0, 1.8, 1.5],
            class: 10,
            name: "car".to_owned(),
            probability: 1.0,
            title: format!("{id} car"),
            points: 9,
            is_object: true,
        })
        .collect();
    let layouts = [Layout::Cdr(ByteOrder::Little), Layout::Cdr(ByteOrder::Big)];
    let array = |layout: Layout, count: usize| {
        let mut out = Vec::new();
        let encoding = ObjectEncoding::Ros(layout);
        let header = (5, 6, "lidar");
        ObjectKind::Markers.write(encoding, header, &boxes[..count], &mut out).expect("markers");
        out
    };
    layouts.into_iter().flat_map(|layout| [0, 1, 4].map(|count| array(layout, count))).collect()
}

/// A Detection3DArray of two boxes with a hypothesis each.
pub fn detections() -> Vec<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut writer =
        divmerge::messages::ros::RosWriter::new(Layout::Cdr(ByteOrder::Little), &mut bytes);
    writer.header((5, 6, "lidar"));
    writer.length(2);
    for number in 0..2 {
        writer.header((5, 6, "lidar"));
        writer.length(1);
        writer.string("car");
        writer.f64(0.9);
        let pose = [1.0, 2.0, 0.5, 0.0, 0.0, 0.0, 1.0];
        pose.into_iter().for_each(|value| writer.f64(value));
        (0..36).for_each(|_| writer.f64(0.0));
        pose.into_iter().for_each(|value| writer.f64(value));
        [4.0, 1.8, 1.5].into_iter().for_each(|value| writer.f64(value));
        writer.string(&format!("{number}"));
    }
    vec![bytes]
}

/// Images of classes: of both ROS, one and two bytes a pixel.
pub fn class_images() -> Vec<Vec<u8>> {
    let image = |layout: Layout, encoding: &str, bytes: u32| {
        let mut out = Vec::new();
        let mut writer = divmerge::messages::ros::RosWriter::new(layout, &mut out);
        writer.header((5, 6, "lidar"));
        writer.u32(4);
        writer.u32(6);
        writer.string(encoding);
        writer.bool(false);
        writer.u32(6 * bytes);
        writer.length(24 * bytes as usize);
        writer.bytes(&vec![10; 24 * bytes as usize]);
        out
    };
    let layouts = [Layout::Ros1, Layout::Cdr(ByteOrder::Little), Layout::Cdr(ByteOrder::Big)];
    let both = |layout| [image(layout, "mono8", 1), image(layout, "16UC1", 2)];
    layouts.into_iter().flat_map(both).collect()
}

/// Arrays of classes and of scores, for five points.
pub fn class_arrays() -> Vec<Vec<u8>> {
    let file = |descr: &str, shape: &str, bytes: usize| {
        let header =
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let length = (header.len() as u16).to_le_bytes();
        let data = vec![0; bytes];
        [b"\x93NUMPY\x01\x00".as_slice(), &length, header.as_bytes(), &data].concat()
    };
    vec![
        file("<i8", "(5,)", 40),
        file("<u2", "(5, 1)", 10),
        file(">f4", "(5, 20)", 400),
        file("|u1", "(5,)", 5),
    ]
}

/// Configurations of networks.
pub fn network_configs() -> Vec<Vec<u8>> {
    let text = "backbone: {input_depth: {range: True, xyz: True, remission: \
        False}}\ndataset:\n  sensor:\n    fov_up: 3\n    \
                fov_down: -25.0\n    img_prop: {width: 64, height: 16}\n    img_means: [1, 2, 3, \
                4, 0.5]\n    img_stds: \
                [1, 1, 1, 1, 0.1]\npost: {KNN: {use: True, params: {knn: 5, search: 5, sigma: 1.0, \
                cutoff: 1.0}}}\n\
                labels: {0: none, 10: car}\nlearning_map: {0: 0, 10: 1}\nlearning_map_inv: {0: 0, \
                1: 10}\n";
    vec![text.as_bytes().to_vec()]
}

/// PCD files: text and bytes, and a compressed one of a single literal run.
pub fn pcd_files() -> Vec<Vec<u8>> {
    let header = |data: &str, points: usize| {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity ring\nSIZE 4 4 4 4 2\nTYPE F F F F \
             U\n\
             COUNT 1 1 1 1 1\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS \
             {points}\nDATA {data}\n"
        )
    };
    let text = header("ascii", 3) + "1 2 3 0.5 1\n-1.5 2e1 nan 0.25 2\n0 0 0 0 3\n";
    let point = [1.0_f32, 2.0, 3.0, 0.5].map(f32::to_le_bytes).concat();
    let points = [point.as_slice(), &[7, 0], &point, &[8, 0]].concat();
    let binary = [header("binary", 2).as_bytes(), &points].concat();
    // LZF: a control byte below 32 announces that many literal bytes and one.
    let packed: Vec<u8> =
        points.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
    let sizes = [packed.len() as u32, points.len() as u32].map(u32::to_le_bytes).concat();
    let compressed = [header("binary_compressed", 2).as_bytes(), &sizes, &packed].concat();
    vec![text.into_bytes(), binary, compressed]
}

/// Numpy files: N x 4, H x W x 3, big endian, fastest index first, and records.
pub fn npy_files() -> Vec<Vec<u8>> {
    let file = |header: &str, bytes: usize| {
        let mut text = header.to_owned();
        while !(10 + text.len() + 1).is_multiple_of(64) {
            text.push(' ');
        }
        text.push('\n');
        let length = (text.len() as u16).to_le_bytes();
        [b"\x93NUMPY\x01\x00".as_slice(), &length, text.as_bytes(), &vec![0x3f; bytes]].concat()
    };
    vec![
        file("{'descr': '<f4', 'fortran_order': False, 'shape': (5, 4), }", 80),
        file("{'descr': '>f8', 'fortran_order': False, 'shape': (2, 3, 3), }", 144),
        file("{'descr': '<f4', 'fortran_order': True, 'shape': (4, 3), }", 48),
        file(
            "{'descr': [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('n', '<f4', (3,)), ('ring', \
             '<u2')], 'fortran_order': False, 'shape': (2, 2), }",
            104,
        ),
    ]
}

/// KITTI's text files: boxes, both calibrations, poses, times.
pub fn kitti_files() -> Vec<Vec<u8>> {
    let matrix = "1 0 0 0.1 0 1 0 0.2 0 0 1 0.3";
    [
        "Car 0.00 0 -1.57 599.41 156.40 629.75 189.25 2.85 2.63 12.34 0.47 1.49 69.44 -1.56\n\
         DontCare -1 -1 -10 503.89 169.71 590.61 190.13 -1 -1 -1 -1000 -1000 -1000 -10\n\
         Pedestrian 0.00 1 0.2 1 2 3 4 1.7 0.5 0.6 1 1.5 8 0.1 0.93\n"
            .to_owned(),
        format!("R0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: {matrix}\n"),
        format!("P0: {matrix}\nP1: {matrix}\nP2: {matrix}\nP3: {matrix}\nTr: {matrix}\n"),
        format!("{matrix}\n{matrix}\n"),
        "0.000000e+00\n1.037875e-01\n2.0e-01\n".to_owned(),
    ]
    .map(String::into_bytes)
    .to_vec()
}

/// Taxonomies in the form of semantic-kitti-api.
pub fn taxonomies() -> Vec<Vec<u8>> {
    let full = "labels:\n  0: unlabeled\n  10: car\n  30: person\n  252: \
        moving-car\nlearning_map:\n  0: 0\n  \
                10: 1\n  30: 2\n  252: 1\nlearning_map_inv:\n  0: 0\n  1: 10\n  2: \
                30\nlearning_ignore:\n  0: \
                true\n  1: false\nthing_class:\n  1: true\n  2: true\n";
    vec![full.as_bytes().to_vec(), b"labels: {1: car, 2: \"road\"}\n".to_vec()]
}
