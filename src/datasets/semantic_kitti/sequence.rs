//! A sequence as a folder: scans, labels, times, calibration and poses; and as a recording.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge_recording::WriteOptions;
use nalgebra::Isometry3;

use super::checks::{check_classes, check_labels, known, scan_sizes};
use super::drive_files::{self, OdometryCalibration};
use crate::datasets::cloud_recording::{CloudRecording, Transform};
use crate::datasets::files::{file_name, names, read};
use crate::datasets::problems::Problems;
use crate::datasets::scans::{
    EPOCH_NS, LABEL_FIELDS, SOURCE, Scan, ScanFormat, TimedScan, WriteSummary, append_labels,
    write_scans,
};
use crate::error::{Error, Result};
use crate::messages::camera_info::camera_info;
use crate::messages::clouds::CloudFormat;
use crate::messages::definitions::CAMERA_INFO;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Topic of the clouds.
pub const CLOUD_TOPIC: &str = "/velodyne_points";

/// Coordinate frame of the clouds.
pub const SENSOR_FRAME: &str = "velodyne";

/// Coordinate frame of camera 0: x right, y down, z forward.
pub const CAMERA_FRAME: &str = "camera_0";

/// Fields that hold another method's class and instance.
pub const PREDICTION_FIELDS: [&str; 2] = ["predicted_label", "predicted_instance"];

/// Key of the sequence's name in the metadata record [`SOURCE`].
pub const SEQUENCE_KEY: &str = "sequence";

/// What to read of a sequence.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SequenceOptions {
    /// Whether to read the truth from `labels/`. Default: no.
    pub labels: bool,
    /// Folder that holds `sequences/NN/predictions/` (or `labels/`) of another method. Default:
    /// none.
    pub predictions: Option<PathBuf>,
    /// Time 0 of `times.txt` in nanoseconds since 1970. Default: [`EPOCH_NS`].
    pub start_ns: Option<u64>,
}

/// A sequence that was looked through: everything is there and fits. Labels are only read when it
/// is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Its name, such as `04`.
    pub name: String,
    /// Its folder.
    pub path: PathBuf,
    /// What is not there, or only partly used, and what that means, in words.
    pub notes: Vec<String>,
    scans: Vec<PathBuf>,
    labels: Vec<LabelFolder>,
    times: Option<Vec<u64>>,
    start_ns: u64,
    calibration: Option<(OdometryCalibration, Vec<u8>)>,
    poses: Option<Vec<Isometry3<f64>>>,
}

/// A folder with a label file for each scan, and the fields that they become.
#[derive(Debug, Clone, PartialEq)]
struct LabelFolder {
    path: PathBuf,
    fields: [&'static str; 2],
}

/// The sequences below a folder: it holds `sequences/NN/velodyne/`, or `NN/velodyne/`, or is such a
/// sequence itself. Names and folders, in order.
///
/// # Errors
/// [`Error::Folder`] if there is none; [`Error::Io`].
pub fn sequences(root: &Path) -> Result<Vec<(String, PathBuf)>> {
    let has_scans = |folder: &Path| folder.join("velodyne").is_dir();
    if has_scans(root) {
        let whole =
            root.canonicalize().map_err(|source| Error::Io { path: root.into(), source })?;
        return Ok(vec![(file_name(&whole), root.to_owned())]);
    }
    let below = root.join("sequences");
    let below = if below.is_dir() { below } else { root.to_owned() };
    let folders = names(&below)?.into_iter().map(|name| (name.clone(), below.join(name)));
    let found: Vec<_> = folders.filter(|(_, folder)| has_scans(folder)).collect();
    let mut problems = Problems::default();
    if found.is_empty() {
        problems.add("no sequences/NN/velodyne, NN/velodyne or velodyne in it");
    }
    problems.into_result(root)?;
    Ok(found)
}

impl Sequence {
    /// Looks through a sequence's folder.
    ///
    /// Scans are `velodyne/000000.bin` and on without a gap; each has four numbers of four bytes a
    /// point. Labels, if asked for, have a file of as many points for each scan. `times.txt` and
    /// `poses.txt` have a line for each scan at least. Without times, scans are ten a second;
    /// without poses, or `Tr` in `calib.txt`, there is no `/tf`; [`Sequence::notes`] says so.
    ///
    /// # Errors
    /// [`Error::Folder`] with everything that is wrong; [`Error::Io`].
    pub fn open(name: &str, folder: &Path, options: &SequenceOptions) -> Result<Self> {
        let mut problems = Problems::default();
        let sizes = scan_sizes(&folder.join("velodyne"), &mut problems)?;
        let labels = label_folders(name, folder, options);
        for folder in &labels {
            check_labels(&folder.path, &sizes, &mut problems)?;
        }
        let mut sequence = Sequence {
            name: name.to_owned(),
            path: folder.to_owned(),
            notes: Vec::new(),
            scans: sizes.keys().map(|stem| folder.join(format!("velodyne/{stem}.bin"))).collect(),
            labels,
            times: None,
            start_ns: options.start_ns.unwrap_or(EPOCH_NS),
            calibration: None,
            poses: None,
        };
        sequence.read_drive_files(&mut problems)?;
        problems.into_result(folder)?;
        Ok(sequence)
    }

    /// Number of scans.
    pub fn len(&self) -> usize {
        self.scans.len()
    }

    /// Whether there is no scan, which no sequence that was opened is.
    pub fn is_empty(&self) -> bool {
        self.scans.is_empty()
    }

    /// Writes the sequence as a ROS 2 recording.
    ///
    /// A cloud a scan on [`CLOUD_TOPIC`]: x, y, z, intensity, and the fields of labels that were
    /// asked for. Stamps, log and publish times are `times.txt` after the start. With poses: `/tf`,
    /// the pose of the scanner in `map`, where it stood when camera 0 was at the origin of
    /// `poses.txt`. With calibration: `/tf_static` (camera 0 on the scanner),
    /// `/camera_N/camera_info` in the frame of camera 0, and `calib.txt` as it is, attached. A
    /// metadata record [`SOURCE`] says what there was. `on_frame` is called after each scan and may
    /// break off.
    ///
    /// # Errors
    /// [`Error::Folder`] with the label files that hold a class unknown to `taxonomy` and the scans
    /// that cannot be read; [`Error::Interrupted`]; those of [`CloudRecording`]. Then nothing is
    /// written.
    pub fn write(
        &self,
        taxonomy: &Taxonomy,
        output: &Path,
        options: &WriteOptions,
        on_frame: impl FnMut() -> ControlFlow<()>,
    ) -> Result<WriteSummary> {
        let mut recording =
            CloudRecording::create(CloudFormat::Ros2, output, CLOUD_TOPIC, options)?;
        recording.write_metadata(SOURCE, &self.metadata())?;
        if let Some((calibration, text)) = &self.calibration {
            self.write_calibration(calibration, text, &mut recording)?;
        }
        let is_known = known(taxonomy);
        let frames = self.scans.iter().enumerate().map(|(number, path)| TimedScan {
            path,
            stamp_ns: self.stamp_ns(number),
            pose: self.poses.as_ref().map(|poses| poses[number]),
            scan: self.scan(path, &is_known, &taxonomy.name),
        });
        write_scans(recording, SENSOR_FRAME, [&self.path, output], frames, on_frame)
    }

    fn stamp_ns(&self, number: usize) -> u64 {
        /// Between scans where times are not known.
        const TURN_NS: u64 = 100_000_000;
        let since_start =
            self.times.as_ref().map_or(number as u64 * TURN_NS, |times| times[number]);
        self.start_ns.saturating_add(since_start)
    }

    fn scan(&self, path: &Path, is_known: &[bool], taxonomy: &str) -> Result<Scan> {
        let mut scan = Scan::read(path, ScanFormat::Bin, None)?;
        let label = Path::new(path.file_name().unwrap_or_default()).with_extension("label");
        for folder in &self.labels {
            let label = folder.path.join(&label);
            let words = append_labels(&mut scan, &label, folder.fields)?;
            check_classes(&words, is_known, taxonomy, &label)?;
        }
        Ok(scan)
    }

    fn write_calibration(
        &self,
        calibration: &OdometryCalibration,
        text: &[u8],
        recording: &mut CloudRecording,
    ) -> Result<()> {
        let stamp_ns = self.stamp_ns(0);
        recording.attach_text("calib.txt", stamp_ns, text)?;
        if let Some(camera_from_scanner) = calibration.camera_from_scanner {
            let pose = camera_from_scanner.inverse();
            let transform = Transform { stamp_ns, parent: SENSOR_FRAME, child: CAMERA_FRAME, pose };
            recording.write_static_pose(stamp_ns, &transform)?;
        }
        let mut message = Vec::new();
        for (camera, projection) in &calibration.projections {
            camera_info(stamp_ns, CAMERA_FRAME, projection, &mut message);
            let topic = format!("/camera_{camera}/camera_info");
            recording.write_once(&topic, &CAMERA_INFO, stamp_ns, &message)?;
        }
        Ok(())
    }

    /// Times, calibration and poses, as far as they are there.
    fn read_drive_files(&mut self, problems: &mut Problems) -> Result<()> {
        let scans = self.scans.len();
        self.times = self.drive_file(
            "times.txt",
            "ten scans a second instead",
            drive_files::times,
            problems,
        )?;
        self.check_lines("times.txt", self.times.as_ref().map(Vec::len), problems);
        let calibration = self.drive_file(
            "calib.txt",
            "no camera, no /tf",
            OdometryCalibration::parse,
            problems,
        )?;
        if let Some(calibration) = calibration {
            self.calibration = Some((calibration, read(&self.path.join("calib.txt"))?));
        }
        let poses = self.drive_file("poses.txt", "no /tf", drive_files::poses, problems)?;
        self.check_lines("poses.txt", poses.as_ref().map(Vec::len), problems);
        let (Some(poses), Some((calibration, _))) = (poses, &self.calibration) else {
            return Ok(());
        };
        match calibration.camera_from_scanner {
            None => self.notes.push("no Tr in calib.txt: no /tf, and poses.txt is not used".into()),
            Some(tr) => {
                let of_scanner = poses.iter().take(scans).map(|pose| tr.inverse() * pose * tr);
                self.poses = Some(of_scanner.collect());
            }
        }
        Ok(())
    }

    /// A text file of the folder, read; a note with `without` if it is not there.
    fn drive_file<T>(
        &mut self,
        name: &str,
        without: &str,
        parse: impl Fn(&str) -> std::result::Result<T, String>,
        problems: &mut Problems,
    ) -> Result<Option<T>> {
        let path = self.path.join(name);
        if !path.exists() {
            self.notes.push(format!("no {name}: {without}"));
            return Ok(None);
        }
        match parse(&String::from_utf8_lossy(&read(&path)?)) {
            Ok(parsed) => Ok(Some(parsed)),
            Err(problem) => {
                problems.add(format!("{name}: {problem}"));
                Ok(None)
            }
        }
    }

    /// A line for each scan at least.
    fn check_lines(&mut self, name: &str, lines: Option<usize>, problems: &mut Problems) {
        let scans = self.scans.len();
        match lines {
            Some(lines) if lines < scans => {
                problems.add(format!("{name} has {lines} lines for {scans} scans"));
            }
            Some(lines) if lines > scans => {
                let what = "the rest is not used (are scans missing at the end?)";
                self.notes.push(format!("{name} has {lines} lines for {scans} scans: {what}"));
            }
            _ => {}
        }
    }

    fn metadata(&self) -> BTreeMap<String, String> {
        let there = |is: bool, what: &str| if is { what.to_owned() } else { "none".to_owned() };
        let projections = self.calibration.as_ref().map_or(0, |(c, _)| c.projections.len());
        let fields = self.labels.iter().flat_map(|folder| folder.fields).collect::<Vec<_>>();
        let entries = [
            ("source", "SemanticKITTI".to_owned()),
            (SEQUENCE_KEY, self.name.clone()),
            ("frames", self.len().to_string()),
            ("labels", there(!fields.is_empty(), &fields.join(", "))),
            ("times", self.times.as_ref().map_or("10 Hz", |_| "times.txt").to_owned()),
            ("start_ns", self.start_ns.to_string()),
            ("calibration", there(self.calibration.is_some(), "calib.txt")),
            ("cameras", projections.to_string()),
            ("poses", there(self.poses.is_some(), "poses.txt")),
            ("notes", self.notes.join("; ")),
        ];
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }
}

/// The folders of labels that are asked for.
fn label_folders(name: &str, folder: &Path, options: &SequenceOptions) -> Vec<LabelFolder> {
    let mut folders = Vec::new();
    if options.labels {
        folders.push(LabelFolder { path: folder.join("labels"), fields: LABEL_FIELDS });
    }
    if let Some(root) = &options.predictions {
        let sequence = root.join("sequences").join(name);
        let kinds = ["predictions", "labels"].map(|kind| sequence.join(kind));
        let path = kinds.iter().find(|path| path.is_dir()).unwrap_or(&kinds[0]).clone();
        folders.push(LabelFolder { path, fields: PREDICTION_FIELDS });
    }
    folders
}
