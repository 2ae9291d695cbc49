//! What `annotate` takes and gives besides one file: several files, bags, standard input and
//! output.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use divmerge::datasets::cloud_recording::CloudRecording;
use divmerge::datasets::drive::cloud_message;
use divmerge::messages::clouds::CloudFormat;
use divmerge::recording::{Overview, Record, RecordingWriter, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};
use tempfile::TempDir;

use crate::cli::{divmerge, path, text};
use crate::recordings::{assert_passed_through, drive, records};

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().into_string().expect("UTF-8")).collect();
    names.sort();
    names
}

/// A folder with drives of one to three frames: a.mcap, b.mcap, c.mcap.
fn drives() -> (TempDir, Vec<PathBuf>) {
    let folder = tempfile::tempdir().expect("a folder");
    let copy = |(frames, name)| {
        let to = folder.path().join(name);
        std::fs::copy(drive(frames).1, &to).expect("copied");
        to
    };
    let drives = [(1, "a.mcap"), (2, "b.mcap"), (3, "c.mcap")].into_iter().map(copy).collect();
    (folder, drives)
}

#[test]
fn several_recordings_in_one_call() {
    let (folder, drives) = drives();
    let out = folder.path().join("out");
    let mut arguments = vec!["annotate"];
    arguments.extend(drives.iter().map(|drive| path(drive)));
    arguments.extend(["--no-layout", "-o", path(&out)]);
    let done = divmerge(&arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains("annotated 3 of 3 recordings"), "{}", text(&done.stdout));
    assert_eq!(names(&out), ["a.mcap", "b.mcap", "c.mcap"]);
    for drive in &drives {
        assert_passed_through(drive, &out.join(drive.file_name().expect("a name")));
    }

    // One that is broken does not keep the others from it, and the exit code says so.
    std::fs::write(&drives[1], b"no recording").expect("written");
    arguments.push("--force");
    arguments.push("--json");
    std::fs::remove_file(out.join("b.mcap")).expect("removed");
    let done = divmerge(&arguments);
    assert_eq!(done.status.code(), Some(1));
    let said = text(&done.stderr);
    assert!(said.contains("b.mcap: not an MCAP") && said.contains("not annotated: "), "{said}");
    let reports: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert_eq!(reports.as_array().map(Vec::len), Some(2));
    assert_eq!(names(&out), ["a.mcap", "c.mcap"]);
}

#[test]
fn two_recordings_of_one_name_are_refused() {
    let (folder, drives) = drives();
    let other = tempfile::tempdir().expect("a folder");
    let twin = other.path().join("a.mcap");
    std::fs::copy(&drives[0], &twin).expect("copied");
    let out = folder.path().join("out");
    let refused = divmerge(&["annotate", path(&drives[0]), path(&twin), "-o", path(&out)]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        text(&refused.stderr).contains("would both be written to"),
        "{}",
        text(&refused.stderr)
    );
    assert!(!out.exists());
    let refused = divmerge(&["annotate", path(&drives[0]), path(&twin), "-o", path(&drives[2])]);
    assert!(text(&refused.stderr).contains("need a folder as output"), "{}", text(&refused.stderr));
    let refused = divmerge(&["annotate", "-", path(&twin), "-o", path(&out)]);
    assert!(text(&refused.stderr).contains("on its own"), "{}", text(&refused.stderr));
}

fn yaml(path: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(path).expect("a file");
    serde_saphyr::from_str(&text).expect("YAML")
}

/// The metadata of a bag of two files as rosbag2 writes them, with counts that are wrong.
fn bag_metadata() -> String {
    let entry = |name: &str, type_name: &str| {
        format!(
            "    - topic_metadata:\n        name: {name}\n        type: {type_name}\n        \
             serialization_format: cdr\n        offered_qos_profiles:\n          - history: \
             keep_last\n            \
             depth: 5\n        type_description_hash: RIHS01_aa\n      message_count: 99\n"
        )
    };
    let file = |name: &str| {
        format!(
            "    - path: {name}\n      starting_time:\n        nanoseconds_since_epoch: 1\n      \
             duration:\n        nanoseconds: 2\n      message_count: 3\n"
        )
    };
    format!(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: \
         mcap\n  duration:\n    nanoseconds: 4\n  \
         starting_time:\n    nanoseconds_since_epoch: 5\n  message_count: \
         6\n  topics_with_message_count:\n{}{}  \
         compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - \
         bag_0.mcap\n    - \
         bag_1.mcap\n  files:\n{}{}  custom_data: ~\n  ros_distro: rolling\n",
        entry("/lidar/points", "sensor_msgs/msg/PointCloud2"),
        entry("/tf", "tf2_msgs/msg/TFMessage"),
        file("bag_0.mcap"),
        file("bag_1.mcap"),
    )
}

#[test]
fn a_split_bag_comes_out_as_one() {
    let (folder, drives) = drives();
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).expect("a folder");
    for (from, to) in drives[1..].iter().zip(["bag_0.mcap", "bag_1.mcap"]) {
        std::fs::copy(from, bag.join(to)).expect("copied");
    }
    let metadata = bag_metadata();
    std::fs::write(bag.join("metadata.yaml"), &metadata).expect("written");
    let out = folder.path().join("annotated");
    let done = divmerge(&["annotate", path(&bag), "-o", path(&out)]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let layouts = ["bag_0.layout.json", "bag_1.layout.json"];
    assert_eq!(names(&out), [layouts[0], "bag_0.mcap", layouts[1], "bag_1.mcap", "metadata.yaml"]);
    assert_eq!(std::fs::read_to_string(bag.join("metadata.yaml")).expect("it"), metadata);
    check_joined_slices(&bag, &out, folder.path());
    check_bag_metadata(&out);

    // Not twice, and not without its metadata.
    assert_eq!(divmerge(&["annotate", path(&bag), "-o", path(&out)]).status.code(), Some(2));
    std::fs::remove_file(bag.join("metadata.yaml")).expect("removed");
    let refused = divmerge(&["annotate", path(&bag), "-o", path(&out), "--force"]);
    assert!(text(&refused.stderr).contains("has no metadata.yaml"), "{}", text(&refused.stderr));
}

/// Annotates a bag in two slices; joined, they are what one run made of it.
fn check_joined_slices(bag: &Path, annotated: &Path, here: &Path) {
    let [plan, slices, joined] = ["plan.json", "slices", "joined"].map(|n| here.join(n));
    divmerge(&["plan", path(bag), "--shards", "2", "-o", path(&plan)]);
    for number in 0..2 {
        divmerge(&[
            "annotate",
            "--slice",
            &format!("{}:{number}", path(&plan)),
            "-o",
            path(&slices),
        ]);
    }
    let done = divmerge(&["join", path(&slices), "--plan", path(&plan), "-o", path(&joined)]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert_eq!(names(&joined), names(annotated));
    for name in names(annotated) {
        let [ours, theirs] = [&joined, annotated].map(|folder| std::fs::read(folder.join(&name)));
        assert!(ours.expect("joined") == theirs.expect("annotated"), "{name}");
    }
}

/// The metadata written for an annotated bag have its own counts, and entries for what was added.
fn check_bag_metadata(annotated: &Path) {
    let made = yaml(&annotated.join("metadata.yaml"));
    let made = &made["rosbag2_bagfile_information"];
    assert_eq!((&made["version"], &made["ros_distro"]), (&9.into(), &"rolling".into()));
    let overviews = ["bag_0.mcap", "bag_1.mcap"]
        .map(|name| Overview::read(&annotated.join(name)).expect("whole"));
    for (file, overview) in made["files"].as_array().expect("files").iter().zip(&overviews) {
        assert_eq!(file["message_count"], overview.message_count);
        assert_eq!(
            file["path"],
            overview.path.file_name().and_then(|name| name.to_str()).expect("a name")
        );
    }
    let all: u64 = overviews.iter().map(|overview| overview.message_count).sum();
    assert_eq!(made["message_count"], all);
    let topics = made["topics_with_message_count"].as_array().expect("topics");
    let topic = |name: &str| {
        let entry = topics.iter().find(|entry| entry["topic_metadata"]["name"] == name);
        entry.unwrap_or_else(|| panic!("no entry of {name}"))
    };
    for name in ["/lidar/points", "/lidar/points/instances", "/lidar/points/objects"] {
        assert_eq!(topic(name)["message_count"], 5);
        assert_eq!(topic(name)["topic_metadata"]["offered_qos_profiles"][0]["depth"], 5);
    }
    let objects = &topic("/lidar/points/objects")["topic_metadata"];
    assert_eq!(objects["type"], "visualization_msgs/msg/MarkerArray");
    assert_eq!(objects["type_description_hash"], "");
}

/// The binary with pipes to all its streams.
fn piped(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_divmerge"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs")
}

#[test]
fn from_standard_input_to_standard_output() {
    let (folder, input) = drive(6);
    let bytes = std::fs::read(&input).expect("bytes");
    let feed = |bytes: Vec<u8>| {
        let mut child = piped(&["annotate", "-", "-o", "-"]);
        let mut stdin = child.stdin.take().expect("a pipe");
        let feeding = std::thread::spawn(move || stdin.write_all(&bytes));
        let output = child.wait_with_output().expect("it ends");
        let _ = feeding.join();
        output
    };
    let done = feed(bytes.clone());
    let said = text(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "{said}");
    assert!(said.contains("/lidar/points: 6 frames") && said.contains("wrote -"), "{said}");
    let output = folder.path().join("out.mcap");
    std::fs::write(&output, &done.stdout).expect("written");
    assert_passed_through(&input, &output);
    let overview = Overview::read(&output).expect("a recording");
    assert!(overview.from_summary && overview.is_complete);
    let made = records(&output).into_iter().find_map(|record| match record {
        Record::Metadata(metadata) if metadata.name == "divmerge" => Some(metadata.metadata),
        _ => None,
    });
    assert_eq!(made.expect("a metadata record")["input_sha256"].len(), 64);

    let done = feed(bytes[..bytes.len() * 2 / 3].to_vec());
    let said = text(&done.stderr);
    assert_eq!(done.status.code(), Some(3), "{said}");
    assert!(said.contains("cut off"), "{said}");
    std::fs::write(&output, &done.stdout).expect("written");
    assert!(Overview::read(&output).expect("a whole recording").is_complete);

    let done = feed(b"#ROSBAG V2.0\n".to_vec());
    assert_eq!(done.status.code(), Some(1));
    assert!(text(&done.stderr).contains("ROS 1 bag"), "{}", text(&done.stderr));
    assert!(done.stdout.is_empty());
}

/// It comes in pieces, and the message behind it is read as if it had come whole.
#[test]
fn a_large_attachment_of_a_stream_is_copied() {
    let folder = tempfile::tempdir().expect("a folder");
    let frame = Drive::new(Sensor::Vlp16, Scene::Street, 1).frame(0);
    let (time, mut cloud) = (frame.stamp_ns, Vec::new());
    cloud_message(&frame, &mut cloud).expect("a cloud");
    for beside in [0, 50, 1 << 20] {
        let attached: Vec<u8> =
            (0..(5 << 19) - beside).map(|i| (i as u32).wrapping_mul(0x9E37_79B9) as u8).collect();
        let input = folder.path().join(format!("{beside}.mcap"));
        let options = WriteOptions::default();
        let mut recording =
            CloudRecording::create(CloudFormat::Ros2, &input, "/points", &options).expect("begun");
        recording.attach_text("map.pcd", time, &attached).expect("attached");
        recording.write_cloud(time, &cloud).expect("written");
        recording.finish().expect("finished");
        let bytes = std::fs::read(&input).expect("bytes");
        let mut child = piped(&["annotate", "-", "-o", "-"]);
        let mut stdin = child.stdin.take().expect("a pipe");
        let feeding = std::thread::spawn(move || stdin.write_all(&bytes));
        let done = child.wait_with_output().expect("it ends");
        feeding.join().expect("no panic").expect("all is read");
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        let output = folder.path().join("out.mcap");
        std::fs::write(&output, &done.stdout).expect("written");
        assert_passed_through(&input, &output);
    }
}

/// The pipe stays open and nothing comes: only Ctrl-C can end this.
#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_run_that_waits_for_its_input() {
    let (folder, input) = drive(6);
    let bytes = std::fs::read(&input).expect("bytes");
    let out = tempfile::tempdir().expect("a folder");
    let output = out.path().join("out.mcap");
    let mut child = piped(&["annotate", "-", "-o", path(&output)]);
    let mut stdin = child.stdin.take().expect("a pipe");
    stdin.write_all(&bytes[..bytes.len() / 2]).expect("written");
    // It has begun as soon as its output is there.
    while names(out.path()).is_empty() {
        std::thread::yield_now();
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.expect("kill").success());
    let ended = child.wait_with_output().expect("it ends");
    drop(stdin);
    let said = text(&ended.stderr);
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(!output.exists());
    for left in names(out.path()) {
        assert!(said.contains(&left), "{left} was left, but not told: {said}");
    }
    drop(folder);
}

#[test]
fn what_cannot_be_read_is_named_with_what_converts_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.mcap");
    for (bytes, words) in [
        (&b"#ROSBAG V2.0\n"[..], "mcap convert"),
        (b"SQLite format 3\0", "mcap convert"),
        (b"\xd4\xc3\xb2\xa1\x02\0\x04\0", "ros2 bag record -s mcap"),
        (b"\x0a\x0d\x0d\x0a\x1c\0\0\0", "ros2 bag record -s mcap"),
    ] {
        let input = folder.path().join("input");
        std::fs::write(&input, bytes).expect("written");
        let refused = divmerge(&["annotate", path(&input), "-o", path(&out)]);
        assert!(text(&refused.stderr).contains(words), "{}", text(&refused.stderr));
    }
}

/// Two channels are added to each cloud topic, and a recording has at most 65,535.
#[test]
fn more_topics_than_channels_are_refused_with_the_file_and_a_way_out() {
    const TOPICS: usize = 40_000;
    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("many.mcap");
    let mut writer = RecordingWriter::create(&input, &WriteOptions::default()).expect("a writer");
    let schema = writer.add_schema("sensor_msgs/msg/PointCloud2", "ros2msg", b"").expect("one");
    for topic in 0..TOPICS {
        let topic = format!("/points{topic}");
        writer.add_channel(&topic, schema, "cdr", &BTreeMap::new()).expect("a channel");
    }
    writer.finish().expect("written");
    let output = folder.path().join("out.mcap");
    let annotate = |more: &[&str]| {
        divmerge(&[&["annotate", path(&input), "-o", path(&output), "--no-layout"], more].concat())
    };
    let done = annotate(&[]);
    let error = text(&done.stderr);
    assert_eq!(done.status.code(), Some(1), "{error}");
    for part in [path(&input), "40,000 channels", "40,000 cloud topics", "65,535", "--topic T"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    assert_eq!(names(folder.path()), ["many.mcap"]);
    let done = annotate(&["--topic", "/points7", "--topic", "/points39999"]);
    assert!(output.exists(), "{}", text(&done.stderr));
}
