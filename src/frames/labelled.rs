//! Clouds with their truth, one at a time: a recording whose clouds carry it or have label files
//! beside them, or the folders of SemanticKITTI.

use std::ops::{Bound, RangeBounds};
use std::path::{Path, PathBuf};

use super::assemble::Assemble;
use super::clouds::EncodedClouds;
use super::encoded::EncodedCloud;
use super::key::CloudKey;
use super::selection::Selection;
use crate::datasets::semantic_kitti::{
    LabelledScan, labelled_scans, read_labels, read_scan, read_scan_with_remission,
};
use crate::error::{Error, FrameError, NoCloud, Result};
use crate::evaluate::evaluation::segments;
use crate::messages::clouds::CloudMessage;
use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_recording::MessageRange;

/// A cloud of N points and what is true of it.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledFrame {
    /// Topic, or name of the sequence.
    pub source: String,
    /// Number of the cloud on its topic or in its sequence, from 0.
    pub number: u64,
    /// When the cloud was logged, nanoseconds; 0 in a folder.
    pub log_time_ns: u64,
    /// Stamp of the cloud's header, nanoseconds; 0 in a folder.
    pub stamp_ns: i64,
    /// Coordinate frame of the cloud; empty in a folder.
    pub frame_id: String,
    /// The cloud, with the classes that a method gets to see, if it is to see some.
    pub cloud: PointCloud,
    /// The truth.
    pub truth: Truth,
}

impl LabelledFrame {
    /// What identifies the cloud.
    pub fn key(&self) -> CloudKey<'_> {
        let LabelledFrame { source, number, stamp_ns, frame_id, .. } = self;
        CloudKey { topic: source, number: *number, stamp_ns: *stamp_ns, frame_id }
    }

    /// N: number of the true class.
    ///
    /// # Errors
    /// [`Error::UnknownClass`] if a true class is not in the taxonomy.
    pub fn true_class_numbers(&self, taxonomy: &Taxonomy) -> Result<Vec<u16>> {
        let raw = &self.truth.class;
        taxonomy.known_class_numbers(raw).map_err(|class| {
            let at = format!("cloud {} of {}", self.number, self.source);
            Error::unknown_class(at, class, raw.iter().copied(), &taxonomy.name)
        })
    }
}

/// What is true of N points.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Truth {
    /// N: raw class id.
    pub class: Vec<u16>,
    /// N: the segment; points of one class and one instance have one id. Where instances fit 16
    /// bits it is SemanticKITTI's word, class | instance << 16.
    pub id: Vec<u32>,
}

impl Truth {
    /// The truth in SemanticKITTI's words.
    pub fn of_words(words: Vec<u32>) -> Self {
        Truth { class: words.iter().map(|&word| word as u16).collect(), id: words }
    }

    /// The truth in a class and an instance per point.
    pub fn of_columns(class: &[u32], instance: &[u32]) -> Self {
        let (class, id) = segments(class, instance);
        Truth { class, id }
    }
}

/// Where the truth of a recording is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TruthSource {
    /// In fields of the clouds.
    Fields {
        /// Field of the class.
        class: String,
        /// Field of the instance.
        instance: String,
    },
    /// In a folder of `NNNNNN.label` files, by the number of the cloud.
    Files(PathBuf),
}

impl TruthSource {
    /// The truth of a cloud.
    ///
    /// # Errors
    /// Those of the two fields, or of the label file, which must have a word a point.
    pub fn of(&self, message: &EncodedCloud, cloud: &CloudMessage) -> Result<Truth> {
        match self {
            TruthSource::Fields { class, instance } => {
                Ok(Truth::of_columns(&cloud.column_u32(class)?, &cloud.column_u32(instance)?))
            }
            TruthSource::Files(folder) => {
                let path = folder.join(format!("{:06}.label", message.number));
                words(&path, cloud.point_count())
            }
        }
    }
}

impl Default for TruthSource {
    fn default() -> Self {
        TruthSource::Fields { class: "label".into(), instance: "true_instance".into() }
    }
}

/// Which classes a method gets to see.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum SeenClasses {
    /// Those of a field `label`, `semantic`, `class_id` or `class_ids`; in folders the true ones.
    #[default]
    Auto,
    /// Those of the field of that name; in folders the true ones.
    Field(String),
    /// None.
    Nothing,
}

/// What is read.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledOptions {
    /// Topic of the clouds; none means the first with clouds. Ignored for folders.
    pub topic: Option<String>,
    /// Sequences; none means all. Ignored for recordings.
    pub sequences: Vec<String>,
    /// Numbers of the clouds.
    pub frames: MessageRange,
    /// Where a recording's truth is.
    pub truth: TruthSource,
    /// Which classes the clouds carry.
    pub classes: SeenClasses,
    /// Whether they carry how much light came back.
    pub remission: bool,
    /// How messages of a recording are put together to turns; `None`: not at all.
    pub assemble: Option<Assemble>,
}

impl Default for LabelledOptions {
    fn default() -> Self {
        LabelledOptions {
            topic: None,
            sequences: Vec::new(),
            frames: (Bound::Unbounded, Bound::Unbounded),
            truth: TruthSource::default(),
            classes: SeenClasses::default(),
            remission: false,
            assemble: None,
        }
    }
}

/// The clouds of a recording or a folder with their truth, in order, one at a time in memory.
pub struct LabelledFrames {
    path: PathBuf,
    options: LabelledOptions,
    source: Source,
}

enum Source {
    Recording(Box<EncodedClouds>),
    Folder(std::vec::IntoIter<(u64, LabelledScan)>),
}

impl LabelledFrames {
    /// Opens a recording, or a folder that holds `sequences/NN/{velodyne,labels}`.
    ///
    /// # Errors
    /// [`Error::NoCloud`] if nothing matches the options; those of
    /// [`EncodedClouds::open`] and [`labelled_scans`].
    pub fn open(path: &Path, options: LabelledOptions) -> Result<Self> {
        let source = if path.is_dir() {
            Source::Folder(scans(path, &options)?.into_iter())
        } else {
            let topic = options.topic.as_deref();
            let clouds =
                EncodedClouds::open_assembled(path, topic, options.frames, options.assemble)?;
            Source::Recording(Box::new(clouds))
        };
        Ok(LabelledFrames { path: path.to_owned(), options, source })
    }

    /// Clouds that are still to come, at most.
    pub fn remaining(&self) -> u64 {
        match &self.source {
            Source::Recording(messages) => {
                let count = messages.message_count();
                let (first, end) = Selection::of_frames(self.options.frames).clamped(count);
                end.saturating_sub(first)
            }
            Source::Folder(scans) => scans.len() as u64,
        }
    }

    fn of_message(&self, message: &EncodedCloud) -> Result<LabelledFrame> {
        let wire = message.decode()?;
        let seen = match &self.options.classes {
            SeenClasses::Auto => wire.semantic_field(),
            SeenClasses::Field(name) => Some(name.as_str()),
            SeenClasses::Nothing => None,
        };
        let mut cloud = wire.to_cloud(seen)?;
        if self.options.remission {
            let remission = wire.remission()?;
            cloud = cloud.with(|columns| columns.remission = remission)?;
        }
        let truth = self.options.truth.of(message, &wire)?;
        Ok(LabelledFrame {
            stamp_ns: wire.stamp_ns(),
            frame_id: wire.frame_id.clone(),
            source: message.topic.to_string(),
            number: message.number,
            log_time_ns: message.header.log_time,
            cloud,
            truth,
        })
    }

    fn of_scan(&self, number: u64, scan: LabelledScan) -> Result<LabelledFrame> {
        let cloud = match self.options.remission {
            true => read_scan_with_remission(&scan.scan)?,
            false => read_scan(&scan.scan)?,
        };
        let truth = words(&scan.labels, cloud.len())?;
        let cloud = match self.options.classes {
            SeenClasses::Nothing => cloud,
            _ => cloud.with_class(truth.class.clone())?,
        };
        Ok(LabelledFrame {
            source: scan.sequence,
            number,
            log_time_ns: 0,
            stamp_ns: 0,
            frame_id: String::new(),
            cloud,
            truth,
        })
    }
}

impl Iterator for LabelledFrames {
    type Item = Result<LabelledFrame>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.source {
            Source::Recording(messages) => {
                let message = messages.next()?;
                let place = |number| format!("{}: cloud {number}", self.path.display());
                Some(message.and_then(|message| {
                    let at = place(message.number);
                    self.of_message(&message).map_err(|error| match error {
                        Error::Frame(problem) => Error::Unreadable { at, problem },
                        other => other,
                    })
                }))
            }
            Source::Folder(scans) => {
                let (number, scan) = scans.next()?;
                Some(self.of_scan(number, scan))
            }
        }
    }
}

/// The selected scans, with their numbers in their sequences.
fn scans(root: &Path, options: &LabelledOptions) -> Result<Vec<(u64, LabelledScan)>> {
    let is_asked = |scan: &LabelledScan| {
        options.sequences.is_empty() || options.sequences.contains(&scan.sequence)
    };
    let all: Vec<LabelledScan> = labelled_scans(root)?.into_iter().filter(is_asked).collect();
    let sequences = all.chunk_by(|a, b| a.sequence == b.sequence);
    let chosen: Vec<(u64, LabelledScan)> = sequences
        .flat_map(|scans| (0..).zip(scans.iter().cloned()))
        .filter(|(number, _)| options.frames.contains(number))
        .collect();
    if chosen.is_empty() {
        return Err(Error::NoCloud { path: root.to_owned(), problem: NoCloud::NoLabelledScan });
    }
    Ok(chosen)
}

/// The truth in a label file, which must have a word a point.
fn words(path: &Path, points: usize) -> Result<Truth> {
    let words = read_labels(path)?;
    if words.len() != points {
        let problem = FrameError::LabelCount { labels: words.len(), points };
        return Err(Error::Unreadable { at: path.display().to_string(), problem });
    }
    Ok(Truth::of_words(words))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::datasets::drive::write_drive;
    use crate::datasets::semantic_kitti::write_labels;
    use divmerge_recording::WriteOptions;
    use divmerge_simulate::{Drive, Scene, Sensor};

    #[test]
    fn a_recording_with_fields_and_with_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.mcap");
        let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
        let go_on = |_| std::ops::ControlFlow::Continue(());
        write_drive(&drive, 2, &path, &WriteOptions::default(), go_on).unwrap();
        let read = |options: LabelledOptions| -> Vec<Result<LabelledFrame>> {
            LabelledFrames::open(&path, options).unwrap().collect()
        };
        let with_fields = read(LabelledOptions::default());
        let first = with_fields[0].as_ref().unwrap();
        let simulated = drive.frame(0);
        assert_eq!(first.cloud.class, simulated.cloud.class);
        assert_eq!(Some(&first.truth.class), simulated.cloud.class.as_ref());
        let instance: Vec<u16> = first.truth.id.iter().map(|&id| (id >> 16) as u16).collect();
        assert_eq!(instance, simulated.true_instance);

        write_labels(&folder.path().join("000000.label"), &first.truth.id).unwrap();
        write_labels(&folder.path().join("000001.label"), &[0; 3]).unwrap();
        let truth = TruthSource::Files(folder.path().into());
        let with_files = read(LabelledOptions { truth, ..LabelledOptions::default() });
        assert_eq!(with_files[0].as_ref().unwrap(), first);
        let problem = with_files[1].as_ref().unwrap_err().to_string();
        assert!(problem.contains("000001.label: 3 labels for"), "{problem}");

        let truth = TruthSource::Fields { class: "label".into(), instance: "nothing".into() };
        let without = read(LabelledOptions { truth, ..LabelledOptions::default() });
        let problem = without[0].as_ref().unwrap_err().to_string();
        assert!(problem.contains("cloud 0") && problem.contains("`nothing`"), "{problem}");
    }

    #[test]
    fn instances_beyond_sixteen_bits_are_numbered() {
        let truth = Truth::of_columns(&[10, 10, 30, 10], &[70_000, 1, 70_000, 70_000]);
        assert_eq!(truth.id, [1, 2, 3, 1]);
        assert_eq!(Truth::of_columns(&[10], &[2]).id, [10 | 2 << 16]);
    }
}
