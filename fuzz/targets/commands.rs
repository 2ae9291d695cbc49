//! What the commands make of wild clouds: other methods, figures, explanations, triage, scores,
//! label files and recordings of scans.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use divmerge::comparison::methods;
use divmerge::datasets::scans::{FolderOptions, ScanFolder};
use divmerge::datasets::semantic_kitti::{read_labels, write_labels};
use divmerge::diagnose::explain::{ClusteredCloud, Subject, explain, what_if};
use divmerge::diagnose::triage::{TriageParams, triage};
use divmerge::evaluate::{Evaluation, MetricSet, ScanLabels};
use divmerge::frames::EncodedClouds;
use divmerge::pipeline::{self, Config};
use divmerge::recording::WriteOptions;
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::view::{self, FigureOptions, FrameScene, Panel, PixelCrop, Theme};
use divmerge::{PointCloud, Stages};

use super::Ended;
use super::runs::{Ends, folder, place, taxonomy};
use crate::clouds;

/// Pixels to the inch: drawing is most of the time.
const DPI: f64 = 24.0;

/// A wild cloud, where its objects come from, a configuration, and the byte that chose them.
struct Case {
    cloud: PointCloud,
    ground: GroundParams,
    config: Config,
    choice: u8,
}

impl Case {
    fn of(bytes: &[u8]) -> Self {
        let choice = bytes.get(3).copied().unwrap_or(0);
        let config = match choice / 3 % 4 {
            0 => Config::paper(),
            1 => Config::authors(),
            _ => Config::best(),
        };
        Case { cloud: clouds::wild(bytes), ground: GroundParams::default(), config, choice }
    }

    fn mask(&self) -> MaskSource<'_> {
        match (self.choice % 3, self.cloud.class.is_some()) {
            (0, true) => MaskSource::Classes(taxonomy()),
            (1, _) => MaskSource::NotGround(&self.ground),
            _ => MaskSource::All,
        }
    }

    fn stages(&self) -> Stages {
        pipeline::run(&self.cloud, self.mask(), &self.config)
    }

    fn scene<'a>(&'a self, stages: &'a Stages) -> FrameScene<'a> {
        FrameScene {
            cloud: &self.cloud,
            stages,
            classes: &[],
            intensity: None,
            merge_ratio: self.config.cluster.merge_ratio,
            colour_numbers: Vec::new(),
            heading: "frame 0".into(),
            remark: String::new(),
            theme: Theme::default(),
        }
    }
}

/// Every other method.
pub(super) fn method(bytes: &[u8]) -> Ended {
    let mut case = Case::of(bytes);
    let name = methods::NAMES[bytes.len() % methods::NAMES.len()];
    case.config.other_method = methods::named(name, taxonomy());
    let stages = case.stages();
    let last = stages.labels.instance.iter().copied().max().unwrap_or(0);
    match last as usize <= stages.instances.len() {
        true => Ok(format!("{name}, {}", stages.image.projection.describe())),
        false => Err("wrong: an instance that does not exist".into()),
    }
}

/// A figure of one panel or two, mostly of a part of the image, drawn as PNG, SVG and PDF.
pub(super) fn figure(bytes: &[u8]) -> Ended {
    let case = Case::of(bytes);
    let stages = case.stages();
    let panels = Panel::NAMES.map(|(_, panel)| panel).into_iter();
    let mut panels: Vec<Panel> = panels.filter(|&panel| panel != Panel::Intensity).collect();
    let sum = sum(bytes);
    let first = sum % panels.len();
    panels.rotate_left(first);
    panels.truncate(1 + sum / 8 % 2);
    let crop = match sum % 16 {
        0 => PixelCrop::default(),
        _ => part(sum, &stages),
    };
    let options = FigureOptions { panels, crop, dpi: DPI, ..FigureOptions::default() };
    let page = view::figure(&case.scene(&stages), &options).map_err(|error| error.to_string())?;
    drawn(&page)
}

fn sum(bytes: &[u8]) -> usize {
    bytes.iter().map(|&byte| usize::from(byte)).sum()
}

/// Up to 64 rows and 256 columns of the image: pictures of whole ones would take nine tenths of the
/// time of an execution.
fn part(sum: usize, stages: &Stages) -> PixelCrop {
    let some = |size: usize, most: usize| {
        let start = sum % size.max(1);
        Some(start..(start + 1 + sum % most).min(size))
    };
    let image = &stages.image;
    PixelCrop { rows: some(image.rows(), 64), columns: some(image.columns(), 256) }
}

fn drawn(page: &view::Canvas) -> Ended {
    let svg = view::svg(page);
    if ["\"NaN", ",NaN", " NaN", "\"inf", ",inf", ",-inf"].iter().any(|wild| svg.contains(wild)) {
        return Err("wrong: a place on the page that is no number".into());
    }
    if !view::pdf(page).ends_with(b"%%EOF") {
        return Err("wrong: a PDF without an end".into());
    }
    let png = view::png(page, DPI).map_or("no picture", |_| "drawn");
    Ok(png.to_owned())
}

/// The explanation of two points, and of every fourth input its figure, which takes most of the
/// time.
pub(super) fn explanation(bytes: &[u8]) -> Ended {
    let case = Case::of(bytes);
    let stages = case.stages();
    let cloud = &case.cloud;
    let points: Vec<usize> = (0..cloud.len()).filter(|&point| cloud.is_return(point)).collect();
    let [Some(&first), Some(&last)] = [points.first(), points.last()] else {
        return Err("no return".into());
    };
    let subject = match first == last {
        true => Subject::Point(first),
        false => Subject::Pair(first, last),
    };
    let config = &case.config;
    let frame = ClusteredCloud { cloud, mask: case.mask(), config, stages: &stages };
    let found = explain(&frame, subject);
    if points.len() < 16 {
        let _ = what_if(&frame, subject);
    }
    if !sum(bytes).is_multiple_of(4) {
        return Ok(found.headline());
    }
    let page = view::explanation(&case.scene(&stages), &found, &found.headline(), DPI);
    drawn(&page).map(|drawn| format!("{drawn}, {}", found.headline()))
}

/// Triage of one cloud.
pub(super) fn suspects(bytes: &[u8]) -> Ended {
    let case = Case::of(bytes);
    let stages = case.stages();
    let (cloud, config) = (&case.cloud, &case.config);
    let frame = ClusteredCloud { cloud, mask: case.mask(), config, stages: &stages };
    let found = triage(&frame, &TriageParams::default());
    match found.suspects.iter().all(|suspect| (0.0..=1.0).contains(&suspect.score)) {
        true => Ok(found.suspects.first().map_or("none", |first| first.kind.name()).to_owned()),
        false => Err("wrong: a score outside of 0 to 1".into()),
    }
}

/// All scores of one scan, its own classes moved by a point for truth.
pub(super) fn scores(bytes: &[u8]) -> Ended {
    let case = Case::of(bytes);
    let stages = case.stages();
    let class: Vec<u32> = stages.labels.semantic.iter().map(|&class| class.into()).collect();
    let found = ScanLabels::of_columns(&class, stages.labels.instance.clone());
    let (mut other, mut instance) = (class, stages.labels.instance.clone());
    let by = other.len().min(1);
    other.rotate_right(by);
    instance.rotate_right(by);
    let truth = ScanLabels::of_columns(&other, instance);
    let metrics = MetricSet { taxonomy: taxonomy(), min_points: 2, entropy: true, over_time: true };
    let mut sums = Evaluation::new(metrics);
    sums.add(0, (&found, "found"), (&truth, "truth"), Some(&case.cloud))
        .map_err(|error| error.to_string())?;
    sums.end_sequence();
    serde_json::to_string(&sums.scores()).map(|_| "scored".to_owned()).map_err(|e| e.to_string())
}

/// The label file of a recording's clouds.
pub(super) fn labels(bytes: &[u8]) -> Ended {
    let input = place("in.mcap", bytes);
    let clouds = EncodedClouds::open(&input, None, 0..=u64::MAX).map_err(|e| e.to_string())?;
    let mut count = 0;
    for cloud in clouds {
        let cloud = cloud.map_err(|error| error.to_string())?;
        let wire = cloud.decode().map_err(|error| error.to_string())?;
        let words = wire.column_u32("label").map_err(|error| error.to_string())?;
        let path = folder().join("0.label");
        write_labels(&path, &words).map_err(|error| format!("wrong: not written: {error}"))?;
        if read_labels(&path).ok() != Some(words) {
            return Err("wrong: labels read otherwise than written".into());
        }
        count += 1;
    }
    Ok(format!("{count} clouds"))
}

/// A folder of one scan as a recording.
pub(super) fn scans(bytes: &[u8]) -> Ended {
    const KINDS: [&str; 3] = ["0.bin", "0.pcd", "0.npy"];
    let scans = folder().join("scans");
    let _ = fs::remove_dir_all(&scans);
    fs::create_dir_all(&scans).expect("a folder");
    let name = if bytes.starts_with(b"\x93NUMPY") { 2 } else { usize::from(bytes.contains(&b'#')) };
    fs::write(scans.join(KINDS[name]), bytes).expect("a file");
    let open = |folder: &Path| ScanFolder::open(folder, &FolderOptions::default());
    let found = open(&scans).map_err(|error| error.to_string())?;
    let options = WriteOptions { force: true, ..WriteOptions::default() };
    let output = folder().join("scans.mcap");
    found.write(&output, "/points", "lidar", &options, || ControlFlow::Continue(())).ends()
}
