//! Clustering methods: one trait, behind which ours and those of others are peers.

use std::fmt::Debug;
use std::sync::Arc;
use std::time::Instant;

use super::divide_and_merge::assigner::Merge;
use super::divide_and_merge::divide::Components;
use super::divide_and_merge::votes::Votes;
use super::objects::ObjectPixels;
use super::params::{BackProjection, ClusterParams};
use super::post_merge::PostMerge;
use crate::cloud::point_cloud::PointCloud;
use crate::cloud::{Detection, Reason};
use crate::range_image::RangeImage;
use crate::semantics::ObjectMask;
use crate::semantics::ground::GroundHeights;

/// A method that segments objects into instances.
pub trait Method: Debug + Send + Sync {
    /// Its name, as at the command line and in the metadata of the output.
    fn name(&self) -> &'static str;

    /// Its parameters, as in the metadata of the output.
    fn parameters(&self) -> serde_json::Value;

    /// The JSON schema of its parameters, without references; by default none can be set.
    fn schema(&self) -> serde_json::Value {
        serde_json::Value::Null
    }

    /// The same method with other parameters; `None` if they do not fit it.
    fn with_parameters(&self, _parameters: serde_json::Value) -> Option<Arc<dyn Method>> {
        None
    }

    /// The instances of a cloud. The same input gives the same segmentation.
    fn segment(&self, input: &MethodInput) -> Segmentation;
}

/// Methods are equal if they have one name and the same parameters.
impl PartialEq for dyn Method {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name() && self.parameters() == other.parameters()
    }
}

/// What a method sees of a cloud of N points with M object pixels.
#[derive(Debug, Clone, Copy)]
pub struct MethodInput<'a> {
    /// The points.
    pub cloud: &'a PointCloud,
    /// Their range image.
    pub image: &'a RangeImage,
    /// Which of them are objects, and of which class.
    pub mask: &'a ObjectMask,
    /// The object pixels.
    pub objects: &'a ObjectPixels,
    /// What a detector found in the cloud.
    pub detections: &'a [Detection],
    /// Where shadowed points look for a label.
    pub back_projection: BackProjection,
}

impl<'a> MethodInput<'a> {
    /// What a method sees where there is no detector.
    pub fn new(
        cloud: &'a PointCloud,
        image: &'a RangeImage,
        mask: &'a ObjectMask,
        objects: &'a ObjectPixels,
        params: &ClusterParams,
    ) -> Self {
        let back_projection = params.back_projection;
        MethodInput { cloud, image, mask, objects, detections: &[], back_projection }
    }

    /// The same with what a detector found.
    pub fn with(self, detections: &'a [Detection]) -> Self {
        MethodInput { detections, ..self }
    }
}

/// Objects segmented into instances, with every intermediate.
///
/// A method other than divide and merge has its instances as components, and neither seeds nor
/// votes.
#[derive(Debug, Clone, PartialEq)]
pub struct Segmentation {
    /// Seeds as object pixel numbers; seed k carries label k + 1.
    pub seeds: Vec<u32>,
    /// The components.
    pub components: Components,
    /// The votes on their borders.
    pub votes: Votes,
    /// The instances of the merge step.
    pub merge: Merge,
    /// The instances after the last merge.
    pub post_merge: PostMerge,
    /// N: the component of each point, where a method segments points; else that of its pixel
    /// counts.
    pub of_point: Option<Vec<u32>>,
    /// Why a pixel without a component has none.
    pub unlabelled: Reason,
    /// How high the ground lies, where the method asked for it.
    pub ground: Option<GroundHeights>,
    /// When the components were complete, if a merge follows.
    pub divided_at: Option<Instant>,
}

impl Default for Segmentation {
    fn default() -> Self {
        Segmentation {
            seeds: Vec::new(),
            components: Components::default(),
            votes: Votes::default(),
            merge: Merge::default(),
            post_merge: PostMerge::default(),
            of_point: None,
            unlabelled: Reason::Unreached,
            ground: None,
            divided_at: None,
        }
    }
}

impl Segmentation {
    /// The segmentation of a method that gives each of N points its instance from 1, or 0. Each
    /// instance stands as a component and as an instance of the merge step.
    pub fn of_points(instance: Vec<u32>, input: &MethodInput) -> Self {
        let count = instance.iter().copied().max().unwrap_or(0);
        let point_of = |&pixel: &u32| input.image.point_of_pixel.values()[pixel as usize] as usize;
        let label = input.objects.pixel.iter().map(|pixel| instance[point_of(pixel)]).collect();
        let each: Vec<u32> = (1..=count).collect();
        Segmentation {
            components: Components { label, count, grown: Vec::new() },
            votes: Votes { components: count, pairs: Vec::new() },
            merge: Merge { instance_of_component: each, count, steps: Vec::new() },
            post_merge: PostMerge::unchanged(count),
            of_point: Some(instance),
            ..Segmentation::default()
        }
    }
}
