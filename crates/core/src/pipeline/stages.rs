//! Every intermediate of a run.

use serde::Serialize;

use super::config::Config;
use crate::cloud::point_cloud::PointCloud;
use crate::cloud::{Instance, PointLabels};
use crate::cluster::{Components, Merge, MethodInput, ObjectPixels, PostMerge, Votes};
use crate::range_image::RangeImage;
use crate::semantics::ObjectMask;

/// Every intermediate of a run, owned. N points, H x W pixels, M object pixels, m components.
///
/// With another method than divide and merge each of its instances stands as a component of its
/// own, and there are neither seeds nor votes, merges and joins.
#[derive(Debug, Clone, PartialEq)]
pub struct Stages {
    /// The range image.
    pub image: RangeImage,
    /// Which points are objects.
    pub mask: ObjectMask,
    /// The object pixels with their neighbours and conditions.
    pub objects: ObjectPixels,
    /// Seeds as object pixel numbers; seed k carries label k + 1.
    pub seeds: Vec<u32>,
    /// The local components of the divide step.
    pub components: Components,
    /// The votes on their borders.
    pub votes: Votes,
    /// The instances of the merge step, and every merge in its order.
    pub merge: Merge,
    /// The instances after the last merge, and what it knew when it decided.
    pub post_merge: PostMerge,
    /// Pixels of each instance after the last merge, small ones included; instance k at k - 1.
    pub merged_pixels: Vec<u32>,
    /// Instance, component, class and reason of every point.
    pub labels: PointLabels,
    /// The instances by id.
    pub instances: Vec<Instance>,
    /// Milliseconds per stage.
    pub times: StageTimes,
}

impl Stages {
    /// Instance of an object pixel after the merge step alone; 0 without a component.
    pub fn merged_instance(&self, object: usize) -> u32 {
        match self.components.label[object] {
            0 => 0,
            label => self.merge.instance_of_component[label as usize - 1],
        }
    }

    /// What the method of the run saw, given the cloud and the parameters of the run.
    pub fn method_input<'a>(&'a self, cloud: &'a PointCloud, config: &Config) -> MethodInput<'a> {
        MethodInput::new(cloud, &self.image, &self.mask, &self.objects, &config.cluster)
    }
}

/// Milliseconds per stage of one run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct StageTimes {
    /// Cloud to range image.
    pub projection_ms: f64,
    /// Object mask.
    pub mask_ms: f64,
    /// Object pixels, neighbours, conditions, seeds, growth.
    pub divide_ms: f64,
    /// Merge on the votes and on the bird's-eye plane.
    pub merge_ms: f64,
    /// Back to points, instances, boxes.
    pub labels_ms: f64,
}

impl StageTimes {
    /// All stages together.
    pub fn total_ms(&self) -> f64 {
        self.projection_ms + self.mask_ms + self.divide_ms + self.merge_ms + self.labels_ms
    }
}
