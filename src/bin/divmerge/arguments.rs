//! Arguments that several commands share, and how their values are read.

use std::ops::Bound;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, ValueEnum};
use divmerge::Taxonomy;
use divmerge::annotate::{Method, Semantics};
use divmerge::baselines::{Alpine, AnyBaseline};
use divmerge::cluster::params::{BirdsEye, ClusterParams, Region};
use divmerge::io::{BoxSource, FrameBoxes, Overview};
use divmerge::pipeline::Config;
use divmerge::replay::FrameRange;
use divmerge::semantics::GroundParams;

/// What is an object.
#[derive(Args)]
pub struct ObjectArguments {
    /// Where objects come from: `field:NAME` a semantic class per point; `ground` everything that ground
    /// removal leaves; `all` every return; `auto` a field label, semantic, class_id or class_ids if the
    /// cloud has one, else ground
    #[arg(long, value_name = "SOURCE", default_value = "auto", value_parser = semantics)]
    semantics: Semantics,

    /// What the ids of a semantic field mean: a YAML file in semantic-kitti-api's form, with an optional
    /// map `thing_class` (class: true) [default: SemanticKITTI's ids]
    #[arg(long, value_name = "FILE")]
    taxonomy: Option<PathBuf>,
}

impl ObjectArguments {
    /// Preset `best` on these objects.
    pub fn method(&self) -> Result<Method> {
        Ok(Method {
            semantics: self.semantics.clone(),
            taxonomy: taxonomy(self.taxonomy.as_deref())?,
            ground: GroundParams::default(),
            config: Config::best(),
            boxes: FrameBoxes::Nothing,
        })
    }
}

/// How clouds are cut into instances.
#[derive(Args)]
pub struct MethodArguments {
    #[command(flatten)]
    objects: ObjectArguments,

    /// Who cuts the objects into instances; the others, from their papers, take the place of divide, merge and
    /// what follows: projection, object mask and back-projection stay those of the preset
    #[arg(long, value_enum, value_name = "METHOD", default_value_t = Cutter::DivideAndMerge)]
    method: Cutter,

    /// Boxes for `--method boxes`, all in the clouds' frame: `topic:NAME` a MarkerArray or Detection3DArray of the
    /// recording (a cloud's are those with its stamp, else the nearest within half a cloud period); `kitti:DIR`
    /// KITTI label files NNNNNN.txt by the number of the cloud, with --boxes-calibration
    #[arg(long, value_name = "SOURCE", value_parser = box_source)]
    boxes: Option<BoxesFrom>,

    /// KITTI's calibration for all clouds, or a folder of one for each, NNNNNN.txt
    #[arg(long, value_name = "PATH", requires = "boxes")]
    boxes_calibration: Option<PathBuf>,

    /// How far outside a box a point may lie in metres [default: 0.1]
    #[arg(long, value_name = "M", value_parser = not_negative, requires = "boxes")]
    boxes_margin: Option<f64>,

    /// Leave out boxes less sure than this [default: 0; boxes without a score have 1]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true, requires = "boxes")]
    least_score: Option<f64>,

    /// Parameters to start from; each of the following overrides one of them
    #[arg(long, value_enum, default_value_t = Preset::Best)]
    preset: Preset,

    /// Side of a voxel of the divide step in metres [best, paper: 0.5; authors: 0.2]
    #[arg(long, value_name = "M", value_parser = positive)]
    voxel: Option<f64>,

    /// Least angle beta between neighbours of one object in degrees [best, paper: 10; authors: 8.6]
    #[arg(long, value_name = "DEG", value_parser = angle)]
    angle: Option<f64>,

    /// Most columns from a pixel to its neighbour [best: 2; paper: 1; authors: any]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    gap_columns: Option<usize>,

    /// Most rows from a pixel to its neighbour [best: 2; paper: 1; authors: 10]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    gap_rows: Option<usize>,

    /// Instances seen in fewer pixels (one point each) become "too small" [best, paper: 0; authors: 31]
    #[arg(long, value_name = "N")]
    min_points: Option<usize>,

    /// Merge instances of one class on the bird's-eye plane: `size` by gap and size, the others where the
    /// named regions overlap [best: size; paper: box; authors: box, of any class]
    #[arg(long, value_enum, value_name = "REGION")]
    bev: Option<Bev>,
}

/// Parameters to start from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Preset {
    /// Ours: free to differ from the paper where measurement says so
    Best,
    /// The paper to the letter
    Paper,
    /// What the authors' released C++ does, less its memory errors
    Authors,
}

impl Preset {
    /// The parameters.
    pub fn config(self) -> Config {
        match self {
            Preset::Best => Config::best(),
            Preset::Paper => Config::paper(),
            Preset::Authors => Config::authors(),
        }
    }
}

/// Who cuts objects into instances.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Cutter {
    /// Zhao, Zhang and Huang 2021: this program's own
    DivideAndMerge,
    /// Neighbours in the range image whose angle beta exceeds 8.6 degrees (Bogoslavskyi and Stachniss 2016)
    DepthClustering,
    /// Runs of near points in a beam, joined to the beam above (Zermas et al. 2017)
    ScanLineRun,
    /// Points within half a metre of each other (Rusu 2010)
    Euclidean,
    /// DBSCAN, 0.5 m and 5 points (Ester et al. 1996)
    Dbscan,
    /// Supervoxels of 0.5 m voxels from seeds 8 m apart (VCCS, Papon et al. 2013)
    Supervoxel,
    /// Nearest neighbours on the ground plane, split by the size of the class (Sautier et al. 2025)
    Alpine,
    /// Cut out by the 3-D detection boxes of --boxes (Behley et al. 2020)
    Boxes,
    /// All objects of a class are one
    OnePerClass,
}

/// The source of boxes as it is written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum BoxesFrom {
    /// A topic of the recording.
    Topic(String),
    /// A folder of KITTI label files.
    Kitti(PathBuf),
}

impl Cutter {
    /// The method with its usual parameters; `None`: divide and merge.
    pub fn baseline(self, taxonomy: &Taxonomy) -> Option<AnyBaseline> {
        match self {
            Cutter::DivideAndMerge => None,
            Cutter::DepthClustering => Some(AnyBaseline::DepthClustering(Default::default())),
            Cutter::ScanLineRun => Some(AnyBaseline::ScanLineRun(Default::default())),
            Cutter::Euclidean => Some(AnyBaseline::Euclidean(Default::default())),
            Cutter::Dbscan => Some(AnyBaseline::Dbscan(Default::default())),
            Cutter::Supervoxel => Some(AnyBaseline::Supervoxel(Default::default())),
            Cutter::Alpine => Some(AnyBaseline::Alpine(Alpine::new(taxonomy))),
            Cutter::Boxes => Some(AnyBaseline::Boxes(Default::default())),
            Cutter::OnePerClass => Some(AnyBaseline::OnePerClass(Default::default())),
        }
    }
}

/// What stands for an instance on the bird's-eye plane.
#[derive(Clone, Copy, ValueEnum)]
enum Bev {
    /// No such merge
    Off,
    /// Fragments that touch, or that fit one object of their class; without classes by the gaps alone
    Size,
    /// Axis-aligned boxes
    Box,
    /// Rectangles of least area
    Rectangle,
    /// Convex hulls
    Hull,
}

impl MethodArguments {
    /// The method that the arguments ask for, for the clouds of a recording. Wrong usage ends the program.
    pub fn method(&self, recording: &Path) -> Result<Method> {
        let box_source = self.box_source();
        let mut config = self.preset.config();
        let params = &mut config.cluster;
        if let Some(degrees) = self.angle {
            params.condition.angle = degrees.to_radians();
        }
        params.voxel = self.voxel.unwrap_or(params.voxel);
        params.gap_columns = self.gap_columns.unwrap_or(params.gap_columns);
        params.gap_rows = self.gap_rows.unwrap_or(params.gap_rows);
        params.min_pixels = self.min_points.unwrap_or(params.min_pixels);
        if let Some(bev) = self.bev {
            params.fragments = match bev {
                Bev::Size => ClusterParams::best().fragments,
                _ => None,
            };
            params.gaps = match bev {
                Bev::Size => ClusterParams::best().gaps,
                _ => None,
            };
        }
        params.birds_eye = match self.bev {
            None => params.birds_eye,
            Some(Bev::Off | Bev::Size) => None,
            Some(Bev::Box) => Some(region(params.birds_eye, Region::Box)),
            Some(Bev::Rectangle) => Some(region(params.birds_eye, Region::Rectangle)),
            Some(Bev::Hull) => Some(region(params.birds_eye, Region::Hull)),
        };
        if let Some(birds_eye) = &params.birds_eye
            && !birds_eye.transitive
            && birds_eye.region != Region::Box
        {
            bail!("preset `authors` merges on the bird's-eye plane with boxes or not at all");
        }
        let method = self.objects.method()?;
        config.baseline = self.method.baseline(&method.taxonomy);
        if let Some(AnyBaseline::Boxes(boxes)) = &mut config.baseline {
            boxes.margin = self.boxes_margin.unwrap_or(boxes.margin);
            boxes.least_score = self.least_score.unwrap_or(boxes.least_score);
        }
        let boxes = match &box_source {
            Some(source) => FrameBoxes::open(source, recording, &method.taxonomy)?,
            None => FrameBoxes::Nothing,
        };
        Ok(Method { config, boxes, ..method })
    }

    /// Where boxes are. Ends the program with exit code 2 if that and the method do not fit each other.
    fn box_source(&self) -> Option<BoxSource> {
        use ErrorKind::{ArgumentConflict, MissingRequiredArgument};
        let calibration = self.boxes_calibration.clone();
        match (self.method, &self.boxes, calibration) {
            (Cutter::Boxes, Some(BoxesFrom::Topic(topic)), None) => {
                Some(BoxSource::Topic(topic.clone()))
            }
            (Cutter::Boxes, Some(BoxesFrom::Kitti(labels)), Some(calibration)) => {
                Some(BoxSource::Kitti { labels: labels.clone(), calibration })
            }
            (Cutter::Boxes, None, _) => wrong_usage(
                MissingRequiredArgument,
                "--method boxes needs boxes: --boxes topic:NAME, or --boxes kitti:DIR with --boxes-calibration \
                 PATH",
            ),
            (Cutter::Boxes, Some(BoxesFrom::Kitti(_)), None) => wrong_usage(
                MissingRequiredArgument,
                "--boxes kitti:DIR needs --boxes-calibration PATH: KITTI's boxes are in a camera's frame",
            ),
            (Cutter::Boxes, Some(BoxesFrom::Topic(_)), Some(_)) => wrong_usage(
                ArgumentConflict,
                "--boxes-calibration is for --boxes kitti:DIR; boxes of a topic are in the clouds' frame",
            ),
            (_, Some(_), _) => wrong_usage(
                ArgumentConflict,
                "--boxes is for --method boxes; no other method looks at boxes",
            ),
            (_, None, _) => None,
        }
    }
}

/// Ends the program with exit code 2.
fn wrong_usage(kind: ErrorKind, problem: &str) -> ! {
    crate::Cli::command().error(kind, problem).exit()
}

fn box_source(text: &str) -> Result<BoxesFrom, String> {
    match text.split_once(':') {
        Some(("topic", name)) if !name.is_empty() => Ok(BoxesFrom::Topic(name.to_owned())),
        Some(("kitti", folder)) if !folder.is_empty() => Ok(BoxesFrom::Kitti(folder.into())),
        _ => Err("use topic:NAME or kitti:DIR".into()),
    }
}

/// The taxonomy of a file, or SemanticKITTI's.
pub fn taxonomy(file: Option<&Path>) -> Result<Taxonomy> {
    Ok(match file {
        Some(path) => Taxonomy::from_yaml_file(path)?,
        None => Taxonomy::semantic_kitti(),
    })
}

/// The preset's bird's-eye merge with another region.
fn region(preset: Option<BirdsEye>, region: Region) -> BirdsEye {
    BirdsEye {
        region,
        ..preset.unwrap_or(BirdsEye {
            region,
            margin: 0.0,
            same_class: true,
            transitive: true,
            grown_pixels_only: false,
        })
    }
}

fn semantics(text: &str) -> Result<Semantics, String> {
    match text {
        "auto" => Ok(Semantics::Auto),
        "ground" => Ok(Semantics::Ground),
        "all" => Ok(Semantics::All),
        _ => match text.strip_prefix("field:") {
            Some(name) if !name.is_empty() => Ok(Semantics::Field(name.to_owned())),
            _ => Err("use auto, field:NAME, ground or all".into()),
        },
    }
}

pub fn number(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if number.is_finite() { Ok(number) } else { Err("not a finite number".into()) }
}

pub fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|n| if n > 0.0 { Ok(n) } else { Err("must be above 0".into()) })
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|n| if n >= 0.0 { Ok(n) } else { Err("must not be below 0".into()) })
}

fn angle(text: &str) -> Result<f64, String> {
    let in_range = |n| {
        if (0.0..90.0).contains(&n) { Ok(n) } else { Err("must be in 0..90".into()) }
    };
    number(text).and_then(in_range)
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err("must be a whole number from 1 on".into()),
        Ok(n) => Ok(n),
    }
}

/// A point in time: seconds from the recording's start, or an absolute log time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// Seconds after the first message.
    FromStart(f64),
    /// Nanoseconds since the epoch.
    Absolute(u64),
}

impl Moment {
    /// The log time in nanoseconds, given that of the recording's first message.
    pub fn log_time(self, start_ns: u64) -> u64 {
        match self {
            Moment::FromStart(seconds) => start_ns.saturating_add((seconds * 1e9).round() as u64),
            Moment::Absolute(nanoseconds) => nanoseconds,
        }
    }
}

/// Reads `12.5` as seconds from the start, `@1317384506.4` as seconds since 1970.
pub fn moment(text: &str) -> Result<Moment, String> {
    let (absolute, digits) = match text.strip_prefix('@') {
        Some(digits) => (true, digits),
        None => (false, text.strip_suffix('s').unwrap_or(text)),
    };
    let seconds = number(digits).map_err(|_| {
        "use seconds from the start (12.5) or since 1970 (@1317384506.4)".to_owned()
    })?;
    if seconds < 0.0 {
        return Err("must not be negative".into());
    }
    if !absolute {
        return Ok(Moment::FromStart(seconds));
    }
    since_1970(digits).map(Moment::Absolute)
}

/// Reads seconds since 1970, with a fraction or without, as nanoseconds.
pub fn since_1970(text: &str) -> Result<u64, String> {
    // Through text: a double does not hold nanoseconds since 1970.
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let nanoseconds: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    match (whole.parse::<u64>(), nanoseconds.parse::<u64>()) {
        (Ok(whole), Ok(nanoseconds)) => whole
            .checked_mul(1_000_000_000)
            .and_then(|whole| whole.checked_add(nanoseconds))
            .ok_or_else(|| "too far in the future".to_owned()),
        _ => Err("use seconds since 1970, as in 1317384506.4".into()),
    }
}

/// The log times in nanoseconds that two moments of a recording stand for.
pub fn window(
    input: &Path,
    from: Option<Moment>,
    to: Option<Moment>,
) -> Result<(Option<u64>, Option<u64>)> {
    if from.is_none() && to.is_none() {
        return Ok((None, None));
    }
    let start = Overview::read(input)?.start_ns.unwrap_or(0);
    let [from, to] = [from, to].map(|moment| moment.map(|moment| moment.log_time(start)));
    if let (Some(from), Some(to)) = (from, to)
        && from >= to
    {
        bail!("--from must lie before --to");
    }
    Ok((from, to))
}

/// Reads `5..10` (10 is left out), `5..`, `..10` or `5`.
pub fn frames(text: &str) -> Result<FrameRange, String> {
    let wrong = |_| "use numbers from 0, as in 5..10 (10 is left out), 5.., ..10 or 5".to_owned();
    let number = |text: &str| text.trim().parse::<u64>().map_err(wrong);
    let Some((first, end)) = text.split_once("..") else {
        let frame = number(text)?;
        return Ok((Bound::Included(frame), Bound::Included(frame)));
    };
    let bound = |text: &str, bound: fn(u64) -> Bound<u64>| match text.trim() {
        "" => Ok(Bound::Unbounded),
        text => number(text).map(bound),
    };
    let range = (bound(first, Bound::Included)?, bound(end, Bound::Excluded)?);
    if let (Bound::Included(first), Bound::Excluded(end)) = range
        && first >= end
    {
        return Err("there is no frame in it".into());
    }
    Ok(range)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments() {
        assert_eq!(moment("12.5"), Ok(Moment::FromStart(12.5)));
        assert_eq!(moment("12.5s"), Ok(Moment::FromStart(12.5)));
        assert_eq!(moment("@1317384506.4"), Ok(Moment::Absolute(1_317_384_506_400_000_000)));
        assert_eq!(moment("@7"), Ok(Moment::Absolute(7_000_000_000)));
        assert!(moment("-1").is_err() && moment("noon").is_err() && moment("@1e3").is_err());
        assert_eq!(Moment::FromStart(1.5).log_time(10), 1_500_000_010);
    }

    #[test]
    fn frame_ranges() {
        use Bound::{Excluded, Included, Unbounded};
        assert_eq!(frames("5..10"), Ok((Included(5), Excluded(10))));
        assert_eq!(frames("5.."), Ok((Included(5), Unbounded)));
        assert_eq!(frames("..10"), Ok((Unbounded, Excluded(10))));
        assert_eq!(frames("7"), Ok((Included(7), Included(7))));
        assert!(["", "a..b", "-1", "5..5", "9..3", "1...3"].iter().all(|t| frames(t).is_err()));
    }
}
