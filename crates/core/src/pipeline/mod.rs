//! The whole method on one page: a cloud and a mask in, every intermediate out.

mod appearance;
mod class_votes;
mod config;
mod instances;
mod labels;
pub mod overrides;
mod segment_vote;
mod stages;
mod vehicle_strips;

use std::time::{Duration, Instant};

use crate::cloud::Detection;
use crate::cloud::point_cloud::PointCloud;
use crate::cluster::params::TreeMerge;
use crate::cluster::{
    CutTree, DivideAndMerge, MergeBySize, Method, MethodInput, ObjectPixels, Segmentation,
};
use crate::range_image::RangeImage;
use crate::semantics::{Corrections, MaskSource, ObjectMask, object_mask};
use instances::describe;
use labels::{InstancePixels, label_points};

pub use config::Config;
pub use overrides::{BirdsEyeMerge, Overrides, Preset};
pub use segment_vote::SegmentVote;
pub use stages::{StageTimes, Stages};
pub use vehicle_strips::VehicleStrips;

/// Clusters one cloud.
pub fn run(cloud: &PointCloud, mask: MaskSource, config: &Config) -> Stages {
    run_with(cloud, mask, &[], config)
}

/// Clusters one cloud in which a detector has found something, for methods that use it.
///
/// `source` says where the object mask comes from. The same cloud and parameters give the same
/// stages, but for their times.
pub fn run_with(
    cloud: &PointCloud,
    source: MaskSource,
    detections: &[Detection],
    config: &Config,
) -> Stages {
    let params = &config.cluster;
    let mut times = StageTimes::default();

    let image = timed(&mut times.projection_ms, || RangeImage::new(cloud, &config.projection));
    let mask = timed(&mut times.mask_ms, || corrected_mask(cloud, &image, source, config));
    let objects = timed(&mut times.divide_ms, || match tree_to_cut(config, &mask) {
        Some(_) => ObjectPixels::without_condition(cloud, &image, &mask, params),
        None => ObjectPixels::new(cloud, &image, &mask, params),
    });
    let input = MethodInput::new(cloud, &image, &mask, &objects, params).with(detections);
    let segmentation = segment(&input, config, &mut times);

    let labels_ms = &mut times.labels_ms;
    let pixels = timed(labels_ms, || InstancePixels::new(&segmentation, params.min_pixels));
    let mut labels = timed(labels_ms, || label_points(&input, &segmentation, &pixels));
    let described = (source, &segmentation);
    let instances = timed(labels_ms, || describe(&input, described, &pixels, &mut labels));

    let Segmentation { seeds, components, votes, merge, post_merge, .. } = segmentation;
    let merged_pixels = pixels.before_drop;
    Stages {
        image,
        mask,
        objects,
        seeds,
        components,
        votes,
        merge,
        post_merge,
        merged_pixels,
        labels,
        instances,
        times,
    }
}

/// The object mask, with its classes corrected as the parameters ask for.
fn corrected_mask(
    cloud: &PointCloud,
    image: &RangeImage,
    source: MaskSource,
    config: &Config,
) -> ObjectMask {
    let (smoothing, bleed) = (config.smoothing.as_ref(), config.bleed.as_ref());
    let mut mask = object_mask(cloud, image, source, Corrections { smoothing, bleed });
    if let (Some(vote), Some(taxonomy)) = (&config.segment_vote, source.taxonomy())
        && mask.bleeds
    {
        vote.correct((cloud, image), taxonomy, &config.cluster, &mut mask);
    }
    if let (Some(strips), Some(taxonomy)) = (&config.vehicle_strips, source.taxonomy())
        && mask.bleeds
    {
        let instances = instances_of(cloud, image, &mask, config);
        strips.correct((cloud, image), taxonomy, &instances, &mut mask);
    }
    mask
}

/// N: the instances that the objects of a mask are cut into.
fn instances_of(
    cloud: &PointCloud,
    image: &RangeImage,
    mask: &ObjectMask,
    config: &Config,
) -> Vec<u32> {
    let params = &config.cluster;
    let objects = ObjectPixels::new(cloud, image, mask, params);
    let input = MethodInput::new(cloud, image, mask, &objects, params);
    let segmentation = segment(&input, config, &mut StageTimes::default());
    let pixels = InstancePixels::new(&segmentation, params.min_pixels);
    label_points(&input, &segmentation, &pixels).instance
}

/// Segments the objects by the method that the parameters ask for, and adds the times.
///
/// Another method comes first. Objects without classes are cut from the tree of merges and those
/// with classes are merged by size, where the parameters have that; else the method is divide and
/// merge.
fn segment(input: &MethodInput, config: &Config, times: &mut StageTimes) -> Segmentation {
    let params = &config.cluster;
    let tree = tree_to_cut(config, input.mask);
    let start = Instant::now();
    let segmentation = match (&config.other_method, tree, &params.fragments) {
        (Some(other), ..) => other.segment(input),
        (None, Some(tree), _) => CutTree { params, tree }.segment(input),
        (None, None, Some(merge)) => MergeBySize { params, merge }.segment(input),
        (None, None, None) => DivideAndMerge { params }.segment(input),
    };
    let end = Instant::now();
    let divided_at = segmentation.divided_at.unwrap_or(end);
    times.divide_ms += milliseconds(divided_at - start);
    times.merge_ms += milliseconds(end - divided_at);
    segmentation
}

/// The parameters of the tree of merges, where objects are cut from one.
fn tree_to_cut<'a>(config: &'a Config, mask: &ObjectMask) -> Option<&'a TreeMerge> {
    let is_ours = config.other_method.is_none();
    config.cluster.tree.as_ref().filter(|_| is_ours && !mask.has_classes())
}

/// Does a step, and adds the milliseconds that it took.
fn timed<T>(total_ms: &mut f64, step: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = step();
    *total_ms += milliseconds(start.elapsed());
    result
}

fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
