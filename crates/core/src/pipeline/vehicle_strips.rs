//! A long, low strip is no vehicle, where a network's classes bleed.
//!
//! A network calls the top of a hedge, a rail or a kerb a car. Its points all say so, so that no
//! vote of a segment helps ([`SegmentVote`](super::SegmentVote)); but no vehicle of which metres
//! are seen is as low. Over a wall the roof of a car may be all that shows, 0.4 m of 2 m; when 4 m
//! are seen, they show the bonnet too, half a metre below the roof.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::class_votes::{class_weights, majority};
use super::instances::Members;
use crate::cloud::point_cloud::{PointCloud, wide};
use crate::cloud::taxonomy::{Taxonomy, body_of_class};
use crate::cloud::{Body, Reason, UprightBox};
use crate::geometry::statistics::most_frequent;
use crate::range_image::RangeImage;
use crate::semantics::ObjectMask;

/// Which strips that a network calls vehicles are none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VehicleStrips {
    /// Height below which a strip may be none, the distance between two rows added to what is seen.
    /// Default 0.6; 0.6 and 0.7 score alike.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[schemars(extend("unit" = "m", "slider" = [0.0, 2.0]))]
    pub height: f64,
    /// It is none if it is longer than this many times that height. Default 7; 6 to 8 score alike.
    #[schemars(range(min = 0.0, max = 1000.0), extend("slider" = [1.0, 20.0]))]
    pub ratio: f64,
}

impl Default for VehicleStrips {
    fn default() -> Self {
        VehicleStrips { height: 0.6, ratio: 7.0 }
    }
}

/// What lies beside a strip within this is what it is part of, metres.
const BESIDE: f64 = 1.0;

impl VehicleStrips {
    /// Corrects the classes of a mask, given the instance of each of N points that its objects are
    /// cut into. A strip takes the class that most points next to it have that are neither things
    /// nor ground, or none.
    pub(super) fn correct(
        &self,
        (cloud, image): (&PointCloud, &RangeImage),
        taxonomy: &Taxonomy,
        instance: &[u32],
        mask: &mut ObjectMask,
    ) {
        let count = instance.iter().copied().max().unwrap_or(0);
        let members = Members::new(&mask.object_points(), instance, count as usize);
        let (weights, raw) = (class_weights(cloud, mask), mask.raw_ids(cloud));
        let row_steps = image.row_steps(cloud);
        let is_vehicle = |points: &[u32]| {
            let (class, _) = majority(points, &mask.class, &raw, weights.as_deref());
            let body = body_of_class(&taxonomy.classes()[usize::from(class)].name);
            matches!(body, Some(Body::Car | Body::LargeVehicle))
        };
        let strips: Vec<&[u32]> = (1..=count)
            .map(|id| members.of(id))
            .filter(|points| {
                is_vehicle(points) && self.is_strip((cloud, image), &row_steps, points)
            })
            .collect();
        let mut corrected = Vec::new();
        for points in strips {
            let beside = beside((cloud, image), points, |point| {
                let class = &taxonomy.classes()[usize::from(mask.class[point])];
                mask.reason[point] == Reason::NotAnObject && !class.is_ground()
            });
            let of = most_frequent(beside.iter().map(|&point| (mask.class[point], raw[point])));
            let (class, id) = of.unwrap_or((0, 0));
            for point in points.iter().map(|&point| point as usize) {
                mask.class[point] = class;
                mask.is_object[point] = false;
                mask.reason[point] = Reason::NotAnObject;
            }
            corrected.extend(points.iter().map(|&point| (point, id)));
        }
        mask.correct(corrected);
    }

    /// Whether some points are a long, low strip.
    fn is_strip(
        &self,
        (cloud, image): (&PointCloud, &RangeImage),
        row_steps: &[f64],
        points: &[u32],
    ) -> bool {
        let Some(bounds) = UprightBox::around(cloud, points) else { return false };
        let [along, across, height] = bounds.size;
        let between_rows = points.iter().filter_map(|&point| {
            let pixel = image.pixel_of(point as usize)?;
            let position = wide(cloud.position(point as usize));
            let from_sensor = image.band_of(pixel).from_sensor(position);
            let squared = from_sensor.iter().map(|x| x * x).sum::<f64>();
            Some(row_steps[pixel / image.columns()] * squared.sqrt())
        });
        let height = height + between_rows.fold(f64::INFINITY, f64::min);
        height < self.height && along.max(across) > self.ratio * height
    }
}

/// The points above and below some points in the image and near them, of those that are asked for.
fn beside(
    (cloud, image): (&PointCloud, &RangeImage),
    points: &[u32],
    is_asked: impl Fn(usize) -> bool,
) -> Vec<usize> {
    let is_near = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|point| wide(cloud.position(point)));
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() < BESIDE * BESIDE
    };
    let pixels = image.rows() * image.columns();
    let mut found = Vec::new();
    for point in points.iter().map(|&point| point as usize) {
        let Some(pixel) = image.pixel_of(point) else { continue };
        let rows = [pixel.checked_sub(image.columns()), Some(pixel + image.columns())];
        let others = rows.into_iter().flatten().filter(|&pixel| pixel < pixels);
        let others = others.filter_map(|pixel| image.point_at(pixel));
        found.extend(others.filter(|&other| is_near(point, other) && is_asked(other)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::range_image::ProjectionParams;
    use crate::semantics::{Corrections, MaskSource, object_mask};

    const CAR: u16 = 10;
    const PERSON: u16 = 30;
    const VEGETATION: u16 = 70;
    const COLUMNS: usize = 120;

    /// A hedge 10 m before the sensor, of rows 0.1 m apart, some of which have a class of their own
    /// from the first column on to `columns`.
    fn hedge(rows: std::ops::Range<usize>, columns: usize, called: u16) -> (PointCloud, Vec<u32>) {
        let points = (0..14).flat_map(|row| (0..COLUMNS).map(move |column| (row, column)));
        let (mut axes, mut class) = ([vec![], vec![], vec![]], Vec::new());
        for (row, column) in points {
            let at = [10.0, 2.0 - 0.04 * column as f32, 0.3 - 0.1 * row as f32];
            axes.iter_mut().zip(at).for_each(|(axis, at)| axis.push(at));
            let is_called = rows.contains(&row) && column < columns;
            class.push(if is_called { called } else { VEGETATION });
        }
        let instance = class.iter().map(|&class| u32::from(class == called)).collect();
        let [x, y, z] = axes;
        let cloud = PointCloud::new(x, y, z).unwrap().organised(14, COLUMNS).unwrap();
        (cloud.with_class(class).unwrap(), instance)
    }

    /// The raw ids of what is called something else than vegetation.
    fn left((cloud, instance): (PointCloud, Vec<u32>)) -> usize {
        let taxonomy = Taxonomy::semantic_kitti();
        let image = RangeImage::new(&cloud, &ProjectionParams::default());
        let source = MaskSource::Classes(&taxonomy);
        let mut mask = object_mask(&cloud, &image, source, Corrections::default());
        VehicleStrips::default().correct((&cloud, &image), &taxonomy, &instance, &mut mask);
        let raw = mask.raw_ids(&cloud);
        let objects = mask.is_object.iter().filter(|&&is_object| is_object).count();
        assert_eq!(objects, raw.iter().filter(|&&id| id != VEGETATION).count());
        objects
    }

    #[test]
    fn a_long_low_strip_is_what_lies_around_it() {
        assert_eq!(left(hedge(4..8, COLUMNS, CAR)), 0);
    }

    #[test]
    fn a_roof_a_whole_car_and_what_is_no_vehicle_stay() {
        assert_eq!(left(hedge(4..8, 50, CAR)), 4 * 50);
        assert_eq!(left(hedge(2..12, COLUMNS, CAR)), 10 * COLUMNS);
        assert_eq!(left(hedge(4..8, COLUMNS, PERSON)), 4 * COLUMNS);
    }
}
