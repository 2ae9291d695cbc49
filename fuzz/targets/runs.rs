//! What each target runs on its input.

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use divmerge::annotate::{
    self, AnnotateConfig, AnnotateOptions, MessageTypes, RunEvent, Semantics, annotate_message,
};
use divmerge::datasets::class_files::ClassFiles;
use divmerge::datasets::kitti_boxes::KittiBoxes;
use divmerge::datasets::scans::{Scan, ScanFormat};
use divmerge::datasets::semantic_kitti::{drive_files, read_labels, read_scan};
use divmerge::frames::EncodedCloud;
use divmerge::messages::boxes::marker_boxes;
use divmerge::messages::clouds::CloudFormat;
use divmerge::pipeline::{self, Config};
use divmerge::recording::{Item, Overview, Part, Record, RecordingReader};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::{Taxonomy, error};

use super::Ended;
use crate::mutate::Mutator;
use crate::{clouds, recordings, seeds};

/// How a decoder ends, in words.
pub(super) trait Ends {
    fn ends(self) -> Ended;
}

impl<T, E: ToString> Ends for Result<T, E> {
    fn ends(self) -> Ended {
        self.map(|_| "read".to_owned()).map_err(|error| error.to_string())
    }
}

pub(super) fn taxonomy() -> &'static Taxonomy {
    static TAXONOMY: OnceLock<Taxonomy> = OnceLock::new();
    TAXONOMY.get_or_init(Taxonomy::semantic_kitti)
}

pub(super) fn packed_cloud(format: CloudFormat, bytes: &[u8]) -> Ended {
    let wire = format.decode(bytes).map_err(|error| error.to_string())?;
    let mut again = Vec::new();
    wire.encode(&mut again).map_err(|error| format!("wrong: parsed but not encoded: {error}"))?;
    let parsed = format.decode(&again).map_err(|error| format!("wrong: own output: {error}"))?;
    let mut third = Vec::new();
    parsed.encode(&mut third).map_err(|error| format!("wrong: own output: {error}"))?;
    // Compared as bytes: numbers may be no numbers.
    if again != third || parsed.data != wire.data || parsed.fields != wire.fields {
        return Err("wrong: what was written reads otherwise".into());
    }
    if wire.points().count() != wire.point_count() && wire.point_step > 0 {
        return Err(format!("wrong: {} points", wire.points().count()));
    }
    let names: Vec<String> = wire.fields.iter().map(|field| field.name.clone()).take(16).collect();
    for name in &names {
        let _ = (wire.column_f64(name), wire.column_i64(name), wire.column_u32(name));
    }
    wire.to_cloud(wire.semantic_field()).ends()
}

pub(super) fn message(bytes: &[u8]) -> Ended {
    static METHODS: OnceLock<[AnnotateConfig; 2]> = OnceLock::new();
    let methods = METHODS.get_or_init(|| {
        [Semantics::Auto, Semantics::Ground]
            .map(|semantics| AnnotateConfig { semantics, ..AnnotateConfig::default() })
    });
    let method = &methods[bytes.len() % 2];
    let mut annotated = annotate::Annotated::default();
    let (format, types) = (CloudFormat::Ros2, MessageTypes::default());
    let encoded = EncodedCloud::of_message(format, bytes.to_vec());
    let clustered = annotate_message(&encoded, method, &types, &mut annotated)
        .map_err(|error| error.to_string())?;
    let wire =
        format.decode(&annotated.cloud).map_err(|error| format!("wrong: own message: {error}"))?;
    if wire.point_count() != clustered.stages.labels.reason.len() {
        return Err("wrong: not a label for each point".into());
    }
    marker_boxes(&annotated.objects, true, taxonomy())
        .map_err(|error| format!("wrong: own boxes: {error}"))?;
    Ok(clustered.stages.image.projection.describe().to_owned())
}

pub(super) fn cluster(bytes: &[u8]) -> Ended {
    let cloud = clouds::wild(bytes);
    let ground = GroundParams::default();
    let choice = bytes.get(3).copied().unwrap_or(0);
    let mask = match (choice % 3, cloud.class.is_some()) {
        (0, true) => MaskSource::Classes(taxonomy()),
        (1, _) => MaskSource::NotGround(&ground),
        _ => MaskSource::All,
    };
    let config = match choice / 3 % 4 {
        0 => Config::paper(),
        1 => Config::authors(),
        _ => Config::best(),
    };
    let stages = pipeline::run(&cloud, mask, &config);
    if stages.labels.reason.len() != cloud.len() {
        return Err("wrong: not a label for each point".into());
    }
    let places = stages.labels.instance.iter().map(|&id| id as usize);
    if places.max().unwrap_or(0) > stages.instances.len() {
        return Err("wrong: an instance that does not exist".into());
    }
    Ok(format!("{}, {}", stages.image.projection.describe(), config.preset))
}

pub(super) fn scan(bytes: &[u8], format: ScanFormat) -> Ended {
    let scan = Scan::parse(bytes.to_vec(), format, None).map_err(|error| error.to_string())?;
    let mut message = Vec::new();
    let wire = scan.message(1, "lidar").map_err(|error| error.to_string())?;
    wire.encode(&mut message).map_err(|error| format!("wrong: a scan without message: {error}"))?;
    Ok(format!("read, {}", scan.left_out.len()))
}

pub(super) fn bin(bytes: &[u8]) -> Ended {
    let path = place("scan.bin", bytes);
    let _ = (read_scan(&path), read_labels(&path));
    scan(bytes, ScanFormat::Bin)
}

pub(super) fn kitti(bytes: &[u8]) -> Ended {
    const CALIBRATION: &str =
        "R0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: 0 -1 0 0 0 0 -1 0 1 0 0 0\n";
    let folder = folder().join("kitti");
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join("000000.txt"), bytes).expect("a file");
    let (good, any) = (place("good.txt", CALIBRATION.as_bytes()), place("any.txt", bytes));
    let boxes = KittiBoxes::open(&folder, &good, taxonomy()).expect("a good calibration");
    let found = boxes.of(0).ends();
    let calibration = KittiBoxes::open(&folder, &any, taxonomy()).ends();
    let text = String::from_utf8_lossy(bytes);
    let odometry = drive_files::OdometryCalibration::parse(&text).is_ok();
    let (poses, times) = (drive_files::poses(&text).is_ok(), drive_files::times(&text).is_ok());
    Ok(format!("{found:?} {calibration:?} {odometry} {poses} {times}"))
}

pub(super) fn class_array(bytes: &[u8]) -> Ended {
    let folder = folder().join("classes");
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join("0.npy"), bytes).expect("a file");
    let files = ClassFiles::open(&folder, taxonomy(), 0).expect("a file of classes");
    files.of("/points", 0, 0, 5).ends()
}

pub(super) fn yaml(bytes: &[u8]) -> Ended {
    divmerge::taxonomy_file::read_taxonomy(&place("taxonomy.yaml", bytes)).ends()
}

/// A recording of any shape whose records may be changed, and whose chunks may lie.
pub(super) fn recording(mutator: &mut Mutator) -> Vec<u8> {
    let shape = recordings::Shape::any(mutator);
    let mut records = recordings::records(&small_clouds()[..1 + mutator.below(3)]);
    if !mutator.once_in(4) {
        recordings::change(&mut records, mutator);
    }
    let lies = mutator.once_in(2);
    let mut bytes = recordings::file(&records, shape, |_, body| {
        if lies && mutator.once_in(3) {
            let mut front: Vec<u8> = body.drain(..body.len().min(48)).collect();
            mutator.mutate(&mut front, &[], &[]);
            body.splice(0..0, front);
        }
    });
    match mutator.below(8) {
        0 => bytes.truncate(mutator.below(bytes.len())),
        1 => {
            let length = mutator.below(40);
            bytes.extend(mutator.noise(length));
        }
        _ => {}
    }
    bytes
}

/// Clouds of at most 64 points: recordings of them take microseconds.
fn small_clouds() -> &'static [Vec<u8>] {
    static CLOUDS: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    CLOUDS.get_or_init(|| {
        let clouds = seeds::clouds();
        clouds.into_iter().filter(|cloud| cloud.len() < 16 << 10).take(3).collect()
    })
}

/// A recording of each of many shapes, most without checksums, which would end every changed one
/// early.
pub(super) fn whole_recordings() -> Vec<Vec<u8>> {
    let mut mutator = Mutator::new(1);
    let records = recordings::records(&small_clouds()[..2]);
    let mut shapes: Vec<_> = (0..40).map(|_| recordings::Shape::any(&mut mutator)).collect();
    shapes.iter_mut().skip(8).for_each(|shape| shape.has_crc = false);
    shapes.into_iter().map(|shape| recordings::file(&records, shape, |_, _| ())).collect()
}

/// How many records of each kind are read before the end, and how it ends.
#[derive(Debug, PartialEq, Default)]
struct Seen {
    messages: Vec<(u16, u32, u64, u64, Vec<u8>)>,
    others: Vec<Record<'static>>,
    error: Option<String>,
}

impl Seen {
    fn take(&mut self, record: Record) {
        match record {
            Record::Message { header, data, .. } => {
                let times = (header.log_time, header.publish_time);
                let message =
                    (header.channel_id, header.sequence, times.0, times.1, data.into_owned());
                self.messages.push(message);
            }
            other => self.others.push(other.into_owned()),
        }
    }

    fn take_item(&mut self, item: Item) {
        match item {
            Item::Record(record) => self.take(record),
            Item::Message { header, data, position } => {
                let data = std::borrow::Cow::Owned(data.to_vec());
                self.take(Record::Message { header, data, position });
            }
        }
    }

    fn by_records(path: &Path) -> error::Result<Seen> {
        let mut reader = RecordingReader::open(path)?;
        let mut seen = Seen::default();
        loop {
            match reader.next_record() {
                Ok(Some(record)) => seen.take(record),
                Ok(None) => break,
                Err(error) => {
                    seen.error = Some(error.to_string());
                    break;
                }
            }
        }
        Ok(seen)
    }

    fn by_parts(path: &Path) -> error::Result<Seen> {
        let mut reader = RecordingReader::open(path)?;
        let mut seen = Seen::default();
        loop {
            match reader.next_part() {
                Ok(Some(Part::Chunk(chunk))) => {
                    chunk.items.into_iter().for_each(|item| seen.take_item(item));
                }
                Ok(Some(Part::Items(items))) => {
                    items.into_iter().for_each(|item| seen.take_item(item));
                }
                Ok(None) => break,
                Err(error) => {
                    seen.error = Some(error.to_string());
                    break;
                }
            }
        }
        Ok(seen)
    }

    /// Kept records, without what is said of the file.
    fn kept(&self) -> impl Iterator<Item = &Record<'static>> {
        let said = |record: &&Record| {
            matches!(
                record,
                Record::Header { .. } | Record::Damaged { .. } | Record::Truncated { .. }
            )
        };
        self.others.iter().filter(move |record| !said(record))
    }
}

pub(super) fn read(bytes: &[u8]) -> Ended {
    let path = place("in.mcap", bytes);
    let overview = Overview::read(&path).ends();
    let records = Seen::by_records(&path).map_err(|error| error.to_string())?;
    let parts = Seen::by_parts(&path).map_err(|error| error.to_string())?;
    // Parts come whole: what of a chunk precedes an error is not given.
    if records.error != parts.error || (records.error.is_none() && records != parts) {
        return Err(format!(
            "wrong: records end in {:?}, parts in {:?}",
            records.error, parts.error
        ));
    }
    Ok(format!("{overview:?} {:?}", records.error))
}

pub(super) fn annotate(bytes: &[u8]) -> Ended {
    let input = place("in.mcap", bytes);
    let output = folder().join("out.mcap");
    let options = AnnotateOptions { threads: 1, force: true, ..AnnotateOptions::default() };
    let ended =
        annotate::annotate(&input, &output, &options, &mut |_: RunEvent| ControlFlow::Continue(()));
    let leftover = fs::read_dir(folder()).into_iter().flatten().flatten();
    if let Some(file) = leftover
        .map(|file| file.file_name())
        .find(|name| name.to_string_lossy().ends_with(".partial"))
    {
        return Err(format!("wrong: left {}", file.display()));
    }
    let report = ended.map_err(|error| error.to_string())?;
    let before = Seen::by_records(&input).map_err(|error| format!("wrong: input: {error}"))?;
    let after = Seen::by_records(&output).map_err(|error| format!("wrong: output: {error}"))?;
    let own = Overview::read(&output).map_err(|error| format!("wrong: output: {error}"))?;
    if let Some(error) = &after.error {
        return Err(format!("wrong: output: {error}"));
    }
    if !own.is_complete || !own.from_summary {
        return Err("wrong: the output has no good end".into());
    }
    let mut rest = after.messages.iter();
    if !before.messages.iter().all(|message| rest.any(|other| other == message)) {
        return Err("wrong: a message of the input is not in the output".into());
    }
    if let Some(lost) = before.kept().find(|record| !after.others.contains(record)) {
        return Err(format!("wrong: not in the output: {lost:?}"));
    }
    Ok(format!("{} warnings, complete: {}", report.warnings.len(), report.is_complete()))
}

/// This process's own folder, in memory where the system has such a place. The one that started it
/// removes it.
pub(super) fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = crate::scratch(std::process::id());
        fs::create_dir_all(&folder).expect("a folder");
        folder
    })
}

pub(super) fn place(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    fs::write(&path, bytes).expect("a file");
    path
}
