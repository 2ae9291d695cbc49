//! How clouds are clustered: the method and its parameters.

use std::path::Path;

use anyhow::Result;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches};

use super::boxes::BoxArguments;
use super::geometry::GeometryArguments;
use super::objects::ObjectArguments;
use super::parameters::{ParameterArguments, changes};
use super::values::{NamedValue, angle, at_least_one, one_of, positive};
use crate::Taxonomy;
use crate::annotate::AnnotateConfig;
use crate::cli::shell::option_words;
use crate::cli::terminal;
use crate::cluster::params::Region;
use crate::comparison::DIVIDE_AND_MERGE;
use crate::comparison::methods::{self, BOXES};
use crate::frames::sweeps_in_parts;
use crate::parameters::ParameterSet;
use crate::pipeline::{BirdsEyeMerge, Overrides, Preset};

/// How clouds are clustered.
#[derive(Args)]
pub struct MethodArguments {
    #[command(flatten)]
    given: GivenOptions,

    #[command(flatten)]
    objects: ObjectArguments,

    /// Clustering method; projection, object mask and back-projection are always those of the
    /// preset
    #[arg(long, value_name = "METHOD", default_value = DIVIDE_AND_MERGE)]
    #[arg(value_parser = one_of(METHODS))]
    method: &'static str,

    #[command(flatten)]
    boxes: BoxArguments,

    #[command(flatten)]
    geometry: GeometryArguments,

    /// Parameters to start from; the options below override single ones
    #[arg(long, default_value = "best", value_parser = one_of(PRESETS))]
    preset: Preset,

    /// Voxel size of the divide step in metres [best, paper: 0.5; authors: 0.2]
    #[arg(long, value_name = "M", value_parser = positive)]
    voxel: Option<f64>,

    /// Minimum angle beta between neighbouring pixels of one object in degrees [best, paper: 10;
    /// authors: 8.6]
    #[arg(long, value_name = "DEG", value_parser = angle)]
    angle: Option<f64>,

    /// Maximum column distance between neighbouring pixels [best: 2; paper: 1; authors: unlimited]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    gap_columns: Option<usize>,

    /// Maximum row distance between neighbouring pixels [best: 2; paper: 1; authors: 10]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    gap_rows: Option<usize>,

    /// Drop instances seen in fewer pixels, with reason "too small" [best, paper: 0; authors: 31]
    #[arg(long, value_name = "N")]
    min_points: Option<usize>,

    /// Merge of instances of one class on the bird's-eye plane [best: size; paper: box; authors:
    /// box, of any class]
    #[arg(long, value_name = "REGION", value_parser = one_of(BIRDS_EYE_MERGES))]
    bev: Option<BirdsEyeMerge>,

    #[command(flatten)]
    parameters: ParameterArguments,
}

/// Presets.
pub const PRESETS: &[NamedValue<Preset>] = &[
    ("best", "Ours: departs from the paper where that measures better", Preset::Best),
    ("paper", "The paper to the letter", Preset::Paper),
    ("authors", "The authors' released C++ without its memory errors", Preset::Authors),
];

/// Clustering methods.
pub const METHODS: &[NamedValue<&str>] = &[
    (DIVIDE_AND_MERGE, "This program's own (Zhao, Zhang and Huang 2021)", DIVIDE_AND_MERGE),
    (
        "depth-clustering",
        "Range image neighbours with an angle beta above 8.6 degrees (Bogoslavskyi and Stachniss \
         2016)",
        "depth-clustering",
    ),
    (
        "scan-line-run",
        "Runs of near points in a beam, joined with the beam above (Zermas et al. 2017)",
        "scan-line-run",
    ),
    ("euclidean", "Points within half a metre of each other (Rusu 2010)", "euclidean"),
    ("dbscan", "DBSCAN with 0.5 m and 5 points (Ester et al. 1996)", "dbscan"),
    (
        "supervoxel",
        "Supervoxels of 0.5 m voxels from seeds 8 m apart (VCCS, Papon et al. 2013)",
        "supervoxel",
    ),
    (
        "alpine",
        "Nearest neighbours on the ground plane, split by the size of the class (Sautier et al. \
         2025)",
        "alpine",
    ),
    (BOXES, "Points inside the 3-D detection boxes of --boxes (Behley et al. 2020)", BOXES),
    ("one-per-class", "All objects of a class as one instance", "one-per-class"),
];

const BIRDS_EYE_MERGES: &[NamedValue<BirdsEyeMerge>] = &[
    ("off", "No merge", BirdsEyeMerge::Off),
    (
        "size",
        "Instances that touch or together fit one object of their class; without classes by their \
         gap alone",
        BirdsEyeMerge::Size,
    ),
    ("box", "Overlapping axis-aligned boxes", BirdsEyeMerge::Overlap(Region::Box)),
    ("rectangle", "Overlapping minimum-area rectangles", BirdsEyeMerge::Overlap(Region::Rectangle)),
    ("hull", "Overlapping convex hulls", BirdsEyeMerge::Overlap(Region::Hull)),
];

impl MethodArguments {
    /// The files and folders that are read.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.objects.files().chain(self.boxes.files()).chain(self.parameters.files())
    }

    /// The method for the clouds of a recording.
    pub fn config(&self, recording: &Path) -> Result<AnnotateConfig> {
        let box_source = self.boxes.source(self.method == BOXES)?;
        let config = self.objects.config(recording)?;
        let parameters = self.parameters(&config.taxonomy)?;
        let frames = self.geometry.frames(recording)?;
        let ego = self.geometry.ego(recording, &frames, &parameters.projection)?;
        let boxes = BoxArguments::open(box_source.as_ref(), recording, &config.taxonomy)?;
        let (unit, crop) = self.geometry.coordinates.values();
        let assemble = self.geometry.assemble;
        let config = config.with_parameters(&parameters);
        let config = AnnotateConfig { boxes, unit, crop, ego, frames, assemble, ..config };
        config.refuse_with_turns(recording)?;
        Ok(config)
    }

    /// Every parameter: those of the preset and the file of `--config`, then of the options for
    /// single ones, then of `--set`.
    fn parameters(&self, taxonomy: &Taxonomy) -> Result<ParameterSet> {
        let other_method = methods::named(self.method, taxonomy);
        let mut parameters = self.parameters.start(self.preset, other_method)?;
        let mut pipeline = parameters.config();
        self.overrides().change(&mut pipeline)?;
        parameters.projection = pipeline.projection;
        parameters.cluster = pipeline.cluster;
        self.boxes.set(&mut parameters)?;
        self.parameters.set(&mut parameters)?;
        Ok(parameters)
    }

    /// The parameters of objects over time; the others as for SemanticKITTI's classes.
    pub fn parameters_over_time(&self) -> Result<ParameterSet> {
        self.parameters(&Taxonomy::default())
    }

    /// The same for a command that does not print what is odd about clouds: it warns of topics in
    /// which the vehicle cannot be found, and of those of the named topics (none: of all) whose
    /// messages hold parts of turns.
    pub fn config_with_warnings(
        &self,
        recording: &Path,
        topics: &[String],
    ) -> Result<AnnotateConfig> {
        let config = self.config(recording)?;
        if terminal::is_verbose() {
            eprintln!("{}", config.pipeline.describe());
            let changed = changes(&config.parameters());
            changed.iter().for_each(|change| eprintln!("  {change}"));
        }
        let in_parts = match config.assemble {
            Some(_) => Vec::new(),
            None => sweeps_in_parts(recording, topics),
        };
        for problem in config.ego.unknown().chain(in_parts) {
            eprintln!("warning: {}: {problem}", recording.display());
        }
        Ok(config)
    }

    fn overrides(&self) -> Overrides {
        self.geometry.overriding(Overrides {
            preset: self.preset,
            voxel: self.voxel,
            angle: self.angle,
            gap_columns: self.gap_columns,
            gap_rows: self.gap_rows,
            min_points: self.min_points,
            bev: self.bev,
            ..Overrides::default()
        })
    }

    /// The options that were given, as words of a command line that repeats them.
    pub fn words(&self) -> &[String] {
        &self.given.0
    }
}

/// The options of [`MethodArguments`] that were given, as words of a command line.
struct GivenOptions(Vec<String>);

impl Args for GivenOptions {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

impl FromArgMatches for GivenOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let command = MethodArguments::augment_args(Command::new("method"));
        let mut words = Vec::new();
        for option in command.get_arguments() {
            let id = option.get_id().as_str();
            if matches.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            for value in matches.get_raw(id).into_iter().flatten() {
                let option = format!("--{}", option.get_long().unwrap_or(id));
                words.extend(option_words(&option, &value.to_string_lossy()));
            }
        }
        Ok(GivenOptions(words))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(given: &[&str]) -> Vec<String> {
        let command = MethodArguments::augment_args(Command::new("test").no_binary_name(true));
        let matches = command.get_matches_from(given);
        MethodArguments::from_arg_matches(&matches).unwrap().words().to_vec()
    }

    #[test]
    fn words_repeat_the_options_that_were_given() {
        assert!(words(&[]).is_empty());
        let given = ["--rows", "32", "--fov", "10,-30", "--sensor-frame", "180,0,0"];
        assert_eq!(words(&given), given);
        let given = ["--semantics=ground", "--model-config=a", "--model-config", "b", "--bev=off"];
        let expected = "--semantics ground --model-config a --model-config b --bev off".split(' ');
        assert_eq!(words(&given), expected.collect::<Vec<_>>());
    }
}
