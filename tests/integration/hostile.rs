//! What stands in a recording does no harm: wild coordinates, names that command a terminal.

use std::fs::OpenOptions;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use divmerge::comparison::methods;
use divmerge::datasets::cloud_recording::CloudRecording;
use divmerge::messages::clouds::{CloudFormat, CloudMessage, Datatype, PointField};
use divmerge::pipeline::{self, Config};
use divmerge::recording::WriteOptions;
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};
use tempfile::TempDir;

use crate::cli::{divmerge, path, text};
use crate::recordings::drive;

/// A sweep, and behind it the same a half farther away.
fn doubled() -> PointCloud {
    let cloud = Drive::new(Sensor::Vlp16, Scene::Street, 3).frame(0).cloud.into_columns();
    let both = |near: &[f32]| near.iter().copied().chain(near.iter().map(|x| x * 1.5)).collect();
    PointCloud::new(both(&cloud.x), both(&cloud.y), both(&cloud.z)).expect("columns that fit")
}

#[test]
fn instances_may_have_shadowed_points_alone() {
    let (cloud, ground) = (doubled(), GroundParams::default());
    let mut unseen = 0;
    for name in methods::NAMES {
        let other_method = methods::named(name, &Taxonomy::semantic_kitti());
        let config = Config { other_method, ..Config::best() };
        let stages = pipeline::run(&cloud, MaskSource::NotGround(&ground), &config);
        let last = stages.labels.instance.iter().copied().max().unwrap_or(0);
        assert!(last as usize <= stages.instances.len(), "{name}");
        unseen += stages.instances.iter().filter(|instance| instance.pixels == 0).count();
    }
    assert!(unseen > 0, "no instance without a pixel");
}

/// A recording of one cloud of some points.
pub fn recording(topic: &str, frame_id: &str, points: &[[f32; 3]]) -> (TempDir, PathBuf) {
    let field = |(name, offset): (&str, u32)| PointField {
        name: name.into(),
        offset,
        datatype: Datatype::Float32,
        count: 1,
    };
    let data: Vec<u8> = points.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let cloud = CloudMessage {
        frame_id: frame_id.into(),
        height: 1,
        width: points.len() as u32,
        fields: [("x", 0), ("y", 4), ("z", 8)].map(field).to_vec(),
        point_step: 12,
        row_step: data.len() as u32,
        data: (&*data).into(),
        is_dense: true,
        ..CloudMessage::default()
    };
    let mut message = Vec::new();
    cloud.encode(&mut message).expect("sizes that agree");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("in.mcap");
    let options = WriteOptions::default();
    let mut recording =
        CloudRecording::create(CloudFormat::Ros2, &path, topic, &options).expect("a recording");
    recording.write_cloud(7, &message).expect("a cloud");
    recording.finish().expect("an end");
    (folder, path)
}

fn street() -> Vec<[f32; 3]> {
    let cloud = Drive::new(Sensor::Vlp16, Scene::Street, 3).frame(0).cloud;
    (0..cloud.len()).map(|point| cloud.position(point)).collect()
}

/// How places that are no numbers show in an SVG.
const WILD: [&str; 6] = ["\"NaN", ",NaN", " NaN", "\"inf", ",inf", ",-inf"];

#[test]
fn wild_coordinates_are_drawn() {
    let mut points = street();
    for (number, point) in points.iter_mut().enumerate().filter(|(number, _)| number % 7 == 0) {
        let far = 10_f32.powi(2 + (number % 36) as i32);
        *point = point.map(|along| along.signum() * far);
    }
    let (folder, input) = recording("/points", "lidar", &points);
    for method in ["", "paper", "euclidean"] {
        for name in ["figure.png", "figure.svg"] {
            let output = folder.path().join(format!("{method}{name}"));
            let mut arguments = vec!["figure", path(&input), "-o", path(&output)];
            match method {
                "" => {}
                "paper" => arguments.extend(["--preset", "paper"]),
                method => arguments.extend(["--method", method]),
            }
            let done = divmerge(&arguments);
            assert_eq!(done.status.code(), Some(0), "{method} {name}: {}", text(&done.stderr));
            let bytes = std::fs::read(&output).expect("a figure");
            if name.ends_with("svg") {
                let svg = text(&bytes);
                assert!(!WILD.iter().any(|wild| svg.contains(wild)), "{method}");
            }
        }
    }
}

#[test]
fn clouds_at_one_far_place_are_drawn() {
    for far in [1e9_f32, 1e19, -f32::MAX / 2.0] {
        let points: Vec<[f32; 3]> = (0..64).map(|row| [far, far, row as f32 * 0.1]).collect();
        let (folder, input) = recording("/points", "lidar", &points);
        let output = folder.path().join("figure.svg");
        // A part of the image is drawn without the sensor.
        let drawn = ["--window", "0..100000", "--panels", "bev,votes", "--method", "euclidean"];
        let arguments = [&["figure", path(&input), "-o", path(&output)][..], &drawn].concat();
        let done = divmerge(&arguments);
        assert_eq!(done.status.code(), Some(0), "{far}: {}", text(&done.stderr));
        let svg = text(&std::fs::read(&output).expect("a figure"));
        assert!(!WILD.iter().any(|wild| svg.contains(wild)), "{far}");
    }
}

#[test]
fn nothing_that_commands_a_terminal_is_printed() {
    let (topic, frame_id) = ("/p\u{1b}[2J\u{1b}]52;c;ZXZpbA==\u{7}\u{9b}\u{202e}", "-fr\u{1b}[31m");
    let (folder, input) = recording(topic, frame_id, &street());
    let output = folder.path().join("out.mcap");
    let missing = ["info", "/\u{1b}[2J.mcap"];
    let commands: [&[&str]; 8] = [
        &["info", path(&input)],
        &["info", path(&input), "--json"],
        &["annotate", path(&input), "-o", path(&output)],
        &["triage", path(&input)],
        &["explain", path(&input), "--instance", "1"],
        &["figure", path(&input), "--topic", "/q\u{1b}", "-o", "no.png"],
        &["annotate", path(&input), "--preset", "\u{1b}[2J", "-o", path(&output)],
        &missing,
    ];
    for command in commands {
        let done = divmerge(command);
        let said = text(&done.stdout) + &text(&done.stderr);
        assert!(!said.is_empty(), "{command:?}");
        let commands = |c: char| (c.is_control() && c != '\n' && c != '\t') || c == '\u{202e}';
        assert!(!said.contains(commands), "{command:?}: {said:?}");
    }
}

/// Runs a command on a full standard output.
#[cfg(target_os = "linux")]
fn on_a_full_disk(arguments: &[&str]) -> Output {
    let full = OpenOptions::new().write(true).open("/dev/full").expect("a full device");
    let mut command = Command::new(env!("CARGO_BIN_EXE_divmerge"));
    command.args(arguments).stdout(Stdio::from(full)).output().expect("the binary runs")
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_output_is_an_error() {
    let (folder, input) = drive(1);
    for arguments in [&["info", path(&input)][..], &["annotate", path(&input), "-o", "-"]] {
        let done = on_a_full_disk(arguments);
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(1), "{said}");
        assert!(said.contains("writing to standard output: No space left"), "{said}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
}

#[test]
#[cfg(unix)]
fn a_recording_whose_reader_goes_away_ends_quietly() {
    let (folder, input) = drive(8);
    let mut running = Command::new(env!("CARGO_BIN_EXE_divmerge"))
        .args(["annotate", path(&input), "-o", "-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    // As `head -c 100`.
    let mut head = [0; 100];
    let mut pipe = running.stdout.take().expect("a pipe");
    pipe.read_exact(&mut head).expect("bytes");
    drop(pipe);
    let done = running.wait_with_output().expect("an end");
    assert!(head.starts_with(b"\x89MCAP0\r\n"));
    assert_eq!(text(&done.stderr), "");
    assert_eq!(done.status.code(), Some(141));
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
}
