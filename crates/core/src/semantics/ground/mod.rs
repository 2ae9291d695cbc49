//! Ground removal on the range image after Bogoslavskyi and Stachniss (2016), "Fast range
//! image-based segmentation of sparse 3D laser scans for online operation".
//!
//! As in the paper, slopes come from each column read from the bottom up, and ground spreads from
//! pixel to neighbouring pixel. No sensor height or mount is asked for: the sensor may be tilted by
//! 30 degrees, and z may point down.
//!
//! Steps:
//! 1. `Level`: which way is up; all that follows reads the cloud turned until the ground lies
//!    level.
//! 2. `Profile`: every column as distances and heights, bottom up.
//! 3. `Plane`: a plane through the lowest flat returns around the sensor says where the ground
//!    starts.
//! 4. `column_slopes`: the slope of each return against the last ground below it in its column.
//! 5. `FloodFill`: flat returns on the plane are ground, and so are flat returns continuous with
//!    them.
//! 6. `HeightMap`: the ground heights seen from above; flat returns at the height of the ground
//!    around them start to spread anew, which finds the ground behind occluders.
//! 7. `Surface`: planes through that ground, what stands on it left out.
//! 8. `confidence`: how likely each point is ground, by how it came to be taken for it or not and
//!    by its height over the surface; a shadowed one by its height alone.
//! 9. `feet`: returns right under what is no ground are of the same face, down to the ground in
//!    front of it.
//!
//! Departures from the paper: slopes are measured over a baseline rather than between successive
//! rows and then smoothed by a Savitzky-Golay filter (one row spans centimetres near the sensor and
//! metres far off, so that no one filter width fits both); they are taken against the last ground
//! below, not the last return; a face that rises higher than a kerb is rejected down to its foot;
//! ground spreads upwards and sideways, never down the image; steps 1, 3 and 6 to 9 are additions.
//!
//! Time O(H W + N) and memory O(H W) plus the height map, at most 256 x 256 cells and their
//! pyramid, and 64 x 64 tiles.
//!
//! A column of one return is judged by the plane alone. An image of one row has no slopes and no
//! ground.

mod climb;
mod confidence;
mod feet;
mod flood_fill;
mod found;
mod height_map;
mod heights;
mod in_space;
mod level;
mod params;
mod plane;
mod profile;
mod slopes;
mod surface;
#[cfg(test)]
mod tests;

use crate::cloud::point_cloud::PointCloud;
use crate::geometry::statistics::median;
use crate::range_image::{NOWHERE, RangeImage};

use confidence::confidence;
use flood_fill::FloodFill;
use height_map::HeightMap;
use level::Level;
use plane::Plane;
use profile::Profile;
use slopes::column_slopes;

pub use found::{Ground, GroundPose};
pub use heights::GroundHeights;
pub use in_space::in_space;
pub use params::GroundParams;

/// How the ground lies around the first sensor of a cloud; `None` where no plane is found.
pub fn pose(cloud: &PointCloud, image: &RangeImage, params: &GroundParams) -> Option<GroundPose> {
    let level = match image.is_plain() {
        true => level(cloud, image, params),
        false => {
            let view = image.views(cloud).into_iter().next()?;
            level(&view.cloud, &view.image, params)
        }
    };
    level.map(|(level, _)| level.pose())
}

/// The level of the ground, and the parameters at the distance from which on it is seen.
fn level(
    cloud: &PointCloud,
    image: &RangeImage,
    params: &GroundParams,
) -> Option<(Level, GroundParams)> {
    let params = params.seen_from_distance(nearest_ground(cloud, image));
    Some((Level::of_ground(cloud, image, &params)?, params))
}

/// Distance from the sensor's axis at which it begins to see the ground, metres: the median over
/// the columns of that of their lowest return, or of their highest for a sensor upside down.
fn nearest_ground(cloud: &PointCloud, image: &RangeImage) -> f64 {
    const COLUMN_STRIDE: usize = 16;
    let columns = image.columns().div_ceil(COLUMN_STRIDE);
    let [mut first, mut last] = [(); 2].map(|()| vec![NOWHERE; columns]);
    for row in 0..image.rows() {
        let points = image.point_of_pixel.row(row).iter().step_by(COLUMN_STRIDE);
        for (column, &point) in points.enumerate().filter(|(_, point)| **point != NOWHERE) {
            if first[column] == NOWHERE {
                first[column] = point;
            }
            last[column] = point;
        }
    }
    let distance = |point: u32| f64::from(cloud.x[point as usize].hypot(cloud.y[point as usize]));
    let nearest = [first, last].map(|ends| {
        let seen = ends.into_iter().filter(|&point| point != NOWHERE);
        median(&mut seen.map(distance).collect::<Vec<f64>>()).unwrap_or(0.0)
    });
    nearest[0].min(nearest[1])
}

/// The ground of a cloud, by geometry alone.
pub fn ground(cloud: &PointCloud, image: &RangeImage, params: &GroundParams) -> Ground {
    let Some((level, params)) = level(cloud, image, params) else {
        return Ground::missing(cloud.len());
    };
    let params = &params;
    let profile = Profile::new(cloud, image, &level);
    let Some(plane) = Plane::of_low_flat_returns(&profile, params) else {
        return Ground::missing(cloud.len());
    };
    let slopes = column_slopes(&profile, &plane, params);
    let mut fill = FloodFill::new(&profile, &slopes, params);
    fill.start(|seen| plane.is_start(seen, params));
    let near = HeightMap::new(fill.positions(), params);
    fill.start(|seen| near.is_near(seen));
    let confidence = confidence(cloud, image, &level, &fill, params);
    Ground::from_confidence(confidence, level.is_upside_down)
}
