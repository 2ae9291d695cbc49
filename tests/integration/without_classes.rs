//! Objects without classes: instances by gaps, and what they look like.

use divmerge::cloud::ShapeClass;
use divmerge::datasets::semantic_kitti::{labelled_scans, read_labels, read_scan};
use divmerge::evaluate::entropy::{
    MIN_POINTS, PointRole, TOLERANCE, entropies, found_whole, true_objects,
};
use divmerge::pipeline::{self, Config};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

use crate::shared_data::shared_data;

/// Road, parking, sidewalk, other ground, lane marking, terrain.
const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];

fn by_angle() -> Config {
    let mut config = Config::best();
    config.cluster.gaps = None;
    config
}

/// OSE, USE and the number of things found whole.
fn score(
    cloud: &PointCloud,
    classes: &[u16],
    things: &[u32],
    config: &Config,
) -> (f64, f64, usize) {
    let role = |&class: &u16| match class {
        0 | 1 | 52 | 99 => PointRole::LeftOut,
        class if GROUND.contains(&class) => PointRole::Ground,
        class => PointRole::Object(u32::from(class)),
    };
    let roles: Vec<PointRole> = classes.iter().map(role).collect();
    let truth = true_objects(cloud, &roles, TOLERANCE, MIN_POINTS);
    let ground = GroundParams::default();
    let found = pipeline::run(cloud, MaskSource::NotGround(&ground), config).labels.instance;
    let entropies = entropies(&truth, &found);
    (entropies.over, entropies.under, found_whole(things, &found, 50).0)
}

/// A cloud with its classes and the ids of its things.
type Frame = (PointCloud, Vec<u16>, Vec<u32>);

/// Gaps in place of the angle: fewer pieces, fewer mixtures, more things whole, all frames
/// together.
fn assert_gaps_are_better(frames: &[Frame]) {
    let sum = |config: &Config| {
        let scores =
            frames.iter().map(|(cloud, classes, things)| score(cloud, classes, things, config));
        scores.fold((0.0, 0.0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1, sum.2 + one.2))
    };
    let (gaps, angle) = (sum(&Config::best()), sum(&by_angle()));
    let is_better = gaps.0 < angle.0 && gaps.1 < angle.1 && gaps.2 >= angle.2;
    assert!(is_better, "{gaps:?}, by the angle {angle:?}");
}

#[test]
fn gaps_are_better_than_the_angle_on_simulated_drives() {
    for (sensor, scene) in [(Sensor::Hdl64e, Scene::Street), (Sensor::Vlp16, Scene::Crowd)] {
        let frame = Drive::new(sensor, scene, 7).frame(3);
        let classes = frame.cloud.class.clone().expect("classes");
        let things = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
        assert_gaps_are_better(&[(frame.cloud, classes, things)]);
    }
}

#[test]
fn gaps_are_better_than_the_angle_on_real_scans() {
    let Some(data) = shared_data() else { return };
    let scans = labelled_scans(&data.join("semantickitti")).expect("sequences");
    let every_eighth = scans.iter().step_by(8).map(|labelled| {
        let words = read_labels(&labelled.labels).expect("labels");
        let thing = |&word: &u32| if word >> 16 == 0 { 0 } else { word };
        let classes = words.iter().map(|&word| word as u16).collect();
        (read_scan(&labelled.scan).expect("scan"), classes, words.iter().map(thing).collect())
    });
    assert_gaps_are_better(&every_eighth.collect::<Vec<_>>());
}

#[test]
fn with_classes_gaps_change_nothing_and_nothing_is_likened() {
    let cloud = Drive::new(Sensor::Vlp16, Scene::Parking, 4).frame(1).cloud;
    let taxonomy = Taxonomy::semantic_kitti();
    let mask = MaskSource::Classes(&taxonomy);
    let best = pipeline::run(&cloud, mask, &Config::best());
    let without = pipeline::run(&cloud, mask, &by_angle());
    assert_eq!(best.labels, without.labels);
    assert_eq!(best.instances, without.instances);
    assert!(best.instances.iter().all(|instance| instance.shape.is_none()));
}

/// The likeliest kinds of the instances that hold most of a true thing of 200 points or more.
#[test]
fn simulated_cars_look_like_vehicles() {
    let frame = Drive::new(Sensor::Hdl64e, Scene::Street, 11).frame(2);
    let ground = GroundParams::default();
    let mask = MaskSource::NotGround(&ground);
    let stages = pipeline::run(&frame.cloud, mask, &Config::best());
    let classes = frame.cloud.class.as_ref().expect("classes");
    let mut points = vec![(0_u32, 0_u32); stages.instances.len() + 1];
    for (&instance, class) in stages.labels.instance.iter().zip(classes) {
        points[instance as usize].0 += 1;
        points[instance as usize].1 += u32::from([10, 252].contains(class));
    }
    let is_car =
        |id: u32| points[id as usize].0 >= 200 && 2 * points[id as usize].1 > points[id as usize].0;
    let cars: Vec<_> = stages.instances.iter().filter(|instance| is_car(instance.id)).collect();
    let alike =
        cars.iter().filter(|car| car.shape.is_some_and(|shape| shape.class == ShapeClass::Vehicle));
    let alike = alike.count();
    assert!(cars.len() > 5 && 10 * alike >= 8 * cars.len(), "{alike} of {}", cars.len());
    let title = cars.iter().map(|car| car.title()).find(|title| title.contains("vehicle-like"));
    assert!(title.is_some_and(|title| title.ends_with(" %")));
    for instance in &stages.instances {
        let shape = instance.shape.expect("no classes");
        assert!(shape.probability > 0.0 && shape.probability <= 1.0, "{shape:?}");
    }
}
