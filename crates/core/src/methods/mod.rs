//! The other methods, from their papers, for comparison with ours: points, classes and the range
//! image in, an instance for each point out.
//!
//! | method | source |
//! | --- | --- |
//! | [`OnePerClass`] | no clustering at all |
//! | [`Euclidean`] | connected components in space (Rusu 2010) |
//! | [`Dbscan`] | Ester et al. 1996 |
//! | [`DepthClustering`] | Bogoslavskyi and Stachniss 2016 |
//! | [`ScanLineRun`] | Zermas, Izzat and Papanikolopoulos 2017 |
//! | [`Supervoxel`] | VCCS, Papon et al. 2013 |
//! | [`Boxes`] | cut out by 3-D detection boxes, as in Behley et al. 2020 |
//! | [`Alpine`] | Sautier et al. 2025 |
//!
//! Each clusters the points of one class apart from those of all others. To have a method see all
//! objects alike, as the released pipelines of 2021 do, give it a mask [without
//! classes](without_classes).

mod alpine;
mod boxes;
mod dbscan;
mod depth;
mod euclidean;
mod scan_line_run;
mod supervoxel;

use rustc_hash::FxHashMap;
use serde::Serialize;

use crate::cloud::point_cloud::PointCloud;
use crate::cloud::taxonomy::Taxonomy;
use crate::cluster::ObjectPixels;
use crate::cluster::back_projection::label_source;
use crate::cluster::params::{BackProjection, ClusterParams};
use crate::geometry::statistics::most_frequent;
use crate::range_image::RangeImage;
use crate::semantics::ObjectMask;

pub use crate::cloud::Detection;
pub use alpine::Alpine;
pub use boxes::Boxes;
pub use dbscan::Dbscan;
pub use depth::DepthClustering;
pub use euclidean::Euclidean;
pub use scan_line_run::ScanLineRun;
pub use supervoxel::Supervoxel;

/// What a method sees of a frame of N points.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// The points.
    pub cloud: &'a PointCloud,
    /// Their range image.
    pub image: &'a RangeImage,
    /// Which of them are objects, and of which class.
    pub mask: &'a ObjectMask,
    /// Where shadowed points look for an instance, for methods on the range image.
    pub back_projection: BackProjection,
    /// What a detector found in the frame.
    pub detections: &'a [Detection],
}

/// A method that cuts objects into instances.
pub trait Baseline {
    /// N: the instance of each point from 1; 0 for points that are no object or that it leaves out.
    fn instances(&self, view: View) -> Vec<u32>;
}

/// One of the methods with its parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // each says what it is
pub enum AnyBaseline {
    Alpine(Alpine),
    Boxes(Boxes),
    Dbscan(Dbscan),
    DepthClustering(DepthClustering),
    Euclidean(Euclidean),
    OnePerClass(OnePerClass),
    ScanLineRun(ScanLineRun),
    Supervoxel(Supervoxel),
}

impl AnyBaseline {
    fn inner(&self) -> &dyn Baseline {
        match self {
            AnyBaseline::Alpine(method) => method,
            AnyBaseline::Boxes(method) => method,
            AnyBaseline::Dbscan(method) => method,
            AnyBaseline::DepthClustering(method) => method,
            AnyBaseline::Euclidean(method) => method,
            AnyBaseline::OnePerClass(method) => method,
            AnyBaseline::ScanLineRun(method) => method,
            AnyBaseline::Supervoxel(method) => method,
        }
    }

    /// The method of a name with its usual parameters.
    pub fn named(name: &str, taxonomy: &Taxonomy) -> Option<Self> {
        Some(match name {
            "alpine" => AnyBaseline::Alpine(Alpine::new(taxonomy)),
            "boxes" => AnyBaseline::Boxes(Boxes::default()),
            "dbscan" => AnyBaseline::Dbscan(Dbscan::default()),
            "depth-clustering" => AnyBaseline::DepthClustering(DepthClustering::default()),
            "euclidean" => AnyBaseline::Euclidean(Euclidean::default()),
            "one-per-class" => AnyBaseline::OnePerClass(OnePerClass),
            "scan-line-run" => AnyBaseline::ScanLineRun(ScanLineRun::default()),
            "supervoxel" => AnyBaseline::Supervoxel(Supervoxel::default()),
            _ => return None,
        })
    }

    /// Name of the method, as at the command line.
    pub fn name(&self) -> &'static str {
        match self {
            AnyBaseline::Alpine(_) => "alpine",
            AnyBaseline::Boxes(_) => "boxes",
            AnyBaseline::Dbscan(_) => "dbscan",
            AnyBaseline::DepthClustering(_) => "depth-clustering",
            AnyBaseline::Euclidean(_) => "euclidean",
            AnyBaseline::OnePerClass(_) => "one-per-class",
            AnyBaseline::ScanLineRun(_) => "scan-line-run",
            AnyBaseline::Supervoxel(_) => "supervoxel",
        }
    }
}

impl Baseline for AnyBaseline {
    fn instances(&self, view: View) -> Vec<u32> {
        self.inner().instances(view)
    }
}

/// All points of a class are one instance.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct OnePerClass;

impl Baseline for OnePerClass {
    fn instances(&self, view: View) -> Vec<u32> {
        per_class(view, |_, points| vec![1; points.len()])
    }
}

/// The mask with all objects of class 0.
pub fn without_classes(mask: &ObjectMask) -> ObjectMask {
    ObjectMask { class: vec![0; mask.class.len()], sizes: vec![None], ..mask.clone() }
}

/// N: the class of each point, which is the most frequent one among its instance's points and its
/// own where it has no instance. Ties go to the lower number.
pub fn majority_class(instance: &[u32], class: &[u16]) -> Vec<u16> {
    let mut votes: FxHashMap<u32, Vec<u16>> = FxHashMap::default();
    for (&instance, &class) in instance.iter().zip(class).filter(|&(&instance, _)| instance != 0) {
        votes.entry(instance).or_default().push(class);
    }
    let of_instance: FxHashMap<u32, u16> = votes
        .into_iter()
        .filter_map(|(instance, classes)| Some((instance, most_frequent(classes)?)))
        .collect();
    let class_of = |(instance, class)| *of_instance.get(instance).unwrap_or(class);
    instance.iter().zip(class).map(class_of).collect()
}

/// Clusters the object points class by class. `cluster` gets a class number and n positions in
/// metres, sensor frame, and returns n cluster numbers from 1, or 0 for what is in none.
fn per_class(view: View, cluster: impl Fn(u16, &[[f64; 3]]) -> Vec<u32>) -> Vec<u32> {
    let mask = view.mask;
    let mut objects: Vec<usize> = (0..view.cloud.len()).filter(|&p| mask.is_object[p]).collect();
    objects.sort_by_key(|&point| mask.class[point]);
    let mut instance = vec![0; view.cloud.len()];
    let mut before = 0;
    for points in objects.chunk_by(|&a, &b| mask.class[a] == mask.class[b]) {
        let positions = points.iter().map(|&point| view.cloud.position(point).map(f64::from));
        let found = cluster(mask.class[points[0]], &positions.collect::<Vec<_>>());
        for (&point, &cluster) in points.iter().zip(&found).filter(|&(_, &cluster)| cluster != 0) {
            instance[point] = before + cluster;
        }
        before += found.iter().max().copied().unwrap_or(0);
    }
    instance
}

/// The object pixels of a range image, their neighbours of the same class, and the angle condition
/// of the paper between them, for an angle in radians.
fn object_pixels(view: View, angle: f64) -> ObjectPixels {
    let mut params = ClusterParams { same_class_neighbours: true, ..ClusterParams::paper() };
    params.condition.angle = angle;
    ObjectPixels::new(view.cloud, view.image, view.mask, &params)
}

/// From the instances of the M object pixels to those of the N points: a shadowed point takes that
/// of the nearest pixel of its class in the view's window.
fn to_points(view: View, objects: &ObjectPixels, instance: &[u32]) -> Vec<u32> {
    let View { cloud, image, mask, back_projection, .. } = view;
    let of_point = |point| {
        let source = label_source(cloud, image, mask, objects, point, back_projection);
        source.map_or(0, |object| instance[object])
    };
    (0..cloud.len()).map(of_point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::taxonomy::Taxonomy;
    use crate::range_image::ProjectionParams;
    use crate::semantics::{MaskSource, object_mask};

    pub(super) const CAR: u16 = 10;
    pub(super) const PERSON: u16 = 30;
    const ROAD: u16 = 40;

    /// A cloud with its image and its mask.
    pub(super) struct Frame {
        cloud: PointCloud,
        image: RangeImage,
        mask: ObjectMask,
    }

    impl Frame {
        pub fn view<'a>(&'a self, detections: &'a [Detection]) -> View<'a> {
            let Frame { cloud, image, mask } = self;
            let back_projection = ClusterParams::best().back_projection;
            View { cloud, image, mask, back_projection, detections }
        }
    }

    /// A cloud whose points are an image of `width` columns, row by row.
    pub(super) fn frame(width: usize, points: &[([f32; 3], u16)]) -> Frame {
        let column = |axis: usize| points.iter().map(|(position, _)| position[axis]).collect();
        let cloud = PointCloud::new(column(0), column(1), column(2)).expect("columns");
        let cloud = cloud.with_class(points.iter().map(|&(_, class)| class).collect());
        let cloud = cloud.expect("classes").organised(points.len() / width, width).expect("shape");
        let image = RangeImage::new(&cloud, &ProjectionParams::default());
        let taxonomy = Taxonomy::semantic_kitti();
        let mask = object_mask(&cloud, &image, MaskSource::Classes(&taxonomy), None);
        Frame { cloud, image, mask }
    }

    /// What a method makes of such a cloud.
    pub(super) fn instances(
        method: &dyn Baseline,
        width: usize,
        points: &[([f32; 3], u16)],
    ) -> Vec<u32> {
        method.instances(frame(width, points).view(&[]))
    }

    /// The instances of one beam's points; a beam below sees the road.
    pub(super) fn instances_of_a_beam(
        method: &dyn Baseline,
        points: &[([f32; 3], u16)],
    ) -> Vec<u32> {
        let below = points.iter().map(|&([x, y, z], _)| ([x, y, z - 1.0], ROAD));
        let both: Vec<([f32; 3], u16)> = points.iter().copied().chain(below).collect();
        instances(method, points.len(), &both)[..points.len()].to_vec()
    }

    #[test]
    fn one_per_class() {
        let at = |x: f32, class| ([x, 1.0, 0.0], class);
        let points = [at(5.0, PERSON), at(9.0, CAR), at(7.0, ROAD), at(60.0, CAR)];
        assert_eq!(instances(&OnePerClass, 4, &points), [2, 1, 0, 1]);
    }

    #[test]
    fn majority_of_an_instance() {
        let class = majority_class(&[1, 1, 1, 2, 2, 0, 0], &[4, 5, 5, 7, 6, 3, 9]);
        assert_eq!(class, [5, 5, 5, 6, 6, 3, 9]);
    }
}
