//! What a network paints onto the ground is taken out of objects.
//!
//! A network that sees the range image blurs objects at their edges: the ground behind a car, in
//! its shadow and around its wheels is called car. These errors are contiguous, so that neighbours
//! do not outvote them ([`Smoothing`](super::Smoothing)), but geometry knows the ground. It does
//! not know wheels, bumpers and feet from it to the last point, so that true classes are the better
//! ones there. The two are told apart by what only errors do: lie on the ground with nothing of an
//! object above or beside them, and run on into ground that is called ground. (Few beams meet some
//! objects in one row alone, and all of it may be taken for ground; but it stands out from the
//! ground beside it.)

use nalgebra::Vector3;
use rustc_hash::FxHashSet;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ground::Ground;
use super::object_mask::ObjectMask;
use crate::cloud::Reason;
use crate::cloud::point_cloud::PointCloud;
use crate::range_image::{NOWHERE, RangeImage};

/// When the ground is taken out of the objects that a network found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GroundBleed {
    /// Share of the points of objects that lie on the ground, with no point of an object above the
    /// ground in the cells around, from which on the classes of a cloud are taken to bleed. Default
    /// 0.008: of true classes it is up to 0.005, of a network's 0.012 and more (32 scans of
    /// SemanticKITTI, 3D-MiniNet-tiny).
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 0.1]))]
    pub share: f64,
    /// Side of these cells. Default 0.3, half of a wheel.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    #[schemars(extend("unit" = "m", "slider" = [0.1, 1.0]))]
    pub cell: f64,
    /// A point whose class is as sure keeps it, where a confidence is known. Default 0.9.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub sure: f64,
}

impl Default for GroundBleed {
    fn default() -> Self {
        GroundBleed { share: 0.008, cell: 0.3, sure: 0.9 }
    }
}

/// Fewer points away from objects are no sign of anything.
const FEWEST: usize = 10;

/// Of the share of points that are needed, the part that must lie beside bare ground. Of sparse
/// true classes it is a fiftieth, of a network's three eighths and more (in simulated drives of
/// four sensors and the same scans).
const BESIDE: f64 = 0.125;
/// Distance to bare ground beside a point, metres.
const NEAR: f32 = 0.3;
/// Columns and rows around a point in which bare ground lies beside it.
const AROUND: [usize; 2] = [12, 1];

/// How far along a row the class of the ground is looked for, in pixels ...
const MOST_COLUMNS: usize = 64;
/// ... and along a column.
const MOST_ROWS: usize = 16;

/// Takes the ground out of the objects of a mask if the classes bleed; `raw` are the ids that they
/// come from. Returns the points that were taken out, ascending, with the raw id of the ground
/// beside them, or 0 where none is near.
pub(super) fn take_out(
    (cloud, image): (&PointCloud, &RangeImage),
    raw: &[u16],
    ground: &Ground,
    params: &GroundBleed,
    mask: &mut ObjectMask,
) -> Vec<(u32, u16)> {
    let on_ground: Vec<usize> = (0..cloud.len())
        .filter(|&point| mask.is_object[point] && ground.is_ground[point])
        .collect();
    let alone = alone(cloud, ground, &on_ground, params.cell, mask);
    let beside_bare = alone.iter().filter(|&&point| {
        let is_bare = |other: usize| is_bare(mask, ground, other);
        runs_on(cloud, image, point, is_bare)
    });
    let objects = mask.is_object.iter().filter(|&&is_object| is_object).count();
    let least = params.share * objects as f64;
    let bleeds = alone.len() >= FEWEST && alone.len() as f64 >= least;
    if !bleeds || (beside_bare.count() as f64) < BESIDE * least {
        return Vec::new();
    }
    let is_sure = |point: usize| {
        cloud.confidence.as_ref().is_some_and(|sure| f64::from(sure[point]) >= params.sure)
    };
    let taken: Vec<usize> = on_ground.into_iter().filter(|&point| !is_sure(point)).collect();
    let beside: Vec<Option<usize>> = taken
        .iter()
        .map(|&point| ground_beside(image, point, |other| is_bare(mask, ground, other)))
        .collect();
    for (&point, &beside) in taken.iter().zip(&beside) {
        mask.class[point] = beside.map_or(0, |beside| mask.class[beside]);
        mask.is_object[point] = false;
        mask.reason[point] = Reason::Ground;
    }
    let id = |beside: Option<usize>| beside.map_or(0, |beside| raw[beside]);
    taken.into_iter().zip(beside).map(|(point, beside)| (point as u32, id(beside))).collect()
}

/// The points of objects on the ground that have no point of an object above the ground in the
/// cells around.
fn alone(
    cloud: &PointCloud,
    ground: &Ground,
    on_ground: &[usize],
    cell: f64,
    mask: &ObjectMask,
) -> Vec<usize> {
    let cell_of = |point: usize| {
        let [x, y, _] = cloud.position(point);
        [x, y].map(|along| (f64::from(along) / cell).floor() as i64)
    };
    let upright = (0..cloud.len()).filter(|&p| mask.is_object[p] && !ground.is_ground[p]);
    let cells: FxHashSet<[i64; 2]> = upright.map(cell_of).collect();
    let is_alone = |&point: &usize| {
        let [x, y] = cell_of(point);
        !(x - 1..=x + 1).any(|x| (y - 1..=y + 1).any(|y| cells.contains(&[x, y])))
    };
    on_ground.iter().copied().filter(is_alone).collect()
}

/// Whether bare ground lies beside a point.
fn runs_on(
    cloud: &PointCloud,
    image: &RangeImage,
    point: usize,
    is_bare: impl Fn(usize) -> bool,
) -> bool {
    let Some(pixel) = image.pixel_of(point) else { return false };
    let (row, column) = (pixel / image.columns(), pixel % image.columns());
    let [columns, rows] = AROUND;
    let rows = row.saturating_sub(rows)..image.rows().min(row + rows + 1);
    let columns = column.saturating_sub(columns)..image.columns().min(column + columns + 1);
    let at = Vector3::from(cloud.position(point));
    rows.into_iter().flat_map(|row| &image.point_of_pixel.row(row)[columns.clone()]).any(|&other| {
        let other = other as usize;
        other != NOWHERE as usize
            && is_bare(other)
            && (Vector3::from(cloud.position(other)) - at).norm() < NEAR
    })
}

/// Whether a point lies on the ground by its class and by geometry.
fn is_bare(mask: &ObjectMask, ground: &Ground, point: usize) -> bool {
    ground.is_ground[point] && mask.reason[point] == Reason::NotAnObject
}

/// The nearest point that is bare ground along the row of a point, else along its column.
fn ground_beside(
    image: &RangeImage,
    point: usize,
    is_bare: impl Fn(usize) -> bool,
) -> Option<usize> {
    let pixel = image.pixel_of(point)?;
    let (row, column) = (pixel / image.columns(), pixel % image.columns());
    let bare = |row: Option<usize>, column: Option<usize>| {
        let (row, column) = (row?, column?);
        let is_inside = row < image.rows() && column < image.columns();
        let point = is_inside.then(|| image.point_of_pixel.row(row)[column])?;
        (point != NOWHERE && is_bare(point as usize)).then_some(point as usize)
    };
    let along_row = (1..=MOST_COLUMNS).find_map(|away| {
        let left = bare(Some(row), column.checked_sub(away));
        left.or_else(|| bare(Some(row), Some(column + away)))
    });
    along_row.or_else(|| {
        (1..=MOST_ROWS).find_map(|away| {
            let below = bare(Some(row + away), Some(column));
            below.or_else(|| bare(row.checked_sub(away), Some(column)))
        })
    })
}

#[cfg(test)]
mod tests {
    use divmerge_simulate::{Drive, Scene, Sensor};

    use super::*;
    use crate::cloud::taxonomy::Taxonomy;
    use crate::range_image::ProjectionParams;
    use crate::semantics::{Corrections, GroundParams, MaskSource, object_mask};

    const CAR: u16 = 10;
    const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];

    /// A car park with the true classes, and for each point whether it is ground that a network
    /// would paint: within 0.8 m of a car.
    fn car_park() -> (PointCloud, Vec<bool>) {
        let mut columns =
            Drive::new(Sensor::Hdl64e, Scene::Parking, 3).frame(0).cloud.into_columns();
        let (class, ring) = (columns.class.take().unwrap(), columns.ring.take());
        let (height, width) = (columns.height, columns.width);
        let cloud = PointCloud::new(columns.x, columns.y, columns.z).unwrap();
        let cloud = cloud.organised(height, width).unwrap();
        let cell = |point: usize| {
            let [x, y, _] = cloud.position(point);
            [x, y].map(|along| (along / 0.4).floor() as i64)
        };
        let of_cars = (0..cloud.len()).filter(|&point| class[point] == CAR);
        let cars: FxHashSet<[i64; 2]> = of_cars.map(cell).collect();
        let is_beside = |point: usize| {
            let [x, y] = cell(point);
            (-2..=2).any(|i| (-2..=2).any(|j| cars.contains(&[x + i, y + j])))
        };
        let painted = (0..cloud.len())
            .map(|point| {
                GROUND.contains(&class[point]) && cloud.is_return(point) && is_beside(point)
            })
            .collect();
        let cloud = cloud.with(|columns| (columns.class, columns.ring) = (Some(class), ring));
        (cloud.unwrap(), painted)
    }

    fn mask(cloud: &PointCloud, taxonomy: &Taxonomy, bleed: Option<&GroundBleed>) -> ObjectMask {
        let image = RangeImage::new(cloud, &ProjectionParams::default());
        let (ground, smoothing) = (GroundParams::default(), None);
        let source = MaskSource::NetworkClasses(taxonomy, &ground);
        object_mask(cloud, &image, source, Corrections { smoothing, bleed })
    }

    #[test]
    fn painted_ground_is_taken_out_and_true_classes_stay() {
        let taxonomy = Taxonomy::semantic_kitti();
        let (cloud, painted) = car_park();
        let params = GroundBleed::default();
        let of_truth = mask(&cloud, &taxonomy, None);
        assert_eq!(mask(&cloud, &taxonomy, Some(&params)).is_object, of_truth.is_object);

        let mut class = cloud.class.clone().unwrap();
        let points: Vec<usize> = (0..cloud.len()).filter(|&point| painted[point]).collect();
        points.iter().for_each(|&point| class[point] = CAR);
        let network = cloud.clone().with_class(class).unwrap();
        let bled = mask(&network, &taxonomy, None);
        let found = mask(&network, &taxonomy, Some(&params));
        let false_points =
            |mask: &ObjectMask| points.iter().filter(|&&point| mask.is_object[point]).count();
        assert_eq!(false_points(&bled), points.len());
        assert!(false_points(&found) * 10 < points.len(), "{}", false_points(&found));
        let lost = |mask: &ObjectMask| {
            let objects = (0..cloud.len()).filter(|&point| of_truth.is_object[point]);
            objects.filter(|&point| !mask.is_object[point]).count()
        };
        let objects = of_truth.object_points().len();
        assert!(lost(&found) * 20 < objects, "{} of {objects}", lost(&found));
        // Most have the class of the ground beside them now; between parked cars none is bare.
        let renamed = found.corrected.iter().filter(|(_, id)| GROUND.contains(id)).count();
        assert!(renamed * 4 > found.corrected.len() * 3, "{renamed} of {}", found.corrected.len());
        let stays = |&(point, _): &(u32, u16)| found.reason[point as usize] == Reason::Ground;
        assert!(found.corrected.iter().all(stays));
    }

    #[test]
    fn points_of_a_sure_class_stay() {
        let taxonomy = Taxonomy::semantic_kitti();
        let (cloud, painted) = car_park();
        let mut class = cloud.class.clone().unwrap();
        let points = (0..cloud.len()).filter(|&point| painted[point]);
        points.for_each(|point| class[point] = CAR);
        let sure = cloud.with_class(class).unwrap();
        let confidence = Some(vec![0.95; sure.len()]);
        let sure = sure.with(|columns| columns.confidence = confidence).unwrap();
        let taken = mask(&sure, &taxonomy, Some(&GroundBleed::default()));
        assert_eq!(taken.is_object, mask(&sure, &taxonomy, None).is_object);
        let all = GroundBleed { sure: 1.0, ..GroundBleed::default() };
        assert!(mask(&sure, &taxonomy, Some(&all)).is_object != taken.is_object);
    }
}
