//! Sequences in SemanticKITTI's layout.

use std::path::{Path, PathBuf};

use divmerge::messages::clouds::CloudFormat;
use divmerge::messages::ros::RosReader;
use divmerge::recording::{Overview, Record, RecordingReader};

use super::{POINTS, bytes, check_xyz_intensity, convert, folder, messages, numbers, write};
use crate::cli::{divmerge, path, text};

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

pub(super) fn kitti(arguments: &[&str]) -> (Option<i32>, String, String) {
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
    check_transforms(&output, times);
    let overview = Overview::read(&output).expect("a recording");
    let topics: Vec<_> = overview.channels.values().map(|channel| channel.topic.as_str()).collect();
    assert_eq!(overview.profile, "ros2");
    assert!(
        topics.contains(&"/camera_2/camera_info") && !topics.contains(&"/camera_1/camera_info")
    );
    check_extras(&output, &root.join("sequences/04/calib.txt"));
}

/// The scanner's poses in the map, and the camera's on the scanner.
fn check_transforms(recording: &Path, times: [u64; 3]) {
    let poses: Vec<_> =
        messages(recording, "/tf").iter().map(|(_, data)| transform(data)).collect();
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
    let fixed = messages(recording, "/tf_static");
    assert_eq!(fixed.len(), 1);
    let (stamp, parent, child, pose) = transform(&fixed[0].1);
    assert_eq!((stamp as u64, parent.as_str(), child.as_str()), (times[0], "velodyne", "camera_0"));
    assert!(close(&pose[..3], &[0.25, 0.0, 0.0]), "{pose:?}");
}

#[test]
fn the_folder_of_one_sequence_gives_the_same_points() {
    let here = folder();
    let own = here.path().join("sequences/04");
    sequence(&own);
    let bare = here.path().join("bare.mcap");
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
            Record::Attachment { header, data, .. } => {
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

/// Checks that a sequence, once it is changed, is refused with words, and that nothing is written.
fn refused(more: &[&str], parts: &[&str], change: impl Fn(&Path)) {
    let here = folder();
    let own = here.path().join("00");
    sequence(&own);
    change(&own);
    let output = here.path().join("o.mcap");
    let (code, said, errors) = kitti(&[&[path(&own), "-o", path(&output)], more].concat());
    assert_eq!((code, said.as_str()), (Some(1), ""), "{errors}");
    for part in parts {
        assert!(errors.contains(part), "`{part}` in: {errors}");
    }
    assert_eq!(std::fs::read_dir(here.path()).expect("listed").count(), 1, "{errors}");
}

fn remove(file: PathBuf) {
    std::fs::remove_file(file).expect("gone");
}

#[test]
fn scans_poses_and_times_that_do_not_fit_are_named_and_nothing_is_written() {
    refused(&[], &["1 problem:", "velodyne/000001.bin is missing"], |own| {
        remove(own.join("velodyne/000001.bin"));
    });
    refused(
        &[],
        &["3 problems", "scan.bin is no scan", "000002.bin: 111 bytes", "000003.bin to 000006.bin"],
        |own| {
            write(&own.join("velodyne/scan.bin"), "");
            write(&own.join("velodyne/000002.bin"), [0; 111]);
            write(&own.join("velodyne/000007.bin"), bytes(&numbers(4)));
            write(&own.join("poses.txt"), format!("{TR}\n").repeat(4));
            write(&own.join("times.txt"), "0\n1\n2\n3\n");
        },
    );
    refused(
        &[],
        &["2 problems", "poses.txt has 2 lines for 3 scans", "times.txt: line 2: `x`"],
        |own| {
            write(&own.join("poses.txt"), format!("{TR}\n{TR}\n"));
            write(&own.join("times.txt"), "0\nx\n2\n");
        },
    );
    refused(&[], &["poses.txt: line 1: 3 numbers", "calib.txt: line 1 has no colon"], |own| {
        write(&own.join("poses.txt"), "1 2 3\n");
        write(&own.join("calib.txt"), "P0\n");
    });
}

#[test]
fn labels_that_do_not_fit_are_named_and_nothing_is_written() {
    let labels = [
        "000000.label is missing",
        "000001.label: 24 bytes where the scan's 7 points need 28",
        "000009.label belongs to no scan",
    ];
    refused(&["--labels"], &labels, |own| {
        remove(own.join("labels/000000.label"));
        write(&own.join("labels/000001.label"), [0; 24]);
        write(&own.join("labels/000009.label"), [0; 28]);
    });
    refused(&["--labels"], &["no folder", "labels"], |own| {
        std::fs::remove_dir_all(own.join("labels")).expect("gone");
    });
    refused(&["--labels"], &["000001.label: class 7 (7 points) is not in taxonomy"], |own| {
        write(&own.join("labels/000001.label"), [7_u8, 0, 0, 0].repeat(7));
    });
    refused(
        &["--predictions", "/no/such"],
        &["no folder /no/such/sequences/00/predictions"],
        |_| {},
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
    assert!(code == Some(2) && errors.contains("00.mcap exists; use --force"), "{errors}");
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
/// Recordings of the sequences 11 and 12 with labels and predictions, in a folder with both.
fn labelled(here: &Path) -> [String; 2] {
    let (root, network) = (here.join("dataset"), here.join("network"));
    for name in ["11", "12"] {
        sequence(&root.join("sequences").join(name));
        for scan in 0..3 {
            let file = format!("sequences/{name}/predictions/{scan:06}.label");
            write(&network.join(file), [18_u8, 0, 2, 0].repeat(POINTS));
        }
    }
    let out = format!("{}/out/", path(here));
    let more = ["-o", &out, "--labels", "--predictions", path(&network)];
    let (code, _, errors) = kitti(&[&[path(&root)], &more[..]].concat());
    assert_eq!((code, errors.as_str()), (Some(0), ""));
    ["11", "12"].map(|name| format!("{out}{name}.mcap"))
}

fn fields(class: &'static str, instance: &'static str) -> [&'static str; 6] {
    ["--topic", "/velodyne_points", "--class-field", class, "--instance-field", instance]
}

fn export(arguments: &[&str]) -> (Option<i32>, String) {
    let done = divmerge(&[&["export"], arguments].concat());
    (done.status.code(), text(&done.stdout) + &text(&done.stderr))
}

#[test]
fn labels_come_back_and_go_to_their_sequences() {
    let here = folder();
    let recordings = labelled(here.path());
    let (root, network) = (here.path().join("dataset"), here.path().join("network"));
    let mine = here.path().join("mine");
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
    assert!(code == Some(2) && said.contains("000000.label exists; use --force"), "{said}");
    assert_eq!(export(&[&again, &["--force"][..]].concat()).0, Some(0));
    same(&network, "predictions");
    write(&mine.join("sequences/11/predictions/000003.label"), "");
    let (code, said) = export(&[&again, &["--force"][..]].concat());
    assert!(code == Some(1) && said.contains("000003.label belongs to none"), "{said}");
}

/// Two of one sequence, one folder for two, a recording that names none, a name that leads
/// elsewhere.
#[test]
fn an_export_without_a_place_of_its_own_is_refused() {
    let here = folder();
    let recordings = labelled(here.path());
    let mine = here.path().join("mine");
    let one = &recordings[0][..];
    let labels = fields("label", "true_instance");
    let (code, said) = export(&[&[one, one, "--root", path(&mine)], &labels[..]].concat());
    assert!(code == Some(2) && said.contains("both sequence 11"), "{said}");
    let (code, said) = export(&[&[one, one, "--labels", path(&mine)], &labels[..]].concat());
    assert!(code == Some(2) && said.contains("use --root"), "{said}");
    let (_drive, drive) = crate::recordings::drive(1);
    let of_drive = [path(&drive), "--root", path(&mine), "--topic", "/lidar/points"];
    let (code, said) = export(&of_drive);
    assert!(code == Some(2) && said.contains("give --sequence"), "{said}");
    let (code, said) = export(&[&of_drive, &["--sequence", "../x"][..]].concat());
    assert!(code == Some(1) && said.contains("`../x` is not a valid name"), "{said}");
    assert_eq!(export(&[one]).0, Some(2));
    assert_eq!(export(&["--root", path(&mine)]).0, Some(2));
}
