//! Folders of rosbag2: recordings with a `metadata.yaml` beside them, and the same file for
//! recordings made from them.
//!
//! The file is read and written as a tree of values, so that what a version of the format has
//! besides (4 to 9 are in use) is kept as it is: quality of service as text or as a table, hashes
//! of types, custom data, the name of the distribution.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use divmerge_recording::Overview;
use serde_json::{Map, Value, json};

use crate::datasets::yaml;
use crate::error::{Error, Result};

/// Name of the file that makes a folder a bag.
pub const METADATA_FILE: &str = "metadata.yaml";

const ROOT: &str = "rosbag2_bagfile_information";

/// A folder of recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Bag {
    /// The folder.
    pub folder: PathBuf,
    /// Names of its recordings in their order.
    pub files: Vec<String>,
    information: Map<String, Value>,
}

impl Bag {
    /// Reads the folder's `metadata.yaml`.
    ///
    /// # Errors
    /// [`Error::Bag`] if the folder has none, it cannot be read, or its recordings are of another
    /// format, with what to do then.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(METADATA_FILE);
        let problem = |problem: String| Error::Bag { path: path.clone(), problem };
        let text = std::fs::read_to_string(&path).map_err(|error| problem(error.to_string()))?;
        let root = yaml::parse(&text).map_err(|error| problem(format!("not YAML: {error}")))?;
        let information = root.get(ROOT).and_then(Value::as_object).cloned();
        let Some(information) = information else {
            return Err(problem(format!("no table `{ROOT}` in it")));
        };
        refuse_other_formats(folder, &information).map_err(problem)?;
        let files = files(&information).map_err(problem)?;
        Ok(Bag { folder: folder.to_owned(), files, information })
    }

    /// The text of `metadata.yaml` for recordings that were made of this bag's, a file of the same
    /// name each: counts, times and topics are those of the new recordings. A topic that was added
    /// has the entry of the topic whose name it begins with, under its own name and type.
    pub fn metadata_of(&self, recordings: &[Overview]) -> String {
        let mut information = self.information.clone();
        let mut set = |key: &str, value: Value| information.insert(key.to_owned(), value);
        let names: Vec<Value> = recordings.iter().map(|made| json!(name_of(made))).collect();
        set("relative_file_paths", names.into());
        set("message_count", json!(recordings.iter().map(|made| made.message_count).sum::<u64>()));
        let (start, duration) = span(recordings);
        set("starting_time", json!({ "nanoseconds_since_epoch": start }));
        set("duration", json!({ "nanoseconds": duration }));
        set("topics_with_message_count", self.topics(recordings).into());
        if self.is_compressed() {
            // Files and messages are unpacked as they are read.
            set("compression_format", json!(""));
            set("compression_mode", json!(""));
        }
        if information.contains_key("files") {
            let files: Vec<Value> = recordings.iter().map(file_entry).collect();
            information.insert("files".to_owned(), files.into());
        }
        yaml::text(&json!({ ROOT: information }))
    }

    /// Whether its files or messages are compressed by rosbag2.
    fn is_compressed(&self) -> bool {
        let mode = self.information.get("compression_mode").and_then(Value::as_str);
        mode.is_some_and(|mode| !mode.is_empty() && !mode.eq_ignore_ascii_case("none"))
    }

    /// The name of what is made of one of its recordings: without the end of a compressed one.
    pub fn unpacked_name(file: &str) -> &str {
        file.strip_suffix(".zst").or_else(|| file.strip_suffix(".zstd")).unwrap_or(file)
    }

    /// Entries of the topics that there are: those of the bag in their order, and then the new
    /// ones.
    fn topics(&self, recordings: &[Overview]) -> Vec<Value> {
        let counts = counts(recordings);
        let listed = self.information.get("topics_with_message_count").and_then(Value::as_array);
        let listed: Vec<&Value> = listed.into_iter().flatten().collect();
        let known: BTreeSet<&str> = listed.iter().filter_map(|entry| name(entry)).collect();
        let kept = listed.iter().filter_map(|entry| {
            let (_, count) = counts.get(name(entry)?)?;
            Some(entry_with(entry, "message_count", json!(count)))
        });
        let new = counts.iter().filter(|(topic, _)| !known.contains(topic.as_str()));
        let new = new.map(|(topic, (type_name, count))| {
            let parent = listed.iter().filter(|entry| {
                name(entry)
                    .and_then(|parent| topic.strip_prefix(parent))
                    .is_some_and(|rest| rest.starts_with('/'))
            });
            let template = parent.max_by_key(|entry| name(entry).map(str::len));
            new_entry(template.copied(), topic, type_name, *count)
        });
        kept.chain(new).collect()
    }
}

/// Refuses a bag that is not a set of MCAP files, with what to do instead.
fn refuse_other_formats(
    folder: &Path,
    information: &Map<String, Value>,
) -> std::result::Result<(), String> {
    let text = |key: &str| information.get(key).and_then(Value::as_str).unwrap_or_default();
    let mode = text("compression_mode").to_ascii_lowercase();
    match (text("storage_identifier"), mode.as_str(), text("compression_format")) {
        ("mcap", "file" | "message", "zstd") | ("mcap", "" | "none", _) => Ok(()),
        ("mcap", mode, format) => Err(format!(
            "its compression is `{format}` (mode `{mode}`), which cannot be read here, only \
             `zstd`; `ros2 bag convert` writes the recording without"
        )),
        (other, ..) => Err(format!(
            "its recordings are of storage `{other}`, not `mcap`; convert the bag first: `ros2 bag \
             convert -i {} -o convert.yaml` with `output_bags: [{{uri: OUT, storage_id: mcap, all: \
             true}}]` in convert.yaml, or `mcap convert FILE.db3 OUT.mcap`",
            folder.display()
        )),
    }
}

fn files(information: &Map<String, Value>) -> std::result::Result<Vec<String>, String> {
    let names = information.get("relative_file_paths").and_then(Value::as_array);
    let names = names.into_iter().flatten().filter_map(Value::as_str);
    let names: Vec<String> = names.map(str::to_owned).collect();
    // A name that leads out of the folder would have its output written somewhere else.
    let is_plain = |name: &&String| Path::new(name).file_name() == Some(name.as_ref());
    if let Some(odd) = names.iter().find(|name| !is_plain(name)) {
        return Err(format!("the recording `{odd}` is not a file of this folder"));
    }
    match names.is_empty() {
        true => Err("it names no recording (`relative_file_paths`)".to_owned()),
        false => Ok(names),
    }
}

fn name_of(recording: &Overview) -> String {
    recording.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Start of the first and length of all recordings in nanoseconds.
fn span(recordings: &[Overview]) -> (u64, u64) {
    let start = recordings.iter().filter_map(|made| made.start_ns).min().unwrap_or(0);
    let end = recordings.iter().filter_map(|made| made.end_ns).max().unwrap_or(start);
    (start, end - start)
}

fn file_entry(recording: &Overview) -> Value {
    let (start, duration) = span(std::slice::from_ref(recording));
    json!({
        "path": name_of(recording),
        "starting_time": { "nanoseconds_since_epoch": start },
        "duration": { "nanoseconds": duration },
        "message_count": recording.message_count,
    })
}

/// Type and messages of each topic.
fn counts(recordings: &[Overview]) -> BTreeMap<String, (String, u64)> {
    let mut counts: BTreeMap<String, (String, u64)> = BTreeMap::new();
    for recording in recordings {
        for channel in recording.channels.values() {
            let type_name = recording.schema_of(channel.id).map(|schema| schema.name.clone());
            let count = recording.message_counts.get(&channel.id).copied().unwrap_or(0);
            let entry = counts.entry(channel.topic.clone()).or_default();
            *entry = (type_name.unwrap_or_default(), entry.1 + count);
        }
    }
    counts
}

/// The topic's name in an entry.
fn name(entry: &Value) -> Option<&str> {
    entry.get("topic_metadata")?.get("name")?.as_str()
}

fn entry_with(entry: &Value, key: &str, value: Value) -> Value {
    let mut entry = entry.clone();
    entry[key] = value;
    entry
}

/// An entry for a topic that was added. The hash of its type is known only where the type is that
/// of the template.
fn new_entry(template: Option<&Value>, topic: &str, type_name: &str, count: u64) -> Value {
    let plain = || json!({ "serialization_format": "cdr", "offered_qos_profiles": "" });
    let template = template.and_then(|entry| entry.get("topic_metadata"));
    let mut metadata = template.cloned().unwrap_or_else(plain);
    let is_same_type = metadata.get("type").and_then(Value::as_str) == Some(type_name);
    if !is_same_type && metadata.get("type_description_hash").is_some() {
        metadata["type_description_hash"] = json!("");
    }
    metadata["name"] = json!(topic);
    metadata["type"] = json!(type_name);
    json!({ "topic_metadata": metadata, "message_count": count })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::datasets::drive::{CLOUD_TOPIC, write_drive};
    use divmerge_recording::WriteOptions;
    use divmerge_simulate::{Drive, Scene, Sensor};

    const SIX: &str = r#"rosbag2_bagfile_information:
  version: 6
  storage_identifier: mcap
  duration:
    nanoseconds: 7
  starting_time:
    nanoseconds_since_epoch: 5
  message_count: 9
  topics_with_message_count:
    - topic_metadata:
        name: /lidar/points
        type: sensor_msgs/msg/PointCloud2
        serialization_format: cdr
        offered_qos_profiles: "- history: 3\n  depth: 0\n"
      message_count: 9
    - topic_metadata:
        name: /gone
        type: std_msgs/msg/String
        serialization_format: cdr
        offered_qos_profiles: ""
      message_count: 1
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - drive_0.mcap
  files:
    - path: drive_0.mcap
      starting_time:
        nanoseconds_since_epoch: 5
      duration:
        nanoseconds: 7
      message_count: 9
  custom_data:
    driver: "yes"
"#;

    fn bag(text: &str) -> (tempfile::TempDir, Result<Bag>) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(METADATA_FILE), text).unwrap();
        let bag = Bag::open(folder.path());
        (folder, bag)
    }

    fn drive(folder: &Path) -> Overview {
        let path = folder.join("drive_0.mcap");
        let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
        let go_on = |_| std::ops::ControlFlow::Continue(());
        write_drive(&drive, 2, &path, &WriteOptions::default(), go_on).unwrap();
        Overview::read(&path).unwrap()
    }

    #[test]
    fn the_metadata_is_that_of_the_recordings() {
        let (folder, bag) = bag(SIX);
        let bag = bag.unwrap();
        assert_eq!(bag.files, ["drive_0.mcap"]);
        let made = drive(folder.path());
        let text = bag.metadata_of(std::slice::from_ref(&made));
        let again = yaml::parse(&text).unwrap();
        let again = &again[ROOT];
        assert_eq!(again["message_count"], made.message_count);
        let start = made.start_ns.unwrap();
        assert_eq!(again["files"][0]["starting_time"]["nanoseconds_since_epoch"], start);
        assert_eq!(again["duration"]["nanoseconds"], made.end_ns.unwrap() - start);
        assert_eq!(again["custom_data"]["driver"], "yes");
        let topics = again["topics_with_message_count"].as_array().unwrap();
        let names: Vec<_> = topics.iter().filter_map(name).collect();
        assert_eq!(names, [CLOUD_TOPIC, "/tf"], "{text}");
        assert_eq!(topics[0]["message_count"], 2);
        let qos = &topics[0]["topic_metadata"]["offered_qos_profiles"];
        assert_eq!(qos, "- history: 3\n  depth: 0\n");
    }

    #[test]
    fn an_added_topic_has_the_form_of_its_parent() {
        let nine = json!({
            "topic_metadata": {
                "name": "/a", "type": "T", "serialization_format": "cdr",
                "offered_qos_profiles": [{ "history": "keep_last", "depth": 5 }],
                "type_description_hash": "RIHS01_00",
            },
            "message_count": 3,
        });
        let same = new_entry(Some(&nine), "/a/instances", "T", 2);
        assert_eq!(same["topic_metadata"]["type_description_hash"], "RIHS01_00");
        assert_eq!(same["topic_metadata"]["offered_qos_profiles"][0]["depth"], 5);
        let other = new_entry(Some(&nine), "/a/objects", "U", 2);
        assert_eq!(other["topic_metadata"]["type_description_hash"], "");
        assert_eq!(other["topic_metadata"]["type"], "U");
    }

    #[test]
    fn other_bags_are_refused_with_what_to_do() {
        for (from, to, words) in [
            ("storage_identifier: mcap", "storage_identifier: sqlite3", "ros2 bag convert"),
            ("compression_mode: \"\"", "compression_mode: FILE", "only `zstd`"),
            ("    - drive_0.mcap\n", "    - ../drive_0.mcap\n", "not a file of this folder"),
            ("rosbag2_bagfile_information", "other", "no table"),
            ("  version: 6", "  - version: 6", "not YAML"),
        ] {
            let (_folder, bag) = bag(&SIX.replace(from, to));
            let problem = bag.unwrap_err().to_string();
            assert!(problem.contains(words) && problem.contains(METADATA_FILE), "{problem}");
        }
    }
}
