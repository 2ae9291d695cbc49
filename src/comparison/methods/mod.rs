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

/// A method's parameters are the fields of its struct.
macro_rules! parameters_are_fields {
    () => {
        fn parameters(&self) -> serde_json::Value {
            serde_json::json!(self)
        }

        fn schema(&self) -> serde_json::Value {
            divmerge_core::parameters::schema_of::<Self>()
        }

        fn with_parameters(
            &self,
            parameters: serde_json::Value,
        ) -> Option<std::sync::Arc<dyn Method>> {
            Some(std::sync::Arc::new(serde_json::from_value::<Self>(parameters).ok()?))
        }
    };
}

mod alpine;
mod boxes;
mod dbscan;
mod depth;
mod euclidean;
mod one_per_class;
mod scan_line_run;
mod shared;
mod supervoxel;
#[cfg(test)]
mod test_frames;

use std::sync::Arc;

use rustc_hash::FxHashMap;

use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cluster::Method;
use divmerge_core::geometry::statistics::most_frequent;
use divmerge_core::semantics::ObjectMask;

pub use alpine::Alpine;
pub use boxes::Boxes;
pub use dbscan::Dbscan;
pub use depth::DepthClustering;
pub use euclidean::Euclidean;
pub use one_per_class::OnePerClass;
pub use scan_line_run::ScanLineRun;
pub use supervoxel::Supervoxel;

/// The method that cuts along detections, which have to be given.
pub const BOXES: &str = "boxes";

/// The names of all methods.
pub const NAMES: [&str; 8] = [
    "alpine",
    BOXES,
    "dbscan",
    "depth-clustering",
    "euclidean",
    "one-per-class",
    "scan-line-run",
    "supervoxel",
];

/// The method of a name with its usual parameters; `None` for other names.
pub fn named(name: &str, taxonomy: &Taxonomy) -> Option<Arc<dyn Method>> {
    Some(match name {
        "alpine" => Arc::new(Alpine::new(taxonomy)),
        BOXES => Arc::new(Boxes::default()),
        "dbscan" => Arc::new(Dbscan::default()),
        "depth-clustering" => Arc::new(DepthClustering::default()),
        "euclidean" => Arc::new(Euclidean::default()),
        "one-per-class" => Arc::new(OnePerClass),
        "scan-line-run" => Arc::new(ScanLineRun::default()),
        "supervoxel" => Arc::new(Supervoxel::default()),
        _ => return None,
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn majority_of_an_instance() {
        let class = majority_class(&[1, 1, 1, 2, 2, 0, 0], &[4, 5, 5, 7, 6, 3, 9]);
        assert_eq!(class, [5, 5, 5, 6, 6, 3, 9]);
    }
}
