//! A preset and what is changed of it: the parameters as people give them, in metres and degrees.

use std::str::FromStr;

use super::config::Config;
use crate::cluster::params::{BirdsEye, ClusterParams, Region};
use crate::error::ParameterError;
use crate::range_image::ProjectionParams;

/// Parameters to start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// Ours: [`Config::best`].
    #[default]
    Best,
    /// The paper to the letter: [`Config::paper`].
    Paper,
    /// The released C++, less its memory errors: [`Config::authors`].
    Authors,
}

impl Preset {
    /// All presets.
    pub const ALL: [Preset; 3] = [Preset::Best, Preset::Paper, Preset::Authors];

    /// Its name, as at the command line.
    pub fn name(self) -> &'static str {
        self.config().preset
    }

    /// The parameters.
    pub fn config(self) -> Config {
        match self {
            Preset::Best => Config::best(),
            Preset::Paper => Config::paper(),
            Preset::Authors => Config::authors(),
        }
    }
}

/// Reads `best`, `paper` or `authors`.
impl FromStr for Preset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = Preset::ALL.into_iter().find(|preset| preset.name() == text);
        named.ok_or_else(|| format!("`{text}` is no preset: use best, paper or authors"))
    }
}

/// How instances of one class are merged on the bird's-eye plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BirdsEyeMerge {
    /// Not at all.
    Off,
    /// By gap and size; without classes as a cut of the tree of merges.
    Size,
    /// Where regions overlap.
    Overlap(Region),
}

impl BirdsEyeMerge {
    /// All of them by name.
    pub const NAMES: [(&str, BirdsEyeMerge); 5] = [
        ("off", BirdsEyeMerge::Off),
        ("size", BirdsEyeMerge::Size),
        ("box", BirdsEyeMerge::Overlap(Region::Box)),
        ("rectangle", BirdsEyeMerge::Overlap(Region::Rectangle)),
        ("hull", BirdsEyeMerge::Overlap(Region::Hull)),
    ];
}

/// Reads `off`, `size`, `box`, `rectangle` or `hull`.
impl FromStr for BirdsEyeMerge {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = BirdsEyeMerge::NAMES.into_iter().find(|(name, _)| *name == text);
        named.map(|(_, merge)| merge).ok_or_else(|| {
            format!("`{text}` is no bird's-eye merge: use off, size, box, rectangle or hull")
        })
    }
}

/// A preset, and the parameters that are not its own; `None` leaves the preset's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Overrides {
    /// Parameters to start from.
    pub preset: Preset,
    /// Side of a voxel of the divide step, metres ([`ClusterParams::voxel`]).
    pub voxel: Option<f64>,
    /// Least angle beta between neighbours of one object, degrees.
    pub angle: Option<f64>,
    /// Most columns from a pixel to its neighbour ([`ClusterParams::gap_columns`]).
    pub gap_columns: Option<usize>,
    /// Most rows from a pixel to its neighbour ([`ClusterParams::gap_rows`]).
    pub gap_rows: Option<usize>,
    /// Instances seen in fewer pixels are dropped ([`ClusterParams::min_pixels`]).
    pub min_points: Option<usize>,
    /// How instances of one class are merged on the bird's-eye plane.
    pub bev: Option<BirdsEyeMerge>,
    /// Rows of equal elevation in the range image ([`crate::range_image::ProjectionParams::rows`]).
    pub rows: Option<usize>,
    /// Columns of the full circle ([`crate::range_image::ProjectionParams::columns`]).
    pub columns: Option<usize>,
    /// Elevations of the upper and the lower edge of the range image, degrees.
    pub field_of_view: Option<(f64, f64)>,
}

impl Overrides {
    /// The parameters.
    ///
    /// # Errors
    /// [`ParameterError`] if one is outside of its [`limits`], or does not fit the preset.
    pub fn config(&self) -> Result<Config, ParameterError> {
        let mut config = self.preset.config();
        self.change(&mut config)?;
        Ok(config)
    }

    /// Changes what is not the preset's.
    ///
    /// # Errors
    /// As [`Overrides::config`]; parameters may have changed then.
    pub fn change(&self, config: &mut Config) -> Result<(), ParameterError> {
        self.check()?;
        let params = &mut config.cluster;
        if let Some(degrees) = self.angle {
            params.condition.angle = degrees.to_radians();
        }
        params.voxel = self.voxel.unwrap_or(params.voxel);
        params.gap_columns = self.gap_columns.unwrap_or(params.gap_columns);
        params.gap_rows = self.gap_rows.unwrap_or(params.gap_rows);
        params.min_pixels = self.min_points.unwrap_or(params.min_pixels);
        if let Some(bev) = self.bev {
            set_birds_eye(params, bev);
        }
        refuse_regions_of_authors(params)?;
        self.set_projection(&mut config.projection);
        Ok(())
    }

    /// Sets what is asked for of the projection alone.
    pub fn set_projection(&self, projection: &mut ProjectionParams) {
        projection.rows = self.rows.or(projection.rows);
        projection.columns = self.columns.or(projection.columns);
        let radians = |(up, down): (f64, f64)| (up.to_radians(), down.to_radians());
        projection.field_of_view = self.field_of_view.map(radians).or(projection.field_of_view);
    }

    fn check(&self) -> Result<(), ParameterError> {
        check("voxel", self.voxel, limits::above_zero)?;
        check("angle", self.angle, limits::acute_angle)?;
        check("gap_columns", self.gap_columns, limits::at_least_one)?;
        check("gap_rows", self.gap_rows, limits::at_least_one)?;
        check("rows", self.rows, limits::rows)?;
        check("columns", self.columns, limits::columns)?;
        check("fov", self.field_of_view, limits::field_of_view)
    }
}

fn check<T>(
    name: &'static str,
    value: Option<T>,
    limit: impl Fn(T) -> Result<T, String>,
) -> Result<(), ParameterError> {
    match value.map(limit) {
        Some(Err(problem)) => Err(ParameterError { name, problem }),
        _ => Ok(()),
    }
}

fn set_birds_eye(params: &mut ClusterParams, bev: BirdsEyeMerge) {
    let best = ClusterParams::best();
    let by_size = bev == BirdsEyeMerge::Size;
    params.fragments = best.fragments.filter(|_| by_size);
    params.tree = best.tree.filter(|_| by_size);
    params.birds_eye = match bev {
        BirdsEyeMerge::Off | BirdsEyeMerge::Size => None,
        BirdsEyeMerge::Overlap(region) => Some(of_region(params.birds_eye, region)),
    };
}

/// The preset's bird's-eye merge with another region.
fn of_region(preset: Option<BirdsEye>, region: Region) -> BirdsEye {
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

fn refuse_regions_of_authors(params: &ClusterParams) -> Result<(), ParameterError> {
    match &params.birds_eye {
        Some(birds_eye) if !birds_eye.transitive && birds_eye.region != Region::Box => {
            let problem =
                "preset `authors` merges on the bird's-eye plane with boxes or not at all";
            Err(ParameterError { name: "bev", problem: problem.to_owned() })
        }
        _ => Ok(()),
    }
}

/// What parameters may be; the problem in words where one is not.
pub mod limits {

    /// A finite number above 0.
    ///
    /// # Errors
    /// If it is not.
    pub fn above_zero(number: f64) -> Result<f64, String> {
        finite(number).and_then(|n| if n > 0.0 { Ok(n) } else { Err("must be above 0".into()) })
    }

    /// A finite number that is not below 0.
    ///
    /// # Errors
    /// If it is not.
    pub fn not_negative(number: f64) -> Result<f64, String> {
        finite(number)
            .and_then(|n| if n >= 0.0 { Ok(n) } else { Err("must not be below 0".into()) })
    }

    /// Any finite number.
    ///
    /// # Errors
    /// If it is none.
    pub fn finite(number: f64) -> Result<f64, String> {
        if number.is_finite() { Ok(number) } else { Err("not a finite number".into()) }
    }

    /// An angle of 0 to 90 degrees, 90 left out.
    ///
    /// # Errors
    /// If it is not.
    pub fn acute_angle(degrees: f64) -> Result<f64, String> {
        let is_acute = (0.0..90.0).contains(&finite(degrees)?);
        if is_acute { Ok(degrees) } else { Err("must be in 0..90".into()) }
    }

    /// A whole number from 1 on.
    ///
    /// # Errors
    /// If it is 0.
    pub fn at_least_one(number: usize) -> Result<usize, String> {
        match number {
            0 => Err("must be a whole number from 1 on".into()),
            number => Ok(number),
        }
    }

    /// Rows of a range image: 1 to 1024.
    ///
    /// # Errors
    /// If there are more, or none.
    pub fn rows(number: usize) -> Result<usize, String> {
        within(number, 1024)
    }

    /// Columns of a range image: 1 to 16384.
    ///
    /// # Errors
    /// If there are more, or none.
    pub fn columns(number: usize) -> Result<usize, String> {
        within(number, 16_384)
    }

    fn within(number: usize, most: usize) -> Result<usize, String> {
        let number = at_least_one(number)?;
        if number <= most { Ok(number) } else { Err(format!("must be {most} at most")) }
    }

    /// Elevations of the upper and the lower edge of a range image, degrees.
    ///
    /// # Errors
    /// If one is beyond the zenith or the nadir, or the upper not above the lower.
    pub fn field_of_view((up, down): (f64, f64)) -> Result<(f64, f64), String> {
        if !(-90.0..=90.0).contains(&up) || !(-90.0..=90.0).contains(&down) {
            return Err("both must lie in -90..90 degrees".into());
        }
        if up <= down {
            return Err(format!("the upper edge must lie above the lower one: {down},{up}?"));
        }
        Ok((up, down))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_stay_as_they_are() {
        for (name, config) in
            [("best", Config::best()), ("paper", Config::paper()), ("authors", Config::authors())]
        {
            let preset = name.parse().unwrap();
            assert_eq!(Overrides { preset, ..Overrides::default() }.config().unwrap(), config);
        }
        assert!("bets".parse::<Preset>().is_err() && "hulls".parse::<BirdsEyeMerge>().is_err());
    }

    #[test]
    fn each_override_is_of_one_parameter() {
        let overrides = Overrides {
            voxel: Some(0.7),
            angle: Some(12.0),
            bev: Some(BirdsEyeMerge::Overlap(Region::Hull)),
            field_of_view: Some((3.0, -25.0)),
            ..Overrides::default()
        };
        let config = overrides.config().unwrap();
        assert_eq!((config.cluster.voxel, config.cluster.gap_rows), (0.7, 2));
        assert_eq!(config.cluster.condition.angle, 12_f64.to_radians());
        assert_eq!(config.cluster.birds_eye.map(|bev| bev.region), Some(Region::Hull));
        assert!(config.cluster.fragments.is_none() && config.cluster.tree.is_none());
        let view = config.projection.field_of_view;
        assert_eq!(view, Some((3_f64.to_radians(), -25_f64.to_radians())));
    }

    #[test]
    fn what_is_out_of_limits_is_named() {
        let named = |overrides: Overrides| match overrides.config() {
            Err(ParameterError { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        let usual = Overrides::default();
        assert_eq!(named(Overrides { voxel: Some(0.0), ..usual }), "voxel");
        assert_eq!(named(Overrides { angle: Some(90.0), ..usual }), "angle");
        assert_eq!(named(Overrides { gap_rows: Some(0), ..usual }), "gap_rows");
        assert_eq!(named(Overrides { rows: Some(1025), ..usual }), "rows");
        assert_eq!(named(Overrides { field_of_view: Some((-25.0, 3.0)), ..usual }), "fov");
        let bev = Some(BirdsEyeMerge::Overlap(Region::Hull));
        assert_eq!(named(Overrides { preset: Preset::Authors, bev, ..usual }), "bev");
    }
}
