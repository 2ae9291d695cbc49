//! Ground removal on the range image after Bogoslavskyi and Stachniss (2016), "Fast range image-based
//! segmentation of sparse 3D laser scans for online operation".
//!
//! As in the paper, slopes come from each column read from the bottom up, and ground spreads from pixel to
//! neighbouring pixel. No sensor height or mount is asked for: the sensor may be tilted by 30 degrees, and z may point down.
//!
//! Steps:
//! 1. `Level`: which way is up; all that follows reads the cloud turned until the ground lies level.
//! 2. `Profile`: every column as distances and heights, bottom up.
//! 3. `Plane`: a plane through the lowest flat returns around the sensor says where the ground starts.
//! 4. `column_slopes`: the slope of each return against the last ground below it in its column.
//! 5. `Spread`: flat returns on the plane are ground, and so are flat returns continuous with them.
//! 6. `HeightMap`: the ground heights seen from above; flat returns at the height of the ground around
//!    them start to spread anew, which finds the ground behind occluders.
//! 7. `Surface`: planes through that ground, what stands on it left out.
//! 8. `judge`: how likely each point is ground, by how it came to be taken for it or not and by its height
//!    over the surface; a shadowed one by its height alone.
//!
//! Departures from the paper: slopes are measured over a baseline rather than between successive rows
//! and then smoothed by a Savitzky-Golay filter (one row spans centimetres near the sensor and metres
//! far off, so that no one filter width fits both); they are taken against the last ground below, not the
//! last return; a face that rises higher than a kerb is rejected down to its foot; ground spreads
//! upwards and sideways, never down the image; steps 1, 3, 6, 7 and 8 are additions.
//!
//! Time O(H W + N) and memory O(H W) plus the height map, at most 256 x 256 cells and their pyramid, and
//! 64 x 64 tiles.
//!
//! A column of one return is judged by the plane alone. An image of one row has no slopes and no ground.

mod height_map;
mod judge;
mod level;
mod plane;
mod profile;
mod slopes;
mod spread;
mod surface;
#[cfg(test)]
mod tests;

use crate::cloud::point_cloud::PointCloud;
use crate::range_image::RangeImage;

use height_map::HeightMap;
use judge::judge;
use level::Level;
use plane::Plane;
use profile::Profile;
use slopes::column_slopes;
use spread::Spread;

/// Parameters of the ground removal.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct GroundParams {
    /// Steepest ground, radians from the level plane that is found around the sensor. Default 25 degrees: a
    /// road of 10 % (6 degrees), the error of that plane, and a grass bank of 14 degrees (1 in 4).
    pub max_slope: f64,
    /// Shortest horizontal distance over which a slope is measured, metres; rises over less count as
    /// over this. Default 0.35: with `max_slope` it lets a kerb of 0.16 pass, and range noise of 0.03
    /// tilts a slope by 7 degrees.
    pub baseline: f64,
    /// Highest step within ground, metres: a kerb of 0.15 and noise. Default 0.2. Anything steeper than
    /// `wall_slope` that rises more is rejected down to its foot.
    pub step: f64,
    /// Slope of a face from which on it is a wall, radians from the horizontal. Default 45 degrees (the
    /// paper's limit for ground).
    pub wall_slope: f64,
    /// Slope by which ground may leave the level between successive rows of a column when it spreads,
    /// radians; added to `step`. Default 5 degrees (the paper's largest change of slope).
    pub slope_change: f64,
    /// Largest horizontal distance of the returns that the plane is fitted to and that ground starts
    /// from, metres; at most 64 cells. Default 20: a sensor 3 m up with a lowest beam of -15 degrees meets the ground at
    /// 11 m.
    pub start_distance: f64,
    /// Side of the cells in which the ground is seen from above, metres. Default 1: a 10 % road rises 0.05 from their centre to
    /// their edge.
    pub cell: f64,
    /// How far from the height of the ground around it a return may be ground, metres; more where that
    /// ground is known only in coarser cells (5 % of the cell's side, a 10 % road's rise over half of
    /// it). Default 0.08: twice the noise of 0.03 and the roughness of asphalt or short grass.
    pub height_band: f64,
}

impl Default for GroundParams {
    fn default() -> Self {
        GroundParams {
            max_slope: 25.0_f64.to_radians(),
            baseline: 0.35,
            step: 0.2,
            wall_slope: 45.0_f64.to_radians(),
            slope_change: 5.0_f64.to_radians(),
            start_distance: 20.0,
            cell: 1.0,
            height_band: 0.08,
        }
    }
}

/// The ground among N points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ground {
    /// N: whether each point is ground.
    pub is_ground: Vec<bool>,
    /// N: how likely that is, 0 to 1: at least one half where it is ground, less where it is not, 0 where
    /// there is no return.
    pub confidence: Vec<f32>,
    /// Whether it lies above the sensor, as where z points down.
    pub is_overhead: bool,
}

impl Ground {
    fn from_confidence(confidence: Vec<f32>) -> Self {
        let is_ground = confidence.iter().map(|&share| share >= 0.5).collect();
        Ground { is_ground, confidence, is_overhead: false }
    }
}

/// How the ground around a sensor lies in the cloud's frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Lie {
    /// Angle between its normal and the vertical of the frame, degrees.
    pub lean_degrees: f64,
    /// Whether it lies above the sensor.
    pub is_overhead: bool,
}

/// How the ground lies around the first of the sensors of a cloud; `None` where no plane is found.
pub fn lie(cloud: &PointCloud, image: &RangeImage, params: &GroundParams) -> Option<Lie> {
    let level = match image.is_plain() {
        true => Level::of_ground(cloud, image, params),
        false => {
            let view = image.views(cloud).into_iter().next()?;
            Level::of_ground(&view.cloud, &view.image, params)
        }
    };
    (level != Level::IDENTITY).then(|| level.lie())
}

/// The ground of a cloud, by geometry alone.
pub fn ground(cloud: &PointCloud, image: &RangeImage, params: &GroundParams) -> Ground {
    let level = Level::of_ground(cloud, image, params);
    let profile = Profile::new(cloud, image, &level);
    let Some(plane) = Plane::of_low_flat_returns(&profile, params) else {
        return Ground::from_confidence(vec![0.0; cloud.len()]);
    };
    let slopes = column_slopes(&profile, &plane, params);
    let mut spread = Spread::new(&profile, &slopes, params);
    spread.start(|seen| plane.is_start(seen, params));
    let near = HeightMap::new(spread.positions(), params);
    spread.start(|seen| near.is_near(seen));
    let found = judge(cloud, image, &level, &spread, params);
    Ground { is_overhead: level.is_upside_down, ..found }
}
