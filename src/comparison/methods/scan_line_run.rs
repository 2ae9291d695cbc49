//! Scan-line run (Zermas, Izzat and Papanikolopoulos 2017).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shared::{object_pixels, to_points};
use divmerge_core::cluster::{Method, MethodInput, ObjectPixels, Segmentation};
use divmerge_core::geometry::disjoint_sets::DisjointSets;
use divmerge_core::range_image::RangeImage;

/// Each beam is cut into runs of neighbouring points, and a run takes over what its points are near
/// to in the beam above.
///
/// Two points that follow each other in a beam, pixels of other classes and of none stepped over,
/// are one run if they are nearer than `within`; a point joins the nearest one in the beam above if
/// that is nearer than `between`. The paper finds that one by its place in the list or by a k-d
/// tree; here all columns in which it can lie are looked at. As in the paper a beam sees the one
/// above it only.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScanLineRun {
    /// Between points of a run, metres. Default 0.5 (the paper's th_run).
    #[schemars(range(min = 0.0), extend("unit" = "m", "slider" = [0.05, 3.0]))]
    #[schemars(extend("source" = "Zermas et al. 2017"))]
    pub within: f64,
    /// Between points of neighbouring beams, metres. Default 1 (the paper's th_merge).
    #[schemars(range(min = 0.0), extend("unit" = "m", "slider" = [0.05, 3.0]))]
    #[schemars(extend("source" = "Zermas et al. 2017"))]
    pub between: f64,
    /// Beams above that are looked at, the next only if nothing is near in those before. Default 1.
    #[schemars(range(min = 1, max = 64))]
    #[schemars(extend("slider" = [1, 8], "source" = "Zermas et al. 2017"))]
    pub beams: usize,
}

impl Default for ScanLineRun {
    fn default() -> Self {
        ScanLineRun { within: 0.5, between: 1.0, beams: 1 }
    }
}

impl Method for ScanLineRun {
    fn name(&self) -> &'static str {
        "scan-line-run"
    }

    parameters_are_fields!();

    fn segment(&self, input: &MethodInput) -> Segmentation {
        let objects = object_pixels(input, 0.0); // the condition is not asked
        let mut sets = DisjointSets::new(objects.len());
        let columns = input.image.columns();
        let all: Vec<usize> = (0..objects.len()).collect();
        for row in
            all.chunk_by(|&a, &b| row_of(&objects, a, columns) == row_of(&objects, b, columns))
        {
            join_runs(&objects, row, input.image.wraps, self.within, &mut sets);
            for &pixel in row {
                let mut above = (1..=self.beams)
                    .filter_map(|up| nearest_above(&objects, input.image, pixel, up, self.between));
                if let Some(above) = above.next() {
                    sets.join(pixel, above);
                }
            }
        }
        to_points(input, &objects, &sets.numbered())
    }
}

fn row_of(objects: &ObjectPixels, object: usize, columns: usize) -> usize {
    objects.pixel[object] as usize / columns
}

/// Joins the object pixels of a row that follow each other in their class and are near.
fn join_runs(
    objects: &ObjectPixels,
    row: &[usize],
    wraps: bool,
    within: f64,
    sets: &mut DisjointSets,
) {
    let mut by_class = row.to_vec();
    by_class.sort_by_key(|&object| objects.class[object]);
    for line in by_class.chunk_by(|&a, &b| objects.class[a] == objects.class[b]) {
        let seam = (line[line.len() - 1], line[0]);
        let pairs = line.windows(2).map(|pair| (pair[0], pair[1]));
        for (a, b) in pairs.chain(wraps.then_some(seam)) {
            if distance(objects, a, b) < within {
                sets.join(a, b);
            }
        }
    }
}

/// The nearest pixel of the same class so many rows above, if it is nearer than `reach` metres.
fn nearest_above(
    objects: &ObjectPixels,
    image: &RangeImage,
    object: usize,
    up: usize,
    reach: f64,
) -> Option<usize> {
    let columns = image.columns();
    let pixel = objects.pixel[object] as usize;
    let row = (pixel / columns).checked_sub(up)?;
    let [x, y, _] = objects.position[object].map(f64::from);
    // What is farther aside than the reach seen from the sensor is farther away than the reach.
    let angle = (reach / x.hypot(y)).min(1.0).asin();
    let aside = (angle / std::f64::consts::TAU * columns as f64).ceil() as isize + 1;
    let aside = aside.min((columns as isize - 1) / 2);
    let column = (pixel % columns) as isize;
    let places = (-aside..=aside).map(|offset| match image.wraps {
        true => (column + offset).rem_euclid(columns as isize),
        false => column + offset,
    });
    let above = places
        .filter(|place| (0..columns as isize).contains(place))
        .filter_map(|place| objects.at(row * columns + place as usize))
        .filter(|&other| objects.class[other] == objects.class[object]);
    let nearest = above.map(|other| (distance(objects, object, other), other));
    let nearest = nearest.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    nearest.filter(|&(distance, _)| distance < reach).map(|(_, other)| other)
}

fn distance(objects: &ObjectPixels, a: usize, b: usize) -> f64 {
    let [a, b] = [a, b].map(|object| objects.position[object].map(f64::from));
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::test_frames::{CAR, PERSON, instances, instances_of_a_beam};
    use super::*;

    /// Pixels of a wall-like image: column to y, row to z, at 10 m.
    fn at(y: f32, z: f32, class: u16) -> ([f32; 3], u16) {
        ([10.0, y, z], class)
    }

    #[test]
    fn runs_part_at_gaps_and_join_through_the_beam_above() {
        // Above: one run. Below: two, of which one is near it and one is not.
        let points = [
            at(0.0, 0.5, CAR),
            at(0.4, 0.5, CAR),
            at(0.8, 0.5, CAR),
            at(1.2, 0.5, CAR),
            at(0.0, 0.0, CAR),
            at(0.4, 0.0, CAR),
            at(2.4, 0.0, CAR),
            at(2.8, 0.0, CAR),
        ];
        assert_eq!(instances(&ScanLineRun::default(), 4, &points), [1, 1, 1, 1, 1, 1, 2, 2]);
    }

    #[test]
    fn other_classes_are_stepped_over() {
        let points =
            [at(0.0, 0.0, CAR), at(0.2, 0.0, PERSON), at(0.4, 0.0, CAR), at(1.0, 0.0, CAR)];
        assert_eq!(instances_of_a_beam(&ScanLineRun::default(), &points), [1, 2, 1, 3]);
    }

    #[test]
    fn a_beam_that_misses_parts_unless_more_beams_are_looked_at() {
        // Three beams 0.4 m apart; the middle one sees only the road.
        let points = [
            at(0.0, 0.8, CAR),
            at(0.2, 0.8, CAR),
            at(0.0, 0.4, 40),
            at(0.2, 0.4, 40),
            at(0.0, 0.0, CAR),
            at(0.2, 0.0, CAR),
        ];
        assert_eq!(instances(&ScanLineRun::default(), 2, &points), [1, 1, 0, 0, 2, 2]);
        let two = ScanLineRun { beams: 2, ..ScanLineRun::default() };
        assert_eq!(instances(&two, 2, &points), [1, 1, 0, 0, 1, 1]);
    }
}
