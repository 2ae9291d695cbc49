//! One cloud message of a recording, or some in a row: by number, or the nearest to a time.

use std::collections::BTreeMap;
use std::ops::{Bound, RangeInclusive};
use std::path::{Path, PathBuf};

use super::clouds::{CloudChannel, CloudFormat, PackedCloud};
use super::recording::{
    Channel, Overview, Position, ReadFilter, Record, RecordingReader, window_around,
};
use crate::error::{Error, Result};
use crate::workers::Workers;

/// A cloud message, still encoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CloudMessage {
    /// Its topic.
    pub topic: String,
    /// Its number on the topic in the order of the file, from 0.
    pub number: u64,
    /// Log time in nanoseconds.
    pub log_time: u64,
    /// Format of the message.
    pub format: CloudFormat,
    /// The message.
    pub data: Vec<u8>,
    /// Where it lies.
    pub position: Position,
}

/// Which cloud of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CloudNumber<'a> {
    /// Its topic.
    pub topic: &'a str,
    /// Its number on the topic in the order of the file, from 0.
    pub number: u64,
}

/// A cloud as those know it who have something to say of it: boxes, classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AskedCloud<'a> {
    /// Which cloud of the recording.
    pub which: CloudNumber<'a>,
    /// Stamp of its header, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Its coordinate frame.
    pub frame_id: &'a str,
}

impl CloudMessage {
    /// Which cloud of the recording it is.
    pub fn which(&self) -> CloudNumber<'_> {
        CloudNumber { topic: &self.topic, number: self.number }
    }

    /// The cloud in it.
    ///
    /// # Errors
    /// Those of [`CloudFormat::decode`].
    pub fn decode(&self) -> Result<PackedCloud<'_>> {
        self.format.decode(&self.data)
    }
}

/// Which message of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// The one of that number, from 0, in the order of the file.
    Frame(u64),
    /// The one whose log time in nanoseconds is nearest; of two the earlier in the file.
    Time(u64),
}

/// Reads one cloud message of a topic, or of the first topic with readable clouds.
///
/// Where the recording's index can be relied on, only the chunk of that frame is read, or those that may hold the
/// message nearest to a time; else a frame is found as soon as it is reached, and for a time the whole recording is
/// read. Nothing is decoded.
///
/// # Errors
/// [`Error::NoCloud`] if there is no such topic or frame, with what there is; those of
/// [`RecordingReader`].
pub fn cloud_message_at(path: &Path, topic: Option<&str>, which: Which) -> Result<CloudMessage> {
    match which {
        Which::Frame(number) => {
            let first = CloudMessages::open(path, topic, number..=number)?.next();
            first.unwrap_or_else(|| Err(no_cloud(path, cut_off(number))))
        }
        Which::Time(wanted) => nearest(CloudMessages::open_around(path, topic, wanted)?, wanted),
    }
}

fn nearest(messages: CloudMessages, wanted: u64) -> Result<CloudMessage> {
    let (path, topic) = (messages.path.clone(), messages.topic.clone());
    let mut best: Option<CloudMessage> = None;
    for message in messages {
        let message = message?;
        let away = message.log_time.abs_diff(wanted);
        if best.as_ref().is_none_or(|best| away < best.log_time.abs_diff(wanted)) {
            best = Some(message);
        }
    }
    best.ok_or_else(|| no_cloud(&path, format!("no cloud on `{topic}`")))
}

/// The messages of one cloud topic in the order of the file, one at a time in memory.
pub struct CloudMessages {
    path: PathBuf,
    topic: String,
    count: u64,
    start_ns: u64,
    channels: BTreeMap<u16, CloudFormat>,
    frames: RangeInclusive<u64>,
    /// Log times, from and to (left out), outside of which none is needed.
    window: (Option<u64>, Option<u64>),
    next: u64,
    reader: RecordingReader,
    is_over: bool,
}

impl CloudMessages {
    /// Opens a recording at a topic, or at its first topic with readable clouds. Frames outside
    /// `frames` are passed over.
    ///
    /// # Errors
    /// [`Error::NoCloud`] if there is no such topic, or the first frame is not in it (the last may lie
    /// behind the end); those of [`RecordingReader`].
    pub fn open(path: &Path, topic: Option<&str>, frames: RangeInclusive<u64>) -> Result<Self> {
        Self::open_with(path, topic, frames, |_, _| (None, None))
    }

    /// Opens a recording at those messages of a topic that may be the nearest to a log time.
    fn open_around(path: &Path, topic: Option<&str>, log_time: u64) -> Result<Self> {
        let window =
            |overview: &Overview, channels: &[u16]| window_around(overview, channels, log_time);
        Self::open_with(path, topic, 0..=u64::MAX, window)
    }

    fn open_with(
        path: &Path,
        topic: Option<&str>,
        frames: RangeInclusive<u64>,
        window: impl FnOnce(&Overview, &[u16]) -> (Option<u64>, Option<u64>),
    ) -> Result<Self> {
        let overview = Overview::read(path)?;
        let topic = choose(&overview, topic)?;
        let channels = overview.channels_of(&topic);
        let channels: BTreeMap<u16, CloudFormat> = channels
            .filter_map(|channel| Some((channel.id, cloud_format(&overview, channel)?)))
            .collect();
        let count = channels.keys().map(|&id| count(&overview, id)).sum();
        if *frames.start() >= count {
            let problem = match count {
                0 => format!("no cloud on `{topic}`"),
                _ => format!(
                    "no frame {} on `{topic}`: it has {count}, from 0 to {}",
                    frames.start(),
                    count - 1
                ),
            };
            return Err(no_cloud(path, problem));
        }
        let ids: Vec<u16> = channels.keys().copied().collect();
        let window = window(&overview, &ids);
        let wanted = ReadFilter {
            from_ns: window.0,
            to_ns: window.1,
            numbered: ids.iter().map(|&id| (id, topic.clone())).collect(),
            numbers: (Bound::Included(*frames.start()), Bound::Included(*frames.end())),
            others: false,
            ..ReadFilter::default()
        };
        Ok(CloudMessages {
            path: path.to_owned(),
            topic,
            count,
            start_ns: overview.start_ns.unwrap_or(0),
            channels,
            frames,
            window,
            next: 0,
            reader: RecordingReader::open_filtered(&overview, &wanted, &Workers::none())?,
            is_over: false,
        })
    }

    /// The topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Messages on the topic.
    pub fn message_count(&self) -> u64 {
        self.count
    }

    /// Log time of the recording's first message in nanoseconds.
    pub fn start_ns(&self) -> u64 {
        self.start_ns
    }

    /// Bytes that were read of the file so far.
    pub fn bytes_read(&self) -> u64 {
        self.reader.bytes_read()
    }

    fn read(&mut self) -> Result<Option<CloudMessage>> {
        while self.next <= *self.frames.end() {
            match self.reader.next_record()? {
                Some(Record::Message { header, data, position }) => {
                    let Some(&format) = self.channels.get(&header.channel_id) else {
                        continue;
                    };
                    let number = self.next;
                    self.next += 1;
                    if is_wanted(&self.frames, self.window, number, header.log_time) {
                        return Ok(Some(CloudMessage {
                            topic: self.topic.clone(),
                            number,
                            log_time: header.log_time,
                            format,
                            data: data.into_owned(),
                            position,
                        }));
                    }
                }
                Some(Record::Skipped { counts }) => self.next += counts.values().sum::<u64>(),
                Some(_) => {}
                None => break,
            }
        }
        Ok(None)
    }
}

fn is_wanted(
    frames: &RangeInclusive<u64>,
    (from, to): (Option<u64>, Option<u64>),
    number: u64,
    log_time: u64,
) -> bool {
    frames.contains(&number)
        && from.is_none_or(|from| log_time >= from)
        && to.is_none_or(|to| log_time < to)
}

impl Iterator for CloudMessages {
    type Item = Result<CloudMessage>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let message = self.read().transpose();
        self.is_over = !matches!(message, Some(Ok(_)));
        message
    }
}

/// Format of a channel's clouds, if they can be read.
pub fn cloud_format(overview: &Overview, channel: &Channel) -> Option<CloudFormat> {
    CloudChannel::of(overview, channel).format()
}

impl CloudChannel {
    /// What a channel of a recording carries, told from the name of its type and the encoding of its
    /// messages.
    pub fn of(overview: &Overview, channel: &Channel) -> Self {
        CloudChannel::named(schema_name(overview, channel), &channel.message_encoding)
    }

    /// Why a topic's clouds cannot be read, if it has some that cannot.
    pub fn why_unreadable(overview: &Overview, topic: &str) -> Option<String> {
        let channels = overview.channels_of(topic);
        channels.map(|channel| CloudChannel::of(overview, channel)).find_map(|found| match found {
            CloudChannel::Unreadable(unreadable) => Some(unreadable.reason),
            _ => None,
        })
    }
}

/// The name of the type of a channel's messages; empty where nothing says it.
pub(super) fn schema_name<'a>(overview: &'a Overview, channel: &Channel) -> &'a str {
    overview.schemas.get(&channel.schema_id).map_or("", |schema| &schema.name)
}

/// The last part of a type's name: `PointCloud2` of `sensor_msgs/msg/PointCloud2`.
pub(super) fn type_name<'a>(overview: &'a Overview, channel: &Channel) -> &'a str {
    let name = schema_name(overview, channel);
    name.rsplit(['/', '.']).next().unwrap_or(name)
}

/// What is said where a topic beside the clouds carries something else, or is not there.
pub(super) struct BesideWords {
    /// What can be read.
    pub readable: &'static str,
    /// Stands before the topics that carry such.
    pub on: &'static str,
    /// Stands where there are none.
    pub none: &'static str,
}

/// The channels of a topic beside the clouds, with how each is read; all must carry what `of` knows.
///
/// # Errors
/// What a channel carries instead, or that there is no such topic, in words.
pub(super) fn channels_beside<T>(
    overview: &Overview,
    topic: &str,
    of: impl Fn(&Overview, &Channel) -> Option<T>,
    words: &BesideWords,
) -> std::result::Result<BTreeMap<u16, T>, String> {
    let mut channels = BTreeMap::new();
    for channel in overview.channels_of(topic) {
        let Some(read) = of(overview, channel) else {
            let what = overview.schema_of(channel.id).map_or("no schema", |schema| &schema.name);
            let encoding = &channel.message_encoding;
            return Err(format!("it carries {what} in encoding `{encoding}`; {}", words.readable));
        };
        channels.insert(channel.id, read);
    }
    if !channels.is_empty() {
        return Ok(channels);
    }
    let others = overview.channels.values().filter(|channel| of(overview, channel).is_some());
    let mut topics: Vec<&str> = others.map(|channel| channel.topic.as_str()).collect();
    topics.sort_unstable();
    topics.dedup();
    let others = match topics.is_empty() {
        true => words.none.to_owned(),
        false => format!("{} {}", words.on, topics.join(", ")),
    };
    Err(format!("{} has no such topic; {others}", overview.path.display()))
}

/// The topic asked for, or the first with clouds, else the first that could have some.
fn choose(overview: &Overview, topic: Option<&str>) -> Result<String> {
    let channels = overview.channels.values();
    let readable: Vec<&Channel> =
        channels.filter(|channel| cloud_format(overview, channel).is_some()).collect();
    let names = || {
        let mut names: Vec<&str> = readable.iter().map(|channel| channel.topic.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names.join(", ")
    };
    let path = &overview.path;
    let chosen = match topic {
        Some(topic) => readable.iter().find(|channel| channel.topic == topic),
        None => readable
            .iter()
            .find(|channel| count(overview, channel.id) > 0)
            .or_else(|| readable.first()),
    };
    let why = topic.and_then(|topic| CloudChannel::why_unreadable(overview, topic));
    match (chosen, topic) {
        (Some(channel), _) => Ok(channel.topic.clone()),
        (None, Some(topic)) if let Some(reason) = why => {
            Err(no_cloud(path, format!("the topic `{topic}` cannot be read: {reason}")))
        }
        (None, Some(topic)) if !readable.is_empty() => {
            Err(no_cloud(path, format!("no readable cloud topic `{topic}`; there is: {}", names())))
        }
        _ => Err(no_cloud(path, "no cloud topic that can be read".into())),
    }
}

fn count(overview: &Overview, channel: u16) -> u64 {
    overview.message_counts.get(&channel).copied().unwrap_or(0)
}

fn cut_off(number: u64) -> String {
    format!("frame {number} is counted but not there: the recording is damaged")
}

fn no_cloud(path: &Path, problem: String) -> Error {
    Error::NoCloud { path: path.to_owned(), problem }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::WriteOptions;
    use crate::io::drive::{CLOUD_TOPIC, write_drive};
    use crate::simulate::{Drive, Scene, Sensor};

    #[test]
    fn by_number_and_by_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.mcap");
        let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
        write_drive(&drive, 3, &path, &WriteOptions::default(), |_| {
            std::ops::ControlFlow::Continue(())
        })
        .unwrap();

        let all: Vec<CloudMessage> =
            CloudMessages::open(&path, None, 0..=9).unwrap().map(|m| m.unwrap()).collect();
        assert_eq!(all.iter().map(|m| m.number).collect::<Vec<_>>(), [0, 1, 2]);
        let at = |topic, which| cloud_message_at(&path, topic, which);
        assert_eq!(at(None, Which::Frame(1)).unwrap(), all[1]);
        let near = all[2].log_time - 1000;
        assert_eq!(at(Some(CLOUD_TOPIC), Which::Time(near)).unwrap(), all[2]);
        assert_eq!(at(None, Which::Time(0)).unwrap(), all[0]);
        assert_eq!(at(None, Which::Time(u64::MAX)).unwrap(), all[2]);

        let beyond = at(None, Which::Frame(3)).unwrap_err().to_string();
        assert!(beyond.contains("it has 3, from 0 to 2"), "{beyond}");
        let unknown = at(Some("/tf"), Which::Frame(0)).unwrap_err().to_string();
        assert!(unknown.contains("`/tf`") && unknown.contains(CLOUD_TOPIC), "{unknown}");
    }
}
