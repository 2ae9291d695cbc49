//! Arguments that several commands share, and how their values are read.

use std::ops::Bound;
use std::path::Path;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use divmerge::Taxonomy;
use divmerge::annotate::Method;
use divmerge::baselines::{Alpine, AnyBaseline};
use divmerge::cluster::params::{BirdsEye, ClusterParams, Region};
use divmerge::pipeline::Config;
use divmerge::replay::{FrameRange, Selection};

use crate::boxes::BoxArguments;
use crate::geometry::GeometryArguments;
use crate::moments::{Moment, moment, window};
use crate::objects::ObjectArguments;

/// How clouds are cut into instances.
#[derive(Args)]
pub struct MethodArguments {
    #[command(flatten)]
    objects: ObjectArguments,

    /// Who cuts the objects into instances; the others, from their papers, take the place of divide, merge and
    /// what follows: projection, object mask and back-projection stay those of the preset
    #[arg(long, value_enum, value_name = "METHOD", default_value_t = Cutter::DivideAndMerge)]
    method: Cutter,

    #[command(flatten)]
    boxes: BoxArguments,

    #[command(flatten)]
    geometry: GeometryArguments,

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
        let box_source = self.boxes.source(self.method == Cutter::Boxes);
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
        self.geometry.set(&mut config.projection);
        let (sensor_frame, transforms) = self.geometry.frame(recording)?;
        let method = self.objects.method(recording)?;
        config.baseline = self.method.baseline(&method.taxonomy);
        self.boxes.set(&mut config);
        let boxes = BoxArguments::open(box_source.as_ref(), recording, &method.taxonomy)?;
        Ok(Method { config, boxes, sensor_frame, transforms, ..method })
    }
}

impl MethodArguments {
    /// The same arguments as words of a command line; nothing for those that were left out.
    pub fn words(&self) -> Vec<String> {
        let mut words = self.objects.words();
        let mut say = |name: &str, value| say(&mut words, name, value);
        say("method", (self.method != Cutter::DivideAndMerge).then(|| written(self.method)));
        say("preset", (self.preset != Preset::Best).then(|| written(self.preset)));
        say("voxel", self.voxel.map(|n| n.to_string()));
        say("angle", self.angle.map(|n| n.to_string()));
        say("gap-columns", self.gap_columns.map(|n| n.to_string()));
        say("gap-rows", self.gap_rows.map(|n| n.to_string()));
        say("min-points", self.min_points.map(|n| n.to_string()));
        say("bev", self.bev.map(written));
        words.extend(self.boxes.words());
        words.extend(self.geometry.words());
        words
    }
}

/// The taxonomy of a file, or SemanticKITTI's.
pub fn taxonomy(file: Option<&Path>) -> Result<Taxonomy> {
    Ok(match file {
        Some(path) => Taxonomy::from_yaml_file(path)?,
        None => Taxonomy::semantic_kitti(),
    })
}

/// Adds an option and its value to the words of a command line, if it has one.
pub fn say(words: &mut Vec<String>, name: &str, value: Option<String>) {
    words.extend(value.map(|value| [format!("--{name}"), value]).into_iter().flatten());
}

/// A value as the command line takes it.
pub fn written(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

/// A command that a shell reads as these words.
pub fn command_line(words: &[String]) -> String {
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// A word that a shell reads as this one.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
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

pub fn number(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if number.is_finite() { Ok(number) } else { Err("not a finite number".into()) }
}

pub fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|n| if n > 0.0 { Ok(n) } else { Err("must be above 0".into()) })
}

pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|n| if n >= 0.0 { Ok(n) } else { Err("must not be below 0".into()) })
}

fn angle(text: &str) -> Result<f64, String> {
    let in_range = |n| {
        if (0.0..90.0).contains(&n) { Ok(n) } else { Err("must be in 0..90".into()) }
    };
    number(text).and_then(in_range)
}

pub fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err("must be a whole number from 1 on".into()),
        Ok(n) => Ok(n),
    }
}

/// Which clouds of a recording are looked at.
#[derive(Args)]
pub struct SelectionArguments {
    /// Look at this cloud topic alone; may be given several times [default: all]
    #[arg(long = "topic", value_name = "T")]
    topics: Vec<String>,

    /// Look at these frames of each topic alone, numbered from 0: 5..10 (10 is left out), 5.., ..10 or 5
    #[arg(long, value_name = "A..B", value_parser = frames)]
    frames: Option<FrameRange>,

    /// Leave out clouds before this log time: seconds from the start (12.5), since 1970 (@1317384506.4), a date
    /// (2011-09-30T12:28:26Z), or that of a cloud (frame:100, of the first topic looked at)
    #[arg(long, value_name = "T", value_parser = moment)]
    from: Option<Moment>,

    /// Leave out clouds from this log time on
    #[arg(long, value_name = "T", value_parser = moment)]
    to: Option<Moment>,
}

impl SelectionArguments {
    /// The clouds of a recording.
    pub fn selection(&self, input: &Path) -> Result<Selection> {
        let (from_ns, to_ns) = window(input, (self.from, self.to), &self.topics)?;
        let frames = self.frames.unwrap_or((Bound::Unbounded, Bound::Unbounded));
        Ok(Selection { topics: self.topics.clone(), frames, from_ns, to_ns })
    }
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
    fn commands_are_quoted_for_a_shell() {
        let words = ["divmerge", "a b.mcap", "--at", "-1.5,2,3", "it's", ""].map(String::from);
        assert_eq!(command_line(&words), r"divmerge 'a b.mcap' --at -1.5,2,3 'it'\''s' ''");
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
