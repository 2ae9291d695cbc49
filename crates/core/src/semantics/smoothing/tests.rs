use super::*;
use crate::range_image::ProjectionParams;
use crate::semantics::{Corrections, MaskSource, object_mask};

const CAR: u16 = 10;
const ROAD: u16 = 40;
const ROWS: usize = 24;
const COLUMNS: usize = 120;

/// A wall of a car's class between columns 30 and 90, 10 m off; road beside it, 20 m off.
fn scene() -> PointCloud {
    let pixels = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column)));
    let (mut x, mut y, mut z, mut class) = (vec![], vec![], vec![], vec![]);
    for (row, column) in pixels {
        let is_car = (30..90).contains(&column);
        let range = if is_car { 10.0_f64 } else { 20.0 };
        let (azimuth, elevation) = (-0.003 * column as f64, 0.1 - 0.008 * row as f64);
        x.push((range * azimuth.cos() * elevation.cos()) as f32);
        y.push((range * azimuth.sin() * elevation.cos()) as f32);
        z.push((range * elevation.sin()) as f32);
        class.push(if is_car { CAR } else { ROAD });
    }
    let cloud = PointCloud::new(x, y, z).and_then(|cloud| cloud.organised(ROWS, COLUMNS));
    cloud.and_then(|cloud| cloud.with_class(class)).expect("columns of one length")
}

/// Every n-th point of one class called the other.
fn spoiled(cloud: &PointCloud, every: usize) -> PointCloud {
    let spoiled = cloud.clone().with(|columns| {
        for class in columns.class.iter_mut().flatten().step_by(every) {
            *class = if *class == CAR { ROAD } else { CAR };
        }
    });
    spoiled.unwrap()
}

fn mask(cloud: &PointCloud, smoothing: Option<&Smoothing>) -> ObjectMask {
    let image = RangeImage::new(cloud, &ProjectionParams::default());
    let taxonomy = Taxonomy::semantic_kitti();
    let corrections = Corrections { smoothing, ..Corrections::default() };
    object_mask(cloud, &image, MaskSource::Classes(&taxonomy), corrections)
}

#[test]
fn true_classes_stay_as_they_are() {
    let found = mask(&scene(), Some(&Smoothing::default()));
    assert_eq!(found, mask(&scene(), None));
    assert!(found.corrected.is_empty());
}

#[test]
fn points_against_their_neighbours_are_corrected_where_there_are_many() {
    let truth = mask(&scene(), None);
    let spoiled = spoiled(&scene(), 7);
    let wrong = |mask: &ObjectMask| {
        mask.class.iter().zip(&truth.class).filter(|(found, truth)| found != truth).count()
    };
    let (before, after) = (mask(&spoiled, None), mask(&spoiled, Some(&Smoothing::default())));
    assert_eq!(wrong(&before), (ROWS * COLUMNS).div_ceil(7));
    assert!(wrong(&after) * 20 < wrong(&before), "{} of {}", wrong(&after), wrong(&before));
    assert_eq!(after.corrected.len(), wrong(&before) - wrong(&after));
    for &(point, id) in &after.corrected {
        let point = point as usize;
        assert!(id == CAR || id == ROAD);
        assert_eq!(after.is_object[point], id == CAR);
        assert_eq!(after.reason[point] == Reason::None, id == CAR);
    }
}

#[test]
fn classes_of_one_family_are_left_to_the_vote_on_the_object() {
    const TRUCK: u16 = 18;
    let flickering = scene().with(|columns| {
        for class in columns.class.iter_mut().flatten().step_by(7).filter(|c| **c == CAR) {
            *class = TRUCK;
        }
    });
    let flickering = flickering.unwrap();
    let found = mask(&flickering, Some(&Smoothing::default()));
    assert_eq!(found, mask(&flickering, None));
}

#[test]
fn a_few_odd_points_are_taken_as_they_are() {
    let spoiled = spoiled(&scene(), 500);
    assert_eq!(mask(&spoiled, Some(&Smoothing::default())), mask(&spoiled, None));
}

#[test]
fn nothing_and_clouds_without_classes() {
    let cloud = scene().with(|columns| columns.class = None).unwrap();
    assert!(mask(&cloud, Some(&Smoothing::default())).corrected.is_empty());
    let empty = PointCloud::new(vec![], vec![], vec![]).expect("no points");
    let empty = empty.with_class(vec![]).expect("no points");
    assert!(mask(&empty, Some(&Smoothing::default())).class.is_empty());
}
