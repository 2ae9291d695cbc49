//! Small clouds on which the methods are tested.

use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{Detection, PointCloud};
use divmerge_core::cluster::{ClusterParams, Method, MethodInput, ObjectPixels};
use divmerge_core::range_image::{ProjectionParams, RangeImage};
use divmerge_core::semantics::{Corrections, MaskSource, ObjectMask, object_mask};

pub(super) const CAR: u16 = 10;
pub(super) const PERSON: u16 = 30;
pub(super) const ROAD: u16 = 40;

/// A cloud with its image, its mask and its object pixels.
pub(super) struct TestFrame {
    cloud: PointCloud,
    image: RangeImage,
    pub mask: ObjectMask,
    objects: ObjectPixels,
}

impl TestFrame {
    /// The instances that a method finds, given what a detector found.
    pub fn instances(&self, method: &dyn Method, detections: &[Detection]) -> Vec<u32> {
        let TestFrame { cloud, image, mask, objects } = self;
        let input =
            MethodInput::new(cloud, image, mask, objects, &ClusterParams::best()).with(detections);
        method.segment(&input).of_point.expect("a method that segments points")
    }
}

/// A cloud whose points are an image of `width` columns, row by row.
pub(super) fn frame(width: usize, points: &[([f32; 3], u16)]) -> TestFrame {
    let column = |axis: usize| points.iter().map(|(position, _)| position[axis]).collect();
    let cloud = PointCloud::new(column(0), column(1), column(2)).expect("columns");
    let cloud = cloud.with_class(points.iter().map(|&(_, class)| class).collect());
    let cloud = cloud.expect("classes").organised(points.len() / width, width).expect("shape");
    let image = RangeImage::new(&cloud, &ProjectionParams::default());
    let taxonomy = Taxonomy::semantic_kitti();
    let mask = object_mask(&cloud, &image, MaskSource::Classes(&taxonomy), Corrections::default());
    let objects = ObjectPixels::new(&cloud, &image, &mask, &ClusterParams::best());
    TestFrame { cloud, image, mask, objects }
}

/// The instances that a method finds in such a cloud.
pub(super) fn instances(method: &dyn Method, width: usize, points: &[([f32; 3], u16)]) -> Vec<u32> {
    frame(width, points).instances(method, &[])
}

/// The instances of one beam's points; a beam below sees the road.
pub(super) fn instances_of_a_beam(method: &dyn Method, points: &[([f32; 3], u16)]) -> Vec<u32> {
    let below = points.iter().map(|&([x, y, z], _)| ([x, y, z - 1.0], ROAD));
    let both: Vec<([f32; 3], u16)> = points.iter().copied().chain(below).collect();
    instances(method, points.len(), &both)[..points.len()].to_vec()
}
