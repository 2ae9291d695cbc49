//! Arguments that several commands share, and how their values are read.

use std::ops::Bound;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use divmerge::Taxonomy;
use divmerge::annotate::{Method, Semantics};
use divmerge::cluster::params::{BirdsEye, ClusterParams, Region};
use divmerge::io::Overview;
use divmerge::pipeline::Config;
use divmerge::replay::FrameRange;
use divmerge::semantics::GroundParams;

/// How clouds are cut into instances.
#[derive(Args)]
pub struct MethodArguments {
    /// Where objects come from: `field:NAME` a semantic class per point; `ground` everything that ground
    /// removal leaves; `all` every return; `auto` a field label, semantic, class_id or class_ids if the
    /// cloud has one, else ground
    #[arg(long, value_name = "SOURCE", default_value = "auto", value_parser = semantics)]
    semantics: Semantics,

    /// What the ids of a semantic field mean: a YAML file in semantic-kitti-api's form, with an optional
    /// map `thing_class` (class: true) [default: SemanticKITTI's ids]
    #[arg(long, value_name = "FILE")]
    taxonomy: Option<PathBuf>,

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
#[derive(Clone, Copy, ValueEnum)]
enum Preset {
    /// Ours: free to differ from the paper where measurement says so
    Best,
    /// The paper to the letter
    Paper,
    /// What the authors' released C++ does, less its memory errors
    Authors,
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
    /// The method that the arguments ask for.
    pub fn method(&self) -> Result<Method> {
        let mut config = match self.preset {
            Preset::Best => Config::best(),
            Preset::Paper => Config::paper(),
            Preset::Authors => Config::authors(),
        };
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
        Ok(Method {
            semantics: self.semantics.clone(),
            taxonomy: match &self.taxonomy {
                Some(path) => Taxonomy::from_yaml_file(path)?,
                None => Taxonomy::semantic_kitti(),
            },
            ground: GroundParams::default(),
            config,
        })
    }
}

impl MethodArguments {
    /// The same arguments as words of a command line; nothing for those that were left out.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut say = |name: &str, value: String| words.extend([format!("--{name}"), value]);
        match &self.semantics {
            Semantics::Auto => {}
            Semantics::Field(name) => say("semantics", format!("field:{name}")),
            Semantics::Ground => say("semantics", "ground".into()),
            Semantics::All => say("semantics", "all".into()),
        }
        if let Some(path) = &self.taxonomy {
            say("taxonomy", path.display().to_string());
        }
        if !matches!(self.preset, Preset::Best) {
            say("preset", written(self.preset));
        }
        let lengths = [("voxel", self.voxel), ("angle", self.angle)];
        let counts = [
            ("gap-columns", self.gap_columns),
            ("gap-rows", self.gap_rows),
            ("min-points", self.min_points),
        ];
        lengths.into_iter().for_each(|(name, value)| {
            value.into_iter().for_each(|value| say(name, value.to_string()));
        });
        counts.into_iter().for_each(|(name, value)| {
            value.into_iter().for_each(|value| say(name, value.to_string()));
        });
        self.bev.into_iter().for_each(|bev| say("bev", written(bev)));
        words
    }
}

/// A value as the command line takes it.
fn written(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

/// A command that a shell reads as these words.
pub fn command_line(words: &[String]) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    let quoted = words.iter().map(|word| match !word.is_empty() && word.chars().all(is_plain) {
        true => word.clone(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    });
    quoted.collect::<Vec<_>>().join(" ")
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
    // Through text: a double does not hold nanoseconds since 1970.
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let nanoseconds: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    match (whole.parse::<u64>(), nanoseconds.parse::<u64>()) {
        (Ok(whole), Ok(nanoseconds)) => whole
            .checked_mul(1_000_000_000)
            .and_then(|whole| whole.checked_add(nanoseconds))
            .map(Moment::Absolute)
            .ok_or_else(|| "too far in the future".to_owned()),
        _ => Err("use seconds since 1970, as in @1317384506.4".into()),
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
