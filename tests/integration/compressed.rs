//! Recordings that are compressed as a whole, or message by message, as rosbag2 does; and what
//! `info` shows of folders.

use std::path::{Path, PathBuf};

use divmerge::recording::{Overview, Record, RecordingReader, RecordingWriter, WriteOptions};

use crate::cli::{divmerge, path, text};
use crate::recordings::{drive, messages};

fn compressed(bytes: &[u8]) -> Vec<u8> {
    zstd::bulk::compress(bytes, 1).expect("compressed")
}

/// Messages with the topics that they are on.
fn by_topic(path: &Path) -> Vec<(String, u64, Vec<u8>)> {
    let overview = Overview::read(path).expect("a recording");
    let of = |(header, data): (divmerge::recording::MessageHeader, Vec<u8>)| {
        (overview.channels[&header.channel_id].topic.clone(), header.log_time, data)
    };
    let mut all: Vec<_> = messages(path).into_iter().map(of).collect();
    all.sort();
    all
}

fn metadata(mode: &str, file: &str) -> String {
    format!(
        "rosbag2_bagfile_information:\n  version: 6\n  storage_identifier: mcap\n  duration:\n    \
         nanoseconds: 4\n  starting_time:\n    nanoseconds_since_epoch: 5\n  message_count: 6\n  \
         topics_with_message_count: []\n  compression_format: zstd\n  compression_mode: {mode}\n  \
         relative_file_paths:\n    - {file}\n"
    )
}

/// The drive, annotated as it is.
fn plain(input: &Path) -> Vec<(String, u64, Vec<u8>)> {
    let output = input.with_extension("plain.mcap");
    let done = divmerge(&["annotate", path(input), "-o", path(&output), "--no-layout"]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    by_topic(&output)
}

/// Annotates a bag and returns what it is told and where the recording is.
fn annotate_bag(bag: &Path, name: &str) -> (String, PathBuf) {
    let out = bag.with_extension("out");
    let done = divmerge(&["annotate", path(bag), "-o", path(&out), "--no-layout"]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let metadata = std::fs::read_to_string(out.join("metadata.yaml")).expect("metadata");
    let metadata: serde_json::Value = serde_saphyr::from_str(&metadata).expect("YAML");
    let information = &metadata["rosbag2_bagfile_information"];
    assert_eq!(information["compression_mode"], "");
    assert_eq!(information["compression_format"], "");
    assert_eq!(information["relative_file_paths"][0], name);
    (text(&done.stderr), out.join(name))
}

#[test]
fn a_compressed_recording_is_unpacked_as_it_is_read() {
    let (folder, input) = drive(3);
    let whole = compressed(&std::fs::read(&input).expect("bytes"));
    let packed = folder.path().join("drive.mcap.zst");
    std::fs::write(&packed, &whole).expect("written");
    let output = folder.path().join("out.mcap");
    let base = ["annotate", path(&packed), "-o", path(&output), "--no-layout", "--force"];
    let done = divmerge(&base);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(by_topic(&output) == plain(&input));
    let info = divmerge(&["info", path(&packed)]);
    assert_eq!(info.status.code(), Some(0), "{}", text(&info.stderr));
    assert!(text(&info.stdout).contains("/lidar/points"), "{}", text(&info.stdout));

    // One that is cut off is annotated as far as it goes.
    std::fs::write(&packed, &whole[..whole.len() * 2 / 3]).expect("written");
    assert_eq!(divmerge(&base).status.code(), Some(3));
    assert_eq!(divmerge(&["info", path(&packed)]).status.code(), Some(3));

    // By another name it is not taken for a recording, and is told how.
    let other = folder.path().join("drive.mcap");
    std::fs::write(&other, &whole).expect("written");
    let refused = divmerge(&["info", path(&other)]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("FILE.mcap.zst"), "{}", text(&refused.stderr));
}

#[test]
fn a_bag_of_compressed_files_comes_out_plain() {
    let (folder, input) = drive(2);
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).expect("a folder");
    let file = compressed(&std::fs::read(&input).expect("bytes"));
    std::fs::write(bag.join("bag_0.mcap.zstd"), file).expect("written");
    std::fs::write(bag.join("metadata.yaml"), metadata("FILE", "bag_0.mcap.zstd")).expect("it");
    let (_, output) = annotate_bag(&bag, "bag_0.mcap");
    assert!(by_topic(&output) == plain(&input));
    let info = divmerge(&["info", path(&bag)]);
    assert!(text(&info.stdout).contains("bag_0.mcap.zstd"), "{}", text(&info.stderr));
}

#[test]
fn a_bag_of_compressed_messages_comes_out_plain() {
    let (folder, input) = drive(2);
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).expect("a folder");
    let file = bag.join("bag_0.mcap");
    let mut writer = RecordingWriter::create(&file, &WriteOptions::default()).expect("a writer");
    let mut reader = RecordingReader::open(&input).expect("a recording");
    while let Some(record) = reader.next_record().expect("a record") {
        match record {
            Record::Message { header, data, .. } => {
                writer.write_message(&header, &compressed(&data)).expect("a message");
            }
            other => writer.copy(&other).expect("copied"),
        }
    }
    writer.finish().expect("finished");
    std::fs::write(bag.join("metadata.yaml"), metadata("MESSAGE", "bag_0.mcap")).expect("it");
    let (said, output) = annotate_bag(&bag, "bag_0.mcap");
    assert!(said.contains("compressed each by itself"), "{said}");
    assert!(by_topic(&output) == plain(&input));
    let info = divmerge(&["info", path(&bag)]);
    assert_eq!(info.status.code(), Some(0), "{}", text(&info.stderr));
    assert!(text(&info.stdout).contains("returns"), "{}", text(&info.stdout));
}

#[test]
fn info_shows_every_recording_of_a_folder() {
    let (folder, input) = drive(1);
    std::fs::copy(&input, folder.path().join("a.mcap")).expect("copied");
    let info = divmerge(&["info", path(folder.path())]);
    assert_eq!(info.status.code(), Some(0), "{}", text(&info.stderr));
    let said = text(&info.stdout);
    assert!(said.find("a.mcap").expect("a") < said.find("drive.mcap").expect("drive"), "{said}");
    let json = divmerge(&["info", path(folder.path()), "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert_eq!(json.as_array().map(Vec::len), Some(2));
    let empty = tempfile::tempdir().expect("a folder");
    let refused = divmerge(&["info", path(empty.path())]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("no .mcap file"), "{}", text(&refused.stderr));
}
