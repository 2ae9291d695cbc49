//! Arguments that several commands share, and how their values are read.

use std::ops::Bound;
use std::path::Path;
use std::str::FromStr;

use anyhow::{Result, anyhow};
use clap::{Args, ValueEnum};
use divmerge::annotate::Method;
use divmerge::annotate::moments::{self, Moment};
use divmerge::baselines::AnyBaseline;
use divmerge::cluster::params::Region;
use divmerge::pipeline::overrides::limits;
use divmerge::pipeline::{self, BirdsEyeMerge, Config, Overrides};
use divmerge::replay::{FrameRange, Selection};
use divmerge::{Error, Taxonomy};

use crate::boxes::BoxArguments;
use crate::geometry::GeometryArguments;
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
        pipeline::Preset::from(self).config()
    }
}

impl From<Preset> for pipeline::Preset {
    fn from(preset: Preset) -> Self {
        match preset {
            Preset::Best => pipeline::Preset::Best,
            Preset::Paper => pipeline::Preset::Paper,
            Preset::Authors => pipeline::Preset::Authors,
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
        AnyBaseline::named(&written(self), taxonomy)
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

impl From<Bev> for BirdsEyeMerge {
    fn from(bev: Bev) -> Self {
        match bev {
            Bev::Off => BirdsEyeMerge::Off,
            Bev::Size => BirdsEyeMerge::Size,
            Bev::Box => BirdsEyeMerge::Overlap(Region::Box),
            Bev::Rectangle => BirdsEyeMerge::Overlap(Region::Rectangle),
            Bev::Hull => BirdsEyeMerge::Overlap(Region::Hull),
        }
    }
}

impl MethodArguments {
    /// The method that the arguments ask for, for the clouds of a recording. Wrong usage ends the program.
    pub fn method(&self, recording: &Path) -> Result<Method> {
        let box_source = self.boxes.source(self.method == Cutter::Boxes);
        let mut config = self.overrides().config()?;
        let (sensor_frame, transforms) = self.geometry.frame(recording)?;
        let method = self.objects.method(recording)?;
        config.baseline = self.method.baseline(&method.taxonomy);
        self.boxes.set(&mut config);
        let boxes = BoxArguments::open(box_source.as_ref(), recording, &method.taxonomy)?;
        Ok(Method { config, boxes, sensor_frame, transforms, ..method })
    }

    fn overrides(&self) -> Overrides {
        self.geometry.overriding(Overrides {
            preset: self.preset.into(),
            voxel: self.voxel,
            angle: self.angle,
            gap_columns: self.gap_columns,
            gap_rows: self.gap_rows,
            min_points: self.min_points,
            bev: self.bev.map(BirdsEyeMerge::from),
            ..Overrides::default()
        })
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

pub fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "not a number".to_owned()).and_then(limits::finite)
}

pub fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(limits::above_zero)
}

pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(limits::not_negative)
}

fn angle(text: &str) -> Result<f64, String> {
    number(text).and_then(limits::acute_angle)
}

pub fn at_least_one(text: &str) -> Result<usize, String> {
    limits::at_least_one(text.parse().unwrap_or(0))
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
    #[arg(long, value_name = "T", value_parser = Moment::from_str)]
    from: Option<Moment>,

    /// Leave out clouds from this log time on
    #[arg(long, value_name = "T", value_parser = Moment::from_str)]
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

/// The log times in nanoseconds that two moments of a recording stand for.
pub fn window(
    input: &Path,
    moments: (Option<Moment>, Option<Moment>),
    topics: &[String],
) -> Result<(Option<u64>, Option<u64>)> {
    moments::window(input, moments, topics).map_err(|error| match error {
        Error::Parameter { name: "from", .. } => anyhow!("--from must lie before --to"),
        Error::Parameter { .. } => {
            anyhow!("of a stream, --from and --to are times since 1970 (@1317384506.4) or dates")
        }
        other => other.into(),
    })
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
