//! What is compared.

use std::str::FromStr;

use super::methods;
use crate::error::spelling::did_you_mean;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::pipeline::{Config, Preset};

/// The program's own method, with preset `best`, by the name that it has among [`methods`].
pub const DIVIDE_AND_MERGE: &str = "divide-and-merge";

/// What is compared if nothing is said: names for [`Contender::from_str`], comma separated.
pub const USUAL_CONTENDERS: &str = "best,paper,authors,alpine,euclidean,dbscan,scan-line-run,\
    depth-clustering,supervoxel,one-per-class";

/// A method or parameters to compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Contender {
    /// A preset of divide and merge.
    Preset(Preset),
    /// Preset `paper` with another voxel size, metres.
    Voxel(f64),
    /// One of [`methods::NAMES`].
    Method(&'static str),
}

impl Contender {
    /// The name in tables.
    pub fn name(self) -> String {
        match self {
            Contender::Preset(preset) => preset.name().to_owned(),
            Contender::Voxel(side) => format!("paper, {side} m"),
            Contender::Method(name) => name.to_owned(),
        }
    }

    /// Its parameters.
    pub fn config(self, taxonomy: &Taxonomy) -> Config {
        match self {
            Contender::Preset(preset) => preset.config(),
            Contender::Voxel(side) => {
                let mut config = Config::paper();
                config.cluster.voxel = side;
                config
            }
            Contender::Method(name) => {
                Config { other_method: methods::named(name, taxonomy), ..Config::best() }
            }
        }
    }
}

impl FromStr for Contender {
    /// The names that there are.
    type Err = String;

    /// The preset or the method of a name.
    fn from_str(name: &str) -> Result<Self, String> {
        if name == DIVIDE_AND_MERGE {
            return Ok(Contender::Preset(Preset::Best));
        }
        if let Ok(preset) = name.parse() {
            return Ok(Contender::Preset(preset));
        }
        let method = methods::NAMES.into_iter().find(|method| *method == name);
        method.map(Contender::Method).ok_or_else(|| {
            let presets = Preset::ALL.map(Preset::name);
            let names: Vec<_> =
                presets.into_iter().chain([DIVIDE_AND_MERGE]).chain(methods::NAMES).collect();
            format!("use some of {}{}", names.join(", "), did_you_mean(name, &names))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_usual_contender_has_its_name_and_its_parameters() {
        let taxonomy = Taxonomy::semantic_kitti();
        for name in USUAL_CONTENDERS.split(',') {
            let contender: Contender = name.parse().unwrap();
            assert_eq!(contender.name(), name);
            let config = contender.config(&taxonomy);
            let is_ours = matches!(contender, Contender::Preset(_));
            assert_eq!(config.other_method.is_none(), is_ours, "{name}");
        }
    }

    #[test]
    fn unknown_names_are_told_the_known_ones() {
        let problem = "dbscam".parse::<Contender>().unwrap_err();
        assert!(problem.contains("paper"), "{problem}");
        assert!(problem.ends_with("; did you mean `dbscan`?"), "{problem}");
        let problem = "magic".parse::<Contender>().unwrap_err();
        assert!(problem.ends_with(", supervoxel"), "{problem}");
    }
}
