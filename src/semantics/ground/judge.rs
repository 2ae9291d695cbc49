//! The verdict for each point, and how sure it is.
//!
//! Two things are known of a point: how it came to be taken for ground or not ([`Kind`]), and how high it
//! is over the surface of the ground around it, as a share of the height from which on it is not believed
//! (which grows with the spread of that ground). The confidence is the share of ground found among
//! labelled points of the same kind and height, smoothed by a logistic curve; the verdict is ground where
//! it is one half or more.

use super::GroundParams;
use super::height_map::HeightMap;
use super::profile::Profile;
use super::spread::Spread;
use super::surface::Surface;
use super::{Ground, PointCloud, RangeImage};
use crate::range_image::NOWHERE;

/// How a point came to be ground or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Flat, and ground spread to it.
    Reached,
    /// As high as the ground in its own cell.
    Level,
    /// Flat, but no ground is next to it.
    Apart,
    /// Too steep.
    Steep,
    /// Hidden behind another point of its pixel: only its height tells.
    Shadowed,
}

/// Share of ground among the points of a kind as their height over the ground grows: from `low`, well
/// below, to `high`, half way at `middle`; all heights as shares of the height that is not believed.
struct Curve {
    low: f64,
    high: f64,
    middle: f64,
    width: f64,
    /// The share where no ground is near enough to give a height.
    unknown: f64,
}

/// By [`Kind`]: fitted by maximum likelihood to drives 00, 03 and 05 of SemanticKITTI (18 scans) and to
/// simulated sweeps of all scenes and sensors (seeds 101 and 102), either half of the weight.
const CURVES: [Curve; 5] = [
    Curve { low: 0.998, high: 0.246, middle: 0.72, width: 0.144, unknown: 0.0 },
    Curve { low: 0.998, high: 0.051, middle: 0.193, width: 0.422, unknown: 0.0 },
    Curve { low: 0.77, high: 0.049, middle: 0.46, width: 0.23, unknown: 0.211 },
    Curve { low: 0.691, high: 0.004, middle: -0.337, width: 0.333, unknown: 0.001 },
    Curve { low: 0.992, high: 0.029, middle: 0.607, width: 0.153, unknown: 0.018 },
];

impl Curve {
    fn at(&self, height: f64) -> f64 {
        let rise = (1.0 + ((height - self.middle) / self.width).exp()).recip();
        self.high + (self.low - self.high) * rise
    }
}

/// The curves as steps, so that a point costs a look-up.
struct Steps([[f32; Steps::COUNT + 1]; CURVES.len()]);

impl Steps {
    /// Heights that are told apart, from `LOWEST` on; beyond the last nothing is ground.
    const COUNT: usize = 192;
    const LOWEST: f32 = -2.0;
    const PER_UNIT: f32 = 32.0;

    fn new() -> Self {
        Steps(CURVES.map(|curve| {
            std::array::from_fn(|step| match step {
                Self::COUNT => curve.unknown as f32,
                _ => {
                    let height = (step as f32 + 0.5) / Self::PER_UNIT + Self::LOWEST;
                    curve.at(f64::from(height)) as f32
                }
            })
        }))
    }

    fn confidence(&self, kind: Kind, height: f32) -> f32 {
        let step = if height.is_nan() {
            Self::COUNT
        } else {
            // Casting saturates: far below is step 0.
            (((height - Self::LOWEST) * Self::PER_UNIT) as usize).min(Self::COUNT - 1)
        };
        self.0[kind as usize][step]
    }
}

/// The verdict for every point of a cloud that the earlier steps have looked at.
pub(super) fn judge(
    cloud: &PointCloud,
    image: &RangeImage,
    spread: &Spread,
    params: &GroundParams,
) -> Ground {
    let profile = spread.profile();
    let heights = HeightMap::new(cloud, spread.ground_points(), params);
    let surface = Surface::new(&heights);
    let sparse_from = sparse_from(profile, params);
    let steps = Steps::new();
    let mut confidence = vec![0.0; cloud.len()];
    for row in 0..image.rows() {
        let up = profile.up(row);
        for (column, &point) in image.point_of_pixel.row(row).iter().enumerate() {
            if point == NOWHERE {
                continue;
            }
            let index = column * profile.rows + up;
            let at = cloud.position(point as usize);
            let is_sparse = profile.returns[index].distance > sparse_from[up];
            let kind = match () {
                () if spread.is_ground(index) => Kind::Reached,
                () if heights.is_on(at) => Kind::Level,
                () if spread.is_flat(index) => Kind::Apart,
                () => Kind::Steep,
            };
            confidence[point as usize] = steps.confidence(kind, surface.over(at, is_sparse));
        }
    }
    for point in (0..cloud.len()).filter(|&point| image.is_shadowed(point)) {
        let over = surface.over(cloud.position(point), false);
        confidence[point] = steps.confidence(Kind::Shadowed, over);
    }
    Ground::from_confidence(confidence)
}

/// By row from the bottom up: the distance in metres from which on a step within ground may hide between
/// the row and the one below.
fn sparse_from(profile: &Profile, params: &GroundParams) -> Vec<f32> {
    profile.row_steps().into_iter().map(|slope| params.step as f32 / slope).collect()
}
