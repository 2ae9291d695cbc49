//! The cloud messages of a recording, one after the other, or one of them: by number, or the
//! nearest to a time.

use std::collections::BTreeMap;
use std::ops::RangeBounds;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::assemble::{Assemble, Turns};
use super::encoded::EncodedCloud;
use super::selection::Selection;
use super::topics::{CloudTopic, message_count, single_topic};
use super::walk::Walk;
use crate::error::{Error, NoCloud, Result};
use divmerge_recording::{Overview, window_around};

/// Which cloud of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CloudAt {
    /// The one of that number, from 0, in the order of the file.
    Frame(u64),
    /// The one whose log time in nanoseconds is nearest; of two the earlier in the file.
    Time(u64),
}

/// Reads one cloud message of a topic, or of the first topic with readable clouds.
///
/// Where the recording's index can be relied on, only the chunk of that frame is read, or those
/// that may hold the message nearest to a time; else a frame is found as soon as it is reached, and
/// for a time the whole recording is read. Nothing is decoded. Where messages are put together to
/// turns it is the turn with that message, and what lies before is read, since a turn begins where
/// the one before ends.
///
/// # Errors
/// [`Error::NoCloud`] if there is no such topic or frame, with what there is; those of
/// [`RecordingReader`](divmerge_recording::RecordingReader).
pub fn encoded_cloud_at(
    path: &Path,
    topic: Option<&str>,
    at: CloudAt,
    assemble: Option<Assemble>,
) -> Result<EncodedCloud> {
    let number = match at {
        CloudAt::Frame(number) => number,
        CloudAt::Time(log_time) => {
            let found = nearest(EncodedClouds::open_around(path, topic, log_time)?, log_time)?;
            if assemble.is_none() {
                return Ok(found);
            }
            found.number
        }
    };
    let first = EncodedClouds::open_assembled(path, topic, number..=number, assemble)?.next();
    first.unwrap_or_else(|| Err(no_cloud(path, NoCloud::LostFrame { frame: number })))
}

fn nearest(clouds: EncodedClouds, log_time: u64) -> Result<EncodedCloud> {
    let (path, topic) = (clouds.path.clone(), clouds.topic.clone());
    let mut best: Option<EncodedCloud> = None;
    for cloud in clouds {
        let cloud = cloud?;
        let away = cloud.header.log_time.abs_diff(log_time);
        if best.as_ref().is_none_or(|best| away < best.header.log_time.abs_diff(log_time)) {
            best = Some(cloud);
        }
    }
    best.ok_or_else(|| no_cloud(&path, empty(&topic)))
}

/// The clouds of a recording in the order of the file, one at a time in memory.
pub struct EncodedClouds {
    path: PathBuf,
    topic: Arc<str>,
    count: u64,
    start_ns: u64,
    clouds: BTreeMap<u16, CloudTopic>,
    walk: Walk,
    turns: Turns,
    is_over: bool,
}

impl EncodedClouds {
    /// Opens a recording at a topic, or at its first topic with readable clouds. Frames outside
    /// `frames` are passed over.
    ///
    /// # Errors
    /// [`Error::NoCloud`] if there is no such topic, or the first frame is not in it (the last may
    /// lie behind the end); those of [`RecordingReader`](divmerge_recording::RecordingReader).
    pub fn open(path: &Path, topic: Option<&str>, frames: impl RangeBounds<u64>) -> Result<Self> {
        EncodedClouds::open_assembled(path, topic, frames, None)
    }

    /// The same, where messages may be put together to turns: those with one of `frames`.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn open_assembled(
        path: &Path,
        topic: Option<&str>,
        frames: impl RangeBounds<u64>,
        assemble: Option<Assemble>,
    ) -> Result<Self> {
        let overview = Overview::read(path)?;
        let (topic, clouds) = single_topic(&overview, topic)?;
        let selection = Selection::of_frames(frames);
        let first = selection.first();
        let turns = Turns::new(assemble, selection.frames);
        let needed = Selection { frames: turns.needed(), ..selection };
        let found = EncodedClouds::of_channels(&overview, clouds, &needed)?;
        let found = EncodedClouds { turns, ..found };
        if first < found.count {
            return Ok(found);
        }
        let problem = match found.count {
            0 => empty(&topic),
            count => NoCloud::NoFrame { frame: first, counts: vec![(topic.to_string(), count)] },
        };
        Err(no_cloud(path, problem))
    }

    /// Opens a recording at those clouds of a topic that may be the nearest to a log time.
    fn open_around(path: &Path, topic: Option<&str>, log_time: u64) -> Result<Self> {
        let overview = Overview::read(path)?;
        let (topic, clouds) = single_topic(&overview, topic)?;
        let ids: Vec<u16> = clouds.keys().copied().collect();
        let (from_ns, to_ns) = window_around(&overview, &ids, log_time);
        let selection = Selection { from_ns, to_ns, ..Selection::default() };
        let found = EncodedClouds::of_channels(&overview, clouds, &selection)?;
        match found.count {
            0 => Err(no_cloud(path, empty(&topic))),
            _ => Ok(found),
        }
    }

    /// Opens a recording at the selected clouds of some channels; the topics of the selection are
    /// not asked.
    ///
    /// # Errors
    /// Those of [`RecordingReader`](divmerge_recording::RecordingReader).
    pub fn of_channels(
        overview: &Overview,
        clouds: BTreeMap<u16, CloudTopic>,
        selection: &Selection,
    ) -> Result<Self> {
        let topics = clouds.iter().map(|(&id, cloud)| (id, Arc::clone(&cloud.topic))).collect();
        Ok(EncodedClouds {
            path: overview.path.clone(),
            topic: clouds.values().next().map_or_else(|| "".into(), |cloud| cloud.topic.clone()),
            count: clouds.keys().map(|&id| message_count(overview, id)).sum(),
            start_ns: overview.start_ns.unwrap_or(0),
            walk: Walk::open(overview, topics, selection)?,
            turns: Turns::new(None, selection.frames),
            clouds,
            is_over: false,
        })
    }

    /// The topic, of several the first.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Messages on the topics.
    pub fn message_count(&self) -> u64 {
        self.count
    }

    /// Log time of the recording's first message in nanoseconds.
    pub fn start_ns(&self) -> u64 {
        self.start_ns
    }

    /// Bytes that were read of the file so far.
    pub fn bytes_read(&self) -> u64 {
        self.walk.bytes_read()
    }

    fn read(&mut self) -> Result<Option<EncodedCloud>> {
        loop {
            if let Some(cloud) = self.turns.next() {
                return Ok(Some(cloud));
            }
            let step = match self.turns.are_past(1) {
                true => None,
                false => self.walk.next()?,
            };
            let Some(step) = step else {
                self.turns.finish();
                return Ok(self.turns.next());
            };
            if let Some(cloud) = EncodedCloud::of_step(step, &self.clouds) {
                self.turns.push(cloud);
            }
        }
    }
}

impl Iterator for EncodedClouds {
    type Item = Result<EncodedCloud>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let cloud = self.read().transpose();
        self.is_over = !matches!(cloud, Some(Ok(_)));
        cloud
    }
}

fn no_cloud(path: &Path, problem: NoCloud) -> Error {
    Error::NoCloud { path: path.to_owned(), problem }
}

fn empty(topic: &str) -> NoCloud {
    NoCloud::EmptyTopic { topic: topic.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::datasets::drive::{CLOUD_TOPIC, write_drive};
    use divmerge_recording::WriteOptions;
    use divmerge_simulate::{Drive, Scene, Sensor};

    #[test]
    fn by_number_and_by_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.mcap");
        let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
        write_drive(&drive, 3, &path, &WriteOptions::default(), |_| {
            std::ops::ControlFlow::Continue(())
        })
        .unwrap();

        let all: Vec<EncodedCloud> =
            EncodedClouds::open(&path, None, 0..=9).unwrap().map(|m| m.unwrap()).collect();
        assert_eq!(all.iter().map(|m| m.number).collect::<Vec<_>>(), [0, 1, 2]);
        let number =
            |cloud: &EncodedCloud| (cloud.number, cloud.header.log_time, cloud.data.to_vec());
        let at = |topic, at| encoded_cloud_at(&path, topic, at, None);
        assert_eq!(number(&at(None, CloudAt::Frame(1)).unwrap()), number(&all[1]));
        let near = all[2].header.log_time - 1000;
        assert_eq!(number(&at(Some(CLOUD_TOPIC), CloudAt::Time(near)).unwrap()), number(&all[2]));
        assert_eq!(number(&at(None, CloudAt::Time(0)).unwrap()), number(&all[0]));
        assert_eq!(number(&at(None, CloudAt::Time(u64::MAX)).unwrap()), number(&all[2]));

        let beyond = at(None, CloudAt::Frame(3)).unwrap_err().to_string();
        assert!(beyond.contains("has 3 clouds, numbered 0 to 2"), "{beyond}");
        let unknown = at(Some("/tf"), CloudAt::Frame(0)).unwrap_err().to_string();
        assert!(unknown.contains("`/tf`") && unknown.contains(CLOUD_TOPIC), "{unknown}");
    }
}
