//! The methods in the tables, ours and others, behind one call.

use std::collections::BTreeMap;
use std::sync::Arc;

use divmerge::Taxonomy;
use divmerge::cloud::{Detection, UprightBox};
use divmerge::cluster::{self, ClusterParams, MethodInput, ObjectPixels};
use divmerge::comparison::methods::{
    Alpine, Boxes, Dbscan, DepthClustering, Euclidean, OnePerClass, ScanLineRun, Supervoxel,
    majority_class, without_classes,
};
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::pipeline::{self, Config};
use divmerge::range_image::{ProjectionParams, RangeImage};
use divmerge::semantics::{Corrections, MaskSource, object_mask};

use crate::frames::{Frame, classes};

/// A method under the name that the tables give it.
pub struct Method {
    /// Its name, as Markdown.
    pub name: &'static str,
    how: How,
}

enum How {
    Ours(Box<Config>),
    /// The same without the confidence of the classes.
    Unsure(Box<Config>),
    /// The same with every class a family of its own.
    WithoutFamilies(Box<Config>),
    /// Clusters objects of all classes alike, and takes shadowed points back by range in 5 x 5.
    Classless(Arc<dyn cluster::Method>),
    /// A preset whose points keep the class that was given, whatever their instance's.
    OwnClass(Box<Config>),
    /// The true objects, on the points that are given as things.
    Truth,
    /// Cut out by upright boxes around the true objects of so many points and more.
    TrueBoxes(u64),
}

/// What a method says of N points.
pub struct Found {
    /// N: class number.
    pub class: Vec<u16>,
    /// N: instance from 1, or 0.
    pub instance: Vec<u32>,
}

impl Method {
    /// One of our presets, or a change of one.
    pub fn ours(name: &'static str, config: Config) -> Self {
        Method { name, how: How::Ours(Box::new(config)) }
    }

    /// Another method, on the same classes as they are given and with the same back-projection.
    fn theirs(name: &'static str, other: impl cluster::Method + 'static) -> Self {
        let other_method = Some(Arc::new(other) as _);
        Method::ours(name, Config { other_method, smoothing: None, ..Config::best() })
    }

    /// Labels a frame.
    pub fn run(&self, frame: &Frame) -> Found {
        match &self.how {
            How::Ours(config) => ours(frame, config),
            How::Unsure(config) => {
                let cloud = frame.cloud.clone().with(|columns| columns.confidence = None);
                let cloud = cloud.expect("fewer columns");
                ours(&Frame { cloud, ..frame.clone() }, config)
            }
            How::WithoutFamilies(config) => {
                by(frame, config, &Taxonomy::semantic_kitti().without_families())
            }
            How::Classless(other) => classes_alike(frame, other.as_ref()),
            How::OwnClass(config) => {
                let class = classes(frame.cloud.class.as_deref().unwrap_or_default());
                Found { class, ..ours(frame, config) }
            }
            How::Truth => truth(frame),
            How::TrueBoxes(points) => in_true_boxes(frame, *points),
        }
    }
}

/// The true instances with the classes that were given; the class of an instance is the most
/// frequent.
fn truth(frame: &Frame) -> Found {
    let taxonomy = Taxonomy::semantic_kitti();
    let given = classes(frame.cloud.class.as_deref().unwrap_or_default());
    let is_thing = |class: u16| taxonomy.classes()[usize::from(class)].is_thing;
    let instance = (0..given.len()).map(|point| {
        let is_object = is_thing(given[point]) && is_thing(frame.true_class[point]);
        if is_object { frame.true_id[point] } else { 0 }
    });
    let instance: Vec<u32> = instance.collect();
    Found { class: majority_class(&instance, &given), instance }
}

fn ours(frame: &Frame, config: &Config) -> Found {
    by(frame, config, &Taxonomy::semantic_kitti())
}

fn by(frame: &Frame, config: &Config, taxonomy: &Taxonomy) -> Found {
    let stages = pipeline::run(&frame.cloud, MaskSource::Classes(taxonomy), config);
    Found { class: classes(&stages.labels.semantic), instance: stages.labels.instance }
}

/// The given things, cut out by boxes around the true objects of `least` points and more.
fn in_true_boxes(frame: &Frame, least: u64) -> Found {
    let taxonomy = Taxonomy::semantic_kitti();
    let mut objects: BTreeMap<(u16, u32), Vec<u32>> = BTreeMap::new();
    for (point, object) in (0..).zip(frame.true_class.iter().copied().zip(frame.true_id.clone())) {
        if taxonomy.classes()[usize::from(object.0)].is_thing {
            objects.entry(object).or_default().push(point);
        }
    }
    let counted = objects.into_iter().filter(|(_, points)| points.len() as u64 >= least);
    let detections = counted.filter_map(|((class, _), points)| {
        let bounds = UprightBox::around(&frame.cloud, &points)?;
        Some(Detection { bounds, class: Some(class), score: 1.0 })
    });
    let detections: Vec<Detection> = detections.collect();
    let other_method = Some(Arc::new(Boxes::default()) as _);
    let config = Config { other_method, smoothing: None, ..Config::best() };
    let mask = MaskSource::Classes(&taxonomy);
    let stages = pipeline::run_with(&frame.cloud, mask, &detections, &config);
    Found { class: classes(&stages.labels.semantic), instance: stages.labels.instance }
}

fn classes_alike(frame: &Frame, other: &dyn cluster::Method) -> Found {
    let (taxonomy, params) = (Taxonomy::semantic_kitti(), ClusterParams::paper());
    let image = RangeImage::new(&frame.cloud, &ProjectionParams::default());
    let given =
        object_mask(&frame.cloud, &image, MaskSource::Classes(&taxonomy), Corrections::default());
    let mask = without_classes(&given);
    let segmentation = other.segment(&MethodInput {
        cloud: &frame.cloud,
        image: &image,
        mask: &mask,
        objects: &ObjectPixels::new(&frame.cloud, &image, &mask, &params),
        detections: &[],
        back_projection: params.back_projection,
    });
    let instance = segmentation.of_point.expect("other methods segment points");
    Found { class: majority_class(&instance, &given.class), instance }
}

/// Preset `best`.
pub fn best() -> Method {
    Method::ours("`best`", Config::best())
}

/// Preset `best` and what it is without each of the parts that bear wrong classes; the whole comes
/// first.
pub fn parts() -> Vec<Method> {
    let best = || Box::new(Config::best());
    let as_given = Config { smoothing: None, ..Config::best() };
    let without = |name, how| Method { name, how };
    vec![
        Method::ours("`best`", Config::best()),
        without("without confidence", How::Unsure(best())),
        Method::ours("without smoothing", as_given),
        without("without families", How::WithoutFamilies(best())),
        without("without the vote", How::OwnClass(best())),
        true_instances(),
    ]
}

/// Preset `paper`.
pub fn paper() -> Method {
    Method::ours("`paper`", Config::paper())
}

/// DBSCAN(0.5, 5).
pub fn dbscan() -> Method {
    Method::theirs("DBSCAN 0.5 m, 5", Dbscan::default())
}

/// ALPINE, k = 32, with splitting.
pub fn alpine() -> Method {
    Method::theirs("ALPINE", Alpine::new(&Taxonomy::semantic_kitti()))
}

/// Connected components within half a metre.
pub fn euclidean() -> Method {
    Method::theirs("Euclidean 0.5 m", Euclidean::default())
}

/// The same of all objects, whatever their class.
pub fn euclidean_classless() -> Method {
    classless("Euclidean 0.5 m, classes alike", Euclidean::default())
}

/// The true instances: as far as anything can come with the classes that were given.
pub fn true_instances() -> Method {
    Method { name: "true instances", how: How::Truth }
}

/// Cut out by boxes around the true objects that count in a score. What is left of the others stays
/// together, as one spurious object of each class.
pub fn true_boxes() -> Method {
    Method { name: "boxes around the true objects", how: How::TrueBoxes(MIN_POINTS) }
}

/// Cut out by boxes around all true objects: as far as boxes can come.
pub fn all_true_boxes() -> Method {
    Method { name: "boxes around all true objects", how: How::TrueBoxes(1) }
}

/// Preset `paper`, whose points keep the class that was given.
pub fn paper_own_class() -> Method {
    Method { name: "`paper`, classes as given", how: How::OwnClass(Box::new(Config::paper())) }
}

fn classless(name: &'static str, other: impl cluster::Method + 'static) -> Method {
    Method { name, how: How::Classless(Arc::new(other)) }
}

/// All of them: ours, the others class by class, and four as the pipelines of 2021 were released,
/// which cluster objects of all classes alike and take shadowed points back by range in 5 x 5.
pub fn all() -> Vec<Method> {
    let unsplit = Alpine { margin: f64::INFINITY, ..Alpine::new(&Taxonomy::semantic_kitti()) };
    let depth = DepthClustering::default();
    let run = ScanLineRun::default();
    vec![
        best(),
        paper(),
        Method::ours("`authors`", Config::authors()),
        alpine(),
        Method::theirs("ALPINE without splitting", unsplit),
        euclidean(),
        Method::theirs("Euclidean 1 m", Euclidean { reach: 1.0 }),
        dbscan(),
        Method::theirs("depth clustering", depth),
        Method::theirs("scan-line run", run),
        Method::theirs("scan-line run, 4 beams up", ScanLineRun { beams: 4, ..run }),
        Method::theirs("supervoxel", Supervoxel::default()),
        true_boxes(),
        all_true_boxes(),
        Method::theirs("one per class", OnePerClass),
        euclidean_classless(),
        classless("depth clustering, classes alike", depth),
        classless("scan-line run, classes alike", run),
        classless("supervoxel, classes alike", Supervoxel::default()),
    ]
}
