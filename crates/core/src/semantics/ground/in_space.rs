//! The ground from heights alone, for a cloud of which nobody knows where its sensor stands: there
//! are no columns to read from the bottom up.
//!
//! Steps: the plane that most of the lowest returns of cells around the middle of the cloud lie on
//! says which way is up; cells whose lowest return lies on it are ground, and so are cells near
//! those and about as high; what lies within [`BAND`] of a cell's lowest return makes up the
//! surface. How likely a return is ground follows from its height over that surface and from
//! whether it is one of those, by the curves of the ground removal on the image for sparse rows: no
//! slope says what a face is.

use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use super::confidence::{Evidence, Steps};
use super::found::Ground;
use super::height_map::HeightMap;
use super::level::{Consensus, FlatReturn, Level, Side};
use super::params::GroundParams;
use super::surface::Surface;
use crate::cloud::PointCloud;
use crate::geometry::statistics::median_by;

/// Number of a cell along x and y.
type Cell = [i32; 2];

/// How far above the lowest return of its cell a return may be ground, and by how much the ground
/// may rise or fall between neighbouring cells beside its slope, metres: twice the noise of 0.03.
const BAND: f32 = 0.06;

/// The ground of a cloud wherever it was seen from, z up; `None` where the lowest returns lie on no
/// plane.
pub fn in_space(cloud: &PointCloud, params: &GroundParams) -> Option<Ground> {
    let returns: Vec<usize> = (0..cloud.len()).filter(|&point| cloud.is_return(point)).collect();
    let middle = middle(cloud, &returns)?;
    let positions = returns.iter().map(|&point| Vector3::from(cloud.position(point)) - middle);
    let mut positions: Vec<[f32; 3]> = positions.map(Into::into).collect();
    let (level, height) = level(&positions, params)?;
    positions.iter_mut().for_each(|at| *at = level.turn(*at));
    let cells = ground_cells(&lowest(&positions, params), height, params);
    let is_low =
        |at: &[f32; 3]| cells.get(&cell(at, params)).is_some_and(|lowest| at[2] - lowest < BAND);
    let ground = positions.iter().filter(|at| is_low(at)).copied();
    let surface = Surface::new(&HeightMap::finest(ground, params));
    let steps = Steps::new();
    let mut confidence = vec![0.0; cloud.len()];
    for (&point, at) in returns.iter().zip(&positions) {
        let evidence = if is_low(at) { Evidence::ReachedFarOff } else { Evidence::Shadowed };
        confidence[point] = steps.confidence(evidence, surface.over(*at, true));
    }
    Some(Ground::from_confidence(confidence, false))
}

/// A place above the middle of the returns, as a sensor would see the ground from.
fn middle(cloud: &PointCloud, returns: &[usize]) -> Option<Vector3<f32>> {
    /// Metres above the median height.
    const ABOVE: f32 = 5.0;
    let along = |axis: usize| {
        let mut along: Vec<f32> = returns.iter().map(|&p| cloud.position(p)[axis]).collect();
        median_by(&mut along, f32::total_cmp)
    };
    Some(Vector3::new(along(0)?, along(1)?, along(2)? + ABOVE))
}

/// The turn that makes the ground level, and its height then, metres.
fn level(positions: &[[f32; 3]], params: &GroundParams) -> Option<(Level, f32)> {
    let reach = 1.5 * params.start_distance as f32;
    let lowest = lowest(positions, params).into_values().map(Vector3::from);
    let mut near: Vec<Vector3<f32>> = lowest.filter(|at| at.xy().norm() < reach).collect();
    // In an order of their own, since the planes that are tried depend on it.
    near.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let near: Vec<FlatReturn> = near.into_iter().map(FlatReturn::at_place).collect();
    let plane = Consensus::of(&near, Side::Below)?;
    let level = Level::from_normal(plane.refined(&near), false);
    let on_plane = near.iter().filter(|flat| plane.carries(flat));
    let mut heights: Vec<f32> = on_plane.map(|flat| level.turn(flat.at.into())[2]).collect();
    Some((level, median_by(&mut heights, f32::total_cmp)?))
}

fn cell(at: &[f32; 3], params: &GroundParams) -> Cell {
    [at[0], at[1]].map(|along| (along / params.cell as f32).floor() as i32)
}

/// The lowest position of each cell.
fn lowest(positions: &[[f32; 3]], params: &GroundParams) -> FxHashMap<Cell, [f32; 3]> {
    let mut cells: FxHashMap<Cell, [f32; 3]> = FxHashMap::default();
    for at in positions {
        let kept = cells.entry(cell(at, params)).or_insert(*at);
        if at[2] < kept[2] {
            *kept = *at;
        }
    }
    cells
}

/// The height of the ground in each cell whose lowest position lies on it: those around the middle
/// on the level plane, and those about as high as ground cells beside them, first next to these,
/// then across gaps.
fn ground_cells(
    lowest: &FxHashMap<Cell, [f32; 3]>,
    height: f32,
    params: &GroundParams,
) -> FxHashMap<Cell, f32> {
    /// Bend of the ground away from the plane, metres per metre of distance.
    const BEND: f32 = 0.01;
    /// Cells across which ground goes on, round by round.
    const GAPS: [i32; 2] = [1, 3];
    let reach = 1.5 * params.start_distance as f32;
    let is_start = |at: &[f32; 3]| {
        let distance = at[0].hypot(at[1]);
        let band = params.step as f32 + BEND * distance;
        distance < reach && (at[2] - height).abs() < band
    };
    let mut ground: FxHashMap<Cell, f32> = FxHashMap::default();
    ground.extend(lowest.iter().filter(|(_, at)| is_start(at)).map(|(&cell, at)| (cell, at[2])));
    for gap in GAPS {
        let mut open: Vec<Cell> = ground.keys().copied().collect();
        open.sort_unstable();
        while let Some(from) = open.pop() {
            for (to, cells) in around(from, gap) {
                let Some(at) = lowest.get(&to).filter(|_| !ground.contains_key(&to)) else {
                    continue;
                };
                if (at[2] - ground[&from]).abs() < highest_step(cells, params) {
                    ground.insert(to, at[2]);
                    open.push(to);
                }
            }
        }
    }
    ground
}

/// By how much the ground may rise or fall across so many cells, metres.
fn highest_step(cells: f32, params: &GroundParams) -> f32 {
    /// Slope of ground against the level plane. More takes the feet of walls and hedges for ground
    /// that rises.
    const SLOPE: f32 = 0.02;
    BAND + SLOPE * cells * params.cell as f32
}

/// The cells so many columns and rows around one, and how far each is, in cells.
fn around([column, row]: Cell, gap: i32) -> impl Iterator<Item = (Cell, f32)> {
    let side = 2 * gap + 1;
    (0..side * side).map(move |number| {
        let [i, j] = [number / side - gap, number % side - gap];
        let to = [column.saturating_add(i), row.saturating_add(j)];
        (to, (i as f32).hypot(j as f32))
    })
}

#[cfg(test)]
mod tests {
    use divmerge_simulate::{Drive, Scene, Sensor};

    use super::*;

    #[test]
    fn the_ground_is_found_wherever_the_cloud_lies_and_in_whatever_order() {
        for (sensor, scene) in [
            (Sensor::M1, Scene::Street),
            (Sensor::Mid360, Scene::Street),
            (Sensor::Hdl32e, Scene::Parking),
            (Sensor::Hdl32e, Scene::Crowd),
        ] {
            let frame = Drive::new(sensor, scene, 3).frame(5);
            let order: Vec<usize> =
                (0..frame.cloud.len()).rev().filter(|&p| frame.cloud.is_return(p)).collect();
            let frame = frame.reordered(&order);
            let class = frame.cloud.class.clone().expect("a simulated cloud has classes");
            for by in [[0.0; 3], [300.0, -120.0, 17.0]] {
                let along = |column: &[f32], i: usize| column.iter().map(|x| x + by[i]).collect();
                let (x, y, z) = (&frame.cloud.x, &frame.cloud.y, &frame.cloud.z);
                let cloud = PointCloud::new(along(x, 0), along(y, 1), along(z, 2)).unwrap();
                let found = in_space(&cloud, &GroundParams::default()).expect("a plane");
                let (mut both, mut all) = (0, 0);
                for (class, is_found) in class.iter().zip(found.is_ground) {
                    let is_ground = [40, 44, 48, 49, 60, 72].contains(class);
                    both += 2 * usize::from(is_ground && is_found);
                    all += usize::from(is_ground) + usize::from(is_found);
                }
                let f1 = both as f64 / all as f64;
                assert!(f1 > 0.95, "{sensor} in {scene}, moved by {by:?}: {f1}");
            }
        }
    }

    #[test]
    fn without_a_plane_there_is_no_ground() {
        let params = GroundParams::default();
        assert_eq!(in_space(&PointCloud::default(), &params), None);
        let wall = |i: usize| (i % 40) as f32 * 0.1;
        let heights = (0..1600).map(|i| (i / 40) as f32 * 0.1).collect();
        let cloud = PointCloud::new((0..1600).map(wall).collect(), vec![3.0; 1600], heights);
        assert_eq!(in_space(&cloud.unwrap(), &params), None);
    }
}
