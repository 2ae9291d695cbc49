//! How likely each point is ground.
//!
//! Two things are known of a point: how it came to be taken for ground or not ([`Evidence`]), and
//! its height over the surface of the ground around it, as a share of the height from which on a
//! point is no longer ground (which grows with the scatter of that ground). The confidence is the
//! share of ground among labelled points of the same evidence and height, smoothed by a logistic
//! curve. A point is ground where its confidence is one half or more.

use super::feet::doubt_feet;
use super::flood_fill::FloodFill;
use super::height_map::HeightMap;
use super::level::Level;
use super::params::GroundParams;
use super::profile::Profile;
use super::surface::Surface;
use crate::cloud::PointCloud;
use crate::range_image::RangeImage;

/// How a point came to be ground or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Evidence {
    /// Flat, and ground spread to it, where rows are dense enough for slopes to tell.
    Reached,
    /// The same where rows are sparse.
    ReachedFarOff,
    /// As high as the ground in its own cell.
    Level,
    /// Flat, but no ground is next to it.
    Apart,
    /// Too steep.
    Steep,
    /// Hidden behind another point of its pixel, or of a cloud seen from nobody knows where: only
    /// its height tells.
    Shadowed,
}

/// Share of ground among the points of a kind as their height over the ground grows: from `low` to
/// `high`, half way at `middle`; all heights as shares of the height that is not believed.
struct Curve {
    low: f64,
    high: f64,
    middle: f64,
    width: f64,
    /// The share where no ground is near enough to give a height.
    unknown: f64,
    /// The share below [`Steps::LOWEST`], where wet ground shows what it mirrors.
    below: f64,
}

impl Curve {
    const fn new([low, high, middle, width]: [f64; 4], unknown: f64, below: f64) -> Self {
        Curve { low, high, middle, width, unknown, below }
    }
}

/// By [`Evidence`], in its order. Fitted by maximum likelihood, one quarter of the weight each, to
/// drives 00, 03 and 05 of SemanticKITTI (18 scans) and to simulated sweeps of all scenes and
/// sensors (seeds 101 and 102; as usual, tilted, low, high, in rain, over wet ground).
const CURVES: [Curve; 6] = [
    Curve::new([0.998, 0.101, 0.841, 0.164], 0.0, 0.002),
    Curve::new([0.980, 0.022, 1.083, 0.260], 0.0, 0.056),
    Curve::new([0.864, 0.074, 0.685, 0.344], 0.0, 0.042),
    Curve::new([0.662, 0.041, 0.680, 0.256], 0.209, 0.042),
    Curve::new([0.513, 0.004, -0.206, 0.359], 0.002, 0.036),
    Curve::new([0.985, 0.022, 0.669, 0.171], 0.019, 0.007),
];

impl Curve {
    fn at(&self, height: f64) -> f64 {
        let rise = (1.0 + ((height - self.middle) / self.width).exp()).recip();
        self.high + (self.low - self.high) * rise
    }
}

/// The curves as steps, so that a point costs a look-up.
pub(super) struct Steps([[f32; Steps::COUNT + 1]; CURVES.len()]);

impl Steps {
    /// Heights that are told apart: step 0 is all below `LOWEST`, the last all above.
    const COUNT: usize = 160;
    const LOWEST: f32 = -1.5;
    const PER_UNIT: f32 = 32.0;

    pub fn new() -> Self {
        Steps(CURVES.map(|curve| {
            std::array::from_fn(|step| {
                let height = (step as f32 - 0.5) / Self::PER_UNIT + Self::LOWEST;
                let share = match step {
                    0 => curve.below,
                    Self::COUNT => curve.unknown,
                    _ => curve.at(f64::from(height)),
                };
                share as f32
            })
        }))
    }

    pub fn confidence(&self, evidence: Evidence, height: f32) -> f32 {
        let step = (height - Self::LOWEST) * Self::PER_UNIT + 1.0;
        let step = match step.is_nan() {
            true => Self::COUNT,
            false => step.clamp(0.0, (Self::COUNT - 1) as f32) as i32 as usize,
        };
        self.0[evidence as usize][step]
    }
}

/// N: how likely each point of a cloud is ground, 0 to 1, after the earlier steps.
pub(super) fn confidence(
    cloud: &PointCloud,
    image: &RangeImage,
    level: &Level,
    fill: &FloodFill,
    params: &GroundParams,
) -> Vec<f32> {
    let profile = fill.profile();
    let heights = HeightMap::finest(fill.positions(), params);
    let surface = Surface::new(&heights);
    let sparse_from = sparse_from(profile, params);
    let steps = Steps::new();
    let mut confidence = vec![0.0; cloud.len()];
    for (number, column) in profile.returns.chunks_exact(profile.rows).enumerate() {
        for (up, seen) in column.iter().enumerate().filter(|(_, seen)| seen.exists()) {
            let index = number * profile.rows + up;
            let is_sparse = seen.distance > sparse_from[up];
            let evidence = match fill.is_ground(index) {
                true if is_sparse => Evidence::ReachedFarOff,
                true => Evidence::Reached,
                false if heights.is_on(seen.position()) => Evidence::Level,
                false if fill.is_flat(index) => Evidence::Apart,
                false => Evidence::Steep,
            };
            let over = surface.over(seen.position(), is_sparse);
            confidence[seen.point as usize] = steps.confidence(evidence, over);
        }
        doubt_feet(column, &mut confidence);
    }
    for point in (0..cloud.len()).filter(|&point| image.is_shadowed(point)) {
        let over = surface.over(level.turn(cloud.position(point)), false);
        confidence[point] = steps.confidence(Evidence::Shadowed, over);
    }
    confidence
}

/// By row from the bottom up: the distance in metres from which on a step within ground may hide
/// between the row and the one below.
fn sparse_from(profile: &Profile, params: &GroundParams) -> Vec<f32> {
    profile.row_steps().into_iter().map(|slope| params.step as f32 / slope).collect()
}
