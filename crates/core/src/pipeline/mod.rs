//! The whole method on one page: a cloud and a mask in, every intermediate out.

mod appearance;
pub mod overrides;

use std::collections::BTreeMap;
use std::time::Instant;

use serde::Serialize;

use crate::cloud::point_cloud::PointCloud;
use crate::cloud::{Instance, PointLabels, Reason, UprightBox};
use crate::cluster::back_projection::label_source;
use crate::cluster::{self, ClusterParams, Components, Join, Merge, ObjectPixels, Votes};
use crate::geometry::statistics::most_voted;
use crate::methods::{AnyBaseline, Baseline, Detection, View};
use crate::range_image::{ProjectionParams, RangeImage, RowsFrom, Wrap};
use crate::semantics::{MaskSource, ObjectMask, Smoothing, object_mask};

use appearance::Appearance;
pub use overrides::{BirdsEyeMerge, Overrides, Preset};

/// Every parameter of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Config {
    /// Name of the preset these parameters started from.
    pub preset: &'static str,
    /// From cloud to range image.
    pub projection: ProjectionParams,
    /// How given classes are corrected by those around them; `None`: taken as they are.
    pub smoothing: Option<Smoothing>,
    /// Divide, merge and what follows.
    pub cluster: ClusterParams,
    /// Another method in place of divide, merge and what follows. Projection, mask, back-projection
    /// and minimum size stay.
    pub baseline: Option<AnyBaseline>,
}

impl Config {
    /// Preset `paper`: ALGORITHM to the letter.
    pub fn paper() -> Self {
        Config {
            preset: "paper",
            projection: ProjectionParams { wrap: Wrap::Always, ..ProjectionParams::default() },
            smoothing: None,
            cluster: ClusterParams::paper(),
            baseline: None,
        }
    }

    /// Preset `authors`: what the released C++ does, less its memory errors. Clouds that are not
    /// organised become its 64 x 2048 image of +3 to -25 degrees.
    pub fn authors() -> Self {
        Config {
            preset: "authors",
            projection: ProjectionParams {
                rows_from: RowsFrom::UniformElevation,
                rows: Some(64),
                columns: Some(2048),
                field_of_view: Some((3_f64.to_radians(), -25_f64.to_radians())),
                wrap: Wrap::Never,
            },
            smoothing: None,
            cluster: ClusterParams::authors(),
            baseline: None,
        }
    }

    /// Name of the method that cuts objects into instances, as at the command line.
    pub fn method_name(&self) -> &'static str {
        self.baseline.as_ref().map_or("divide-and-merge", AnyBaseline::name)
    }

    /// The parameters in a few words, as in `preset best` or `euclidean in place of divide and
    /// merge, preset best`.
    pub fn describe(&self) -> String {
        match &self.baseline {
            None => format!("preset {}", self.preset),
            Some(other) => {
                format!("{} in place of divide and merge, preset {}", other.name(), self.preset)
            }
        }
    }

    /// Preset `best`: ours, the default.
    pub fn best() -> Self {
        Config {
            preset: "best",
            projection: ProjectionParams::default(),
            smoothing: Some(Smoothing::default()),
            cluster: ClusterParams::best(),
            baseline: None,
        }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::best()
    }
}

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
    /// For each instance of the merge step its instance after the bird's-eye merge.
    pub birds_eye: Vec<u32>,
    /// Joins of fragments by size, or of pieces by gaps, in their order (preset `best`); pieces are
    /// the merge step's instances.
    pub joins: Vec<Join>,
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

/// Clusters one cloud.
pub fn run(cloud: &PointCloud, mask: MaskSource, config: &Config) -> Stages {
    run_with(cloud, mask, &[], config)
}

/// Clusters one cloud of which a detector has said something, for methods that want to know.
pub fn run_with(
    cloud: &PointCloud,
    mask: MaskSource,
    detections: &[Detection],
    config: &Config,
) -> Stages {
    let params = &config.cluster;
    let mut clock = Clock::start();

    let image = RangeImage::new(cloud, &config.projection);
    let projection_ms = clock.lap();

    let mask_of = mask;
    let mask = object_mask(cloud, &image, mask_of, config.smoothing.as_ref());
    let mask_ms = clock.lap();

    let back_projection = params.back_projection;
    let view = View { cloud, image: &image, mask: &mask, back_projection, detections };
    let of_point = config.baseline.as_ref().map(|baseline| baseline.instances(view));
    let baseline_ms = clock.lap();
    let objects = ObjectPixels::new(cloud, &image, &mask, params);
    let cut = match of_point {
        None => divide_and_merge(&objects, &mask, params, &mut clock),
        Some(of_point) => {
            Cut { divide_ms: baseline_ms, ..one_component_each(of_point, &image, &objects) }
        }
    };

    let pixels = instance_pixels(&cut, params);
    let mut labels = label_points(cloud, &image, &mask, &objects, &cut, &pixels, params);
    let members = members(&objects.points, &labels.instance, pixels.pixels.len());
    let mut instances =
        describe(cloud, &mask, &members, &cut.components, &pixels, mask_of, &mut labels);
    if !mask.has_classes() {
        liken(cloud, &image, &objects, &members, &pixels, &labels, &mut instances);
    }
    let labels_ms = clock.lap();

    let Cut { seeds, components, votes, merge, birds_eye, joins, divide_ms, merge_ms, .. } = cut;
    Stages {
        image,
        mask,
        objects,
        seeds,
        components,
        votes,
        merge,
        birds_eye,
        joins,
        labels,
        instances,
        times: StageTimes { projection_ms, mask_ms, divide_ms, merge_ms, labels_ms },
    }
}

/// Objects cut into instances.
#[derive(Default)]
struct Cut {
    seeds: Vec<u32>,
    components: Components,
    votes: Votes,
    merge: Merge,
    birds_eye: Vec<u32>,
    joins: Vec<Join>,
    /// N: the component of each point, where a method says it of points; else that of its pixel
    /// counts.
    of_point: Option<Vec<u32>>,
    divide_ms: f64,
    merge_ms: f64,
}

/// The paper's method, and what follows it.
fn divide_and_merge(
    objects: &ObjectPixels,
    mask: &ObjectMask,
    params: &ClusterParams,
    clock: &mut Clock,
) -> Cut {
    let seeds = cluster::seeds(objects, params);
    let (components, votes) = cluster::divide(objects, &seeds, params); // Alg. 1
    let divide_ms = clock.lap();

    let merge = cluster::merge(&votes, params); // Alg. 2
    let gaps = params.gaps.filter(|_| !mask.has_classes());
    let (birds_eye, joins) = match (gaps, &params.fragments) {
        (Some(gaps), _) => cluster::join_by_gaps(objects, &components, &merge, &gaps),
        (None, None) => {
            (cluster::birds_eye(objects, &components, &merge, params.birds_eye), vec![])
        } // III.E
        (None, Some(by_size)) => {
            let fragments = cluster::fragments(objects, &components, &merge, mask);
            cluster::assemble(&fragments, by_size)
        }
    };
    let merge_ms = clock.lap();
    let of_point = None;
    Cut { seeds, components, votes, merge, birds_eye, joins, of_point, divide_ms, merge_ms }
}

/// Another method's instances of N points, which become components and instances of the merge step
/// one by one.
fn one_component_each(of_point: Vec<u32>, image: &RangeImage, objects: &ObjectPixels) -> Cut {
    let count = of_point.iter().copied().max().unwrap_or(0);
    let point_of = |&pixel: &u32| image.point_of_pixel.values()[pixel as usize] as usize;
    let label = objects.pixel.iter().map(|pixel| of_point[point_of(pixel)]).collect();
    let each: Vec<u32> = (1..=count).collect();
    Cut {
        components: Components { label, count, grown: Vec::new() },
        votes: Votes { components: count, pairs: Vec::new() },
        merge: Merge { instance_of_component: each.clone(), count, steps: Vec::new() },
        birds_eye: each,
        of_point: Some(of_point),
        ..Cut::default()
    }
}

struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Clock(Instant::now())
    }

    fn lap(&mut self) -> f64 {
        let lap = self.0.elapsed().as_secs_f64() * 1e3;
        self.0 = Instant::now();
        lap
    }
}

/// The final instance of each component and object pixel, or why it has none.
struct InstancePixels {
    /// m + 1: final instance of each component from 1, or 0; component k at k.
    of_component: Vec<u32>,
    /// M: final instance from 1, or 0.
    instance: Vec<u32>,
    /// Pixels of each final instance; instance k at k - 1.
    pixels: Vec<u32>,
}

impl InstancePixels {
    /// Why points of a component have no instance.
    fn reason(&self, component: u32) -> Reason {
        match (component, self.of_component[component as usize]) {
            (0, _) => Reason::Unreached,
            (_, 0) => Reason::TooSmall,
            _ => Reason::None,
        }
    }
}

/// Instances with fewer pixels than the minimum are dropped and the others numbered from 1, in the
/// order of the merge.
fn instance_pixels(cut: &Cut, params: &ClusterParams) -> InstancePixels {
    let (birds_eye, components) = (&cut.birds_eye, &cut.components);
    let of_merge = cut.merge.instance_of_component.iter();
    let merged: Vec<u32> =
        std::iter::once(0).chain(of_merge.map(|&merged| birds_eye[merged as usize - 1])).collect();
    let count = birds_eye.iter().copied().max().unwrap_or(0) as usize;
    let mut sizes = vec![0_u32; count + 1];
    for &label in &components.label {
        sizes[merged[label as usize] as usize] += 1;
    }
    // A method that looks at points may have found one of whose points none is seen in the image.
    let mut is_there: Vec<bool> = sizes.iter().map(|&size| size > 0).collect();
    for &label in cut.of_point.iter().flatten() {
        is_there[merged[label as usize] as usize] = true;
    }
    let mut number = vec![0_u32; count + 1];
    let mut pixels = Vec::new();
    for instance in 1..=count {
        if is_there[instance] && sizes[instance] as usize >= params.min_pixels {
            pixels.push(sizes[instance]);
            number[instance] = pixels.len() as u32;
        }
    }
    let of_component: Vec<u32> = merged.iter().map(|&merged| number[merged as usize]).collect();
    let of_label = |&label: &u32| of_component[label as usize];
    InstancePixels {
        instance: components.label.iter().map(of_label).collect(),
        of_component,
        pixels,
    }
}

/// Every point gets the instance of its pixel; a shadowed one that of a pixel of its class nearby;
/// all others a reason.
fn label_points(
    cloud: &PointCloud,
    image: &RangeImage,
    mask: &ObjectMask,
    objects: &ObjectPixels,
    cut: &Cut,
    pixels: &InstancePixels,
    params: &ClusterParams,
) -> PointLabels {
    let mut labels = PointLabels {
        instance: vec![0; cloud.len()],
        component: vec![0; cloud.len()],
        semantic: cloud.class.clone().unwrap_or_else(|| vec![0; cloud.len()]),
        reason: mask.reason.clone(),
    };
    for &(point, id) in &mask.corrected {
        labels.semantic[point as usize] = id;
    }
    let source = |point| label_source(cloud, image, mask, objects, point, params.back_projection);
    for point in objects.points.iter().map(|&point| point as usize) {
        let component = match &cut.of_point {
            Some(of_point) => Some(of_point[point]),
            None => source(point).map(|object| cut.components.label[object]),
        };
        let Some(component) = component else {
            labels.reason[point] = Reason::Shadowed;
            continue;
        };
        let instance = pixels.of_component[component as usize];
        labels.instance[point] = instance;
        labels.reason[point] = pixels.reason(component);
        if instance != 0 {
            labels.component[point] = component;
        }
    }
    labels
}

/// The instances with class, box and counts; the points of an instance take its class.
fn describe(
    cloud: &PointCloud,
    mask: &ObjectMask,
    (points_of, start): &Members,
    components: &Components,
    pixels: &InstancePixels,
    source: MaskSource,
    labels: &mut PointLabels,
) -> Vec<Instance> {
    let component_counts = component_counts(components, pixels);
    let weights = class_weights(cloud, mask);
    let mut instances = Vec::with_capacity(pixels.pixels.len());
    for id in 1..=pixels.pixels.len() as u32 {
        let points = &points_of[start[id as usize - 1]..start[id as usize]];
        let Some(bounds) = UprightBox::around(cloud, points) else {
            continue;
        };
        let (class, semantic) = majority(points, &mask.class, &labels.semantic, weights.as_deref());
        let confidence = weights.as_ref().map(|weights| {
            let own = points.iter().filter(|&&point| mask.class[point as usize] == class);
            own.map(|&point| f64::from(weights[point as usize])).sum::<f64>() / points.len() as f64
        });
        for &point in points {
            labels.semantic[point as usize] = semantic;
        }
        instances.push(Instance {
            id,
            semantic,
            class_name: match source {
                MaskSource::Classes(taxonomy) => {
                    taxonomy.classes()[usize::from(class)].name.clone()
                }
                _ => String::new(),
            },
            confidence,
            likeness: None,
            points: points.len() as u32,
            pixels: pixels.pixels[id as usize - 1],
            components: component_counts[id as usize - 1],
            bounds,
        });
    }
    instances
}

/// Says what instances without a class look like.
fn liken(
    cloud: &PointCloud,
    image: &RangeImage,
    objects: &ObjectPixels,
    (points_of, start): &Members,
    pixels: &InstancePixels,
    labels: &PointLabels,
    instances: &mut [Instance],
) {
    let mut appearance = Appearance::new(cloud, &labels.reason, image, objects, &pixels.instance);
    for instance in instances {
        let points = &points_of[start[instance.id as usize - 1]..start[instance.id as usize]];
        let likeness = appearance.likeness(cloud, instance.id, points, &instance.bounds);
        instance.likeness = Some(likeness);
    }
}

/// The points of all instances, instance after instance; those of instance k from start\[k - 1\] to
/// start\[k\].
type Members = (Vec<u32>, Vec<usize>);

/// Of the object points those of each instance.
fn members(points: &[u32], instance: &[u32], count: usize) -> Members {
    let labelled =
        || points.iter().map(|&p| (p, instance[p as usize] as usize)).filter(|&(_, id)| id != 0);
    let mut start = vec![0; count + 1];
    for (_, id) in labelled() {
        start[id] += 1;
    }
    for id in 1..=count {
        start[id] += start[id - 1];
    }
    let mut next = start.clone();
    let mut points = vec![0; start[count]];
    for (point, id) in labelled() {
        let place = &mut next[id - 1];
        points[*place] = point;
        *place += 1;
    }
    (points, start)
}

/// Number of components in each instance.
fn component_counts(components: &Components, pixels: &InstancePixels) -> Vec<u32> {
    let mut seen = vec![false; components.count as usize + 1];
    let mut counts = vec![0; pixels.pixels.len()];
    for (&label, &instance) in components.label.iter().zip(&pixels.instance) {
        if instance != 0 && !std::mem::replace(&mut seen[label as usize], true) {
            counts[instance as usize - 1] += 1;
        }
    }
    counts
}

/// What each of N points counts in the vote on the class of its instance: the probability of its
/// class, so what is left of that of its first one where neighbours corrected it. `None`: all count
/// alike.
fn class_weights(cloud: &PointCloud, mask: &ObjectMask) -> Option<Vec<f32>> {
    let mut weights = cloud.confidence.clone()?;
    for &(point, _) in &mask.corrected {
        let weight = &mut weights[point as usize];
        *weight = 1.0 - *weight;
    }
    Some(weights)
}

/// The class of some points with most votes, and within it the raw id with most. Ties go to the
/// lower number, and where no point has any weight, all count alike.
fn majority(points: &[u32], class: &[u16], raw: &[u16], weights: Option<&[f32]>) -> (u16, u16) {
    let ids = |&p: &u32| (class[p as usize], raw[p as usize]);
    if let [first, rest @ ..] = points
        && rest.iter().all(|point| ids(point) == ids(first))
    {
        return ids(first);
    }
    let weighed = |weight: &dyn Fn(u32) -> f64| {
        let mut votes: BTreeMap<(u16, u16), f64> = BTreeMap::new();
        for point in points {
            *votes.entry(ids(point)).or_default() += weight(*point);
        }
        votes
    };
    let votes = match weights {
        Some(weights) => weighed(&|point| f64::from(weights[point as usize])),
        None => weighed(&|_| 1.0),
    };
    let votes = match votes.values().all(|&votes| votes == 0.0) {
        true => weighed(&|_| 1.0),
        false => votes,
    };
    let mut of_class: BTreeMap<u16, f64> = BTreeMap::new();
    for (&(class, _), votes) in &votes {
        *of_class.entry(class).or_default() += votes;
    }
    let class = most_voted(of_class.into_iter()).unwrap_or(0);
    let ids = votes.into_iter().filter(|(id, _)| id.0 == class);
    (class, most_voted(ids.map(|(id, votes)| (id.1, votes))).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surer_points_decide_and_ties_go_to_the_lower() {
        let (class, raw) = ([1, 1, 2, 2, 2], [10, 10, 30, 30, 254]);
        let points = [0, 1, 2, 3, 4];
        assert_eq!(majority(&points, &class, &raw, None), (2, 30));
        assert_eq!(majority(&points, &class, &raw, Some(&[0.9, 0.9, 0.3, 0.3, 0.4])), (1, 10));
        assert_eq!(majority(&points, &class, &raw, Some(&[0.1, 0.1, 0.1, 0.1, 0.4])), (2, 254));
        assert_eq!(majority(&points[1..3], &class, &raw, None), (1, 10));
        assert_eq!(majority(&points, &class, &raw, Some(&[0.0; 5])), (2, 30));
        assert_eq!(majority(&points[..2], &class, &raw, None), (1, 10));
        assert_eq!(majority(&[], &class, &raw, None), (0, 0));
    }

    #[test]
    fn a_corrected_point_counts_what_its_first_class_left() {
        let cloud = PointCloud::new(vec![1.0, 2.0], vec![0.0; 2], vec![0.0; 2]).unwrap();
        let cloud = cloud.with(|columns| columns.confidence = Some(vec![0.9, 0.4])).unwrap();
        let mask = ObjectMask { corrected: vec![(1, 10)], ..ObjectMask::default() };
        assert_eq!(class_weights(&cloud, &mask), Some(vec![0.9, 0.6]));
        let given = PointCloud::default();
        assert_eq!(class_weights(&given, &mask), None);
    }
}
