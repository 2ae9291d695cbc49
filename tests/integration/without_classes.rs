//! Objects without classes: the cut of the tree of merges, and the coarse classes of instances.

use divmerge::annotate::{
    AnnotateConfig, Annotated, BoxedInstances, MessageTypes, Semantics, annotate_message,
};
use divmerge::cloud::{Body, CoarseClass, Reason};
use divmerge::comparison::methods::Euclidean;
use divmerge::datasets::drive::cloud_message;
use divmerge::datasets::semantic_kitti::{labelled_scans, read_labels, read_scan};
use divmerge::evaluate::things::thing_scores;
use divmerge::frames::EncodedCloud;
use divmerge::messages::boxes::marker_boxes;
use divmerge::messages::clouds::CloudFormat;
use divmerge::pipeline::{self, Config, Stages};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

use crate::shared_data::shared_data;

fn by_angle() -> Config {
    let mut config = Config::best();
    config.cluster.tree = None;
    config
}

fn run(cloud: &PointCloud, config: &Config) -> Stages {
    let ground = GroundParams::default();
    pipeline::run(cloud, MaskSource::NotGround(&ground), config)
}

/// A cloud with the ids of its things.
type Frame = (PointCloud, Vec<u32>);

/// The cut in place of the angle: no fewer things whole, and better associated, all frames
/// together.
fn assert_the_cut_is_better(frames: &[Frame]) {
    let sum = |config: &Config| {
        let scores = frames.iter().flat_map(|(cloud, things)| {
            thing_scores(things, &run(cloud, config).labels.instance, 50)
        });
        scores.fold((0, 0.0), |(whole, association), thing| {
            (whole + usize::from(thing.is_whole()), association + thing.association)
        })
    };
    let (cut, angle) = (sum(&Config::best()), sum(&by_angle()));
    assert!(cut.0 >= angle.0 && cut.1 > angle.1, "{cut:?}, by the angle {angle:?}");
}

#[test]
fn the_cut_is_better_than_the_angle_on_simulated_drives() {
    for (sensor, scene) in [(Sensor::Hdl64e, Scene::Street), (Sensor::Vlp16, Scene::Crowd)] {
        let frame = Drive::new(sensor, scene, 7).frame(3);
        let things = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
        assert_the_cut_is_better(&[(frame.cloud, things)]);
    }
}

#[test]
fn the_cut_is_better_than_the_angle_on_real_scans() {
    let Some(data) = shared_data() else { return };
    let scans = labelled_scans(&data.join("semantickitti")).expect("sequences");
    let every_eighth = scans.iter().step_by(8).map(|labelled| {
        let words = read_labels(&labelled.labels).expect("labels");
        let thing = |&word: &u32| if word >> 16 == 0 { 0 } else { word };
        (read_scan(&labelled.scan).expect("scan"), words.iter().map(thing).collect())
    });
    assert_the_cut_is_better(&every_eighth.collect::<Vec<_>>());
}

/// Every object point is of an instance of five points or more, or of too small a group.
#[test]
fn groups_of_a_few_points_are_no_instances() {
    let stages = run(&Drive::new(Sensor::Hdl64e, Scene::Hills, 3).frame(0).cloud, &Config::best());
    assert!(stages.instances.iter().all(|instance| instance.pixels >= 5));
    let scattered = stages.labels.counts()[Reason::Scattered as usize];
    assert!(scattered > 0 && scattered < stages.objects.points.len() as u64 / 20, "{scattered}");
    let tree = stages.post_merge.tree.as_ref().expect("no classes");
    let objects: Vec<u32> = tree.cut.chosen.clone();
    let unseen = |node: u32| tree.tree.path(node).skip(1).all(|above| !objects.contains(&above));
    assert!(!objects.is_empty() && objects.iter().all(|&node| unseen(node)));
}

/// The cut is of the cloud, not of the order of its points.
#[test]
fn the_same_objects_whatever_the_order_of_the_points() {
    let frame = Drive::new(Sensor::Vlp16, Scene::Street, 5).frame(1);
    let backwards: Vec<usize> = (0..frame.cloud.len()).rev().collect();
    let turned = frame.clone().reordered(&backwards);
    let [one, other] = [&frame.cloud, &turned.cloud].map(|cloud| run(cloud, &Config::best()));
    let sizes = |stages: &Stages| {
        let mut sizes: Vec<u32> = stages.instances.iter().map(|instance| instance.points).collect();
        sizes.sort_unstable();
        sizes
    };
    assert_eq!(sizes(&one), sizes(&other));
}

#[test]
fn with_classes_no_tree_is_cut_and_there_are_no_coarse_classes() {
    let cloud = Drive::new(Sensor::Vlp16, Scene::Parking, 4).frame(1).cloud;
    let taxonomy = Taxonomy::semantic_kitti();
    let mask = MaskSource::Classes(&taxonomy);
    let best = pipeline::run(&cloud, mask, &Config::best());
    let without = pipeline::run(&cloud, mask, &by_angle());
    assert!(best.post_merge.tree.is_none());
    assert_eq!(best.labels, without.labels);
    assert_eq!(best.instances, without.instances);
    assert!(best.instances.iter().all(|instance| instance.coarse_class.is_none()));
    assert!(best.instances.iter().all(|instance| instance.is_object()));
}

/// The coarse classes of the instances that hold most of a true car of 200 points or more.
#[test]
fn simulated_cars_look_like_vehicles() {
    let frame = Drive::new(Sensor::Hdl64e, Scene::Street, 11).frame(2);
    let stages = run(&frame.cloud, &Config::best());
    let classes = frame.cloud.class.as_ref().expect("classes");
    let mut points = vec![(0_u32, 0_u32); stages.instances.len() + 1];
    for (&instance, class) in stages.labels.instance.iter().zip(classes) {
        points[instance as usize].0 += 1;
        points[instance as usize].1 += u32::from([10, 252].contains(class));
    }
    let is_car =
        |id: u32| points[id as usize].0 >= 200 && 2 * points[id as usize].1 > points[id as usize].0;
    let cars: Vec<_> = stages.instances.iter().filter(|instance| is_car(instance.id)).collect();
    let is_vehicle = |class| matches!(class, CoarseClass::Body(Body::Car | Body::LargeVehicle));
    let alike = cars.iter().filter(|car| car.coarse_class.is_some_and(|of| is_vehicle(of.class)));
    let alike = alike.count();
    assert!(cars.len() > 5 && 10 * alike >= 8 * cars.len(), "{alike} of {}", cars.len());
    let title = cars.iter().map(|car| car.title()).find(|title| title.contains("vehicle-like"));
    assert!(title.is_some_and(|title| title.ends_with(" %")));
    for instance in &stages.instances {
        let found = instance.coarse_class.expect("no classes");
        assert!(found.probability > 0.0 && found.probability <= 1.0, "{found:?}");
    }
}

/// As many instances are objects as the cut chose nodes, and they come first: the rest is
/// background. That holds where small instances are dropped, too.
#[test]
fn what_the_cut_chose_is_an_object_and_nothing_else() {
    let cloud = Drive::new(Sensor::Vlp16, Scene::Street, 6).frame(2).cloud;
    for min_pixels in [0, 40] {
        let mut config = Config::best();
        config.cluster.min_pixels = min_pixels;
        let stages = run(&cloud, &config);
        let tree = stages.post_merge.tree.as_ref().expect("no classes");
        let nodes = tree.cut.chosen.iter().map(|&node| &tree.tree.nodes[node as usize]);
        let pixels: Vec<u32> =
            nodes.map(|node| node.len).filter(|&pixels| pixels as usize >= min_pixels).collect();
        let objects = stages.instances.iter().filter(|instance| instance.is_object());
        assert!(objects.map(|object| object.pixels).eq(pixels.iter().copied()));
        assert!(stages.instances[..pixels.len()].iter().all(|instance| instance.is_object()));
        assert!(stages.instances.len() > pixels.len() && !pixels.is_empty());
    }
}

/// Boxes are those of objects, or of all instances; with classes all instances are objects.
#[test]
fn background_has_boxes_on_request() {
    let frame = Drive::new(Sensor::Vlp16, Scene::Street, 6).frame(2);
    let mut message = Vec::new();
    cloud_message(&frame, &mut message).expect("a message");
    let encoded = EncodedCloud::of_message(CloudFormat::Ros2, message);
    let boxes = |semantics: Semantics, boxed: BoxedInstances| {
        let method = AnnotateConfig { semantics, ..AnnotateConfig::default() };
        let types = MessageTypes { boxed, ..MessageTypes::default() };
        let mut made = Annotated::default();
        let clustered = annotate_message(&encoded, &method, &types, &mut made).expect("annotated");
        let taxonomy = Taxonomy::semantic_kitti();
        let boxes = marker_boxes(&made.objects, true, &taxonomy).expect("markers");
        (boxes.expect("a stamp").detections.len(), clustered.stages.instances)
    };
    let (objects, instances) = boxes(Semantics::Ground, BoxedInstances::Objects);
    let (all, _) = boxes(Semantics::Ground, BoxedInstances::All);
    assert_eq!(objects, instances.iter().filter(|instance| instance.is_object()).count());
    assert_eq!(all, instances.len());
    assert!(0 < objects && objects < all);
    for boxed in [BoxedInstances::Objects, BoxedInstances::All] {
        let (boxes, instances) = boxes(Semantics::Auto, boxed);
        assert_eq!(boxes, instances.len());
    }
}

/// A method that cuts no tree tells nothing of bodies: shapes tell vehicles and people then.
#[test]
fn without_a_cut_shapes_tell_vehicles() {
    let cloud = Drive::new(Sensor::Hdl64e, Scene::Street, 11).frame(2).cloud;
    let other = std::sync::Arc::new(Euclidean { reach: 0.5 });
    let stages = run(&cloud, &Config { other_method: Some(other), ..Config::best() });
    let classes = stages.instances.iter().filter_map(|instance| instance.coarse_class);
    assert!(classes.clone().any(|found| found.class == CoarseClass::Body(Body::Car)));
    assert!(classes.clone().any(|found| !found.class.is_object()));
}
