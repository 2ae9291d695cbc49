//! Classes of a network that blurs objects: segments vote on what their points are, and strips are
//! no vehicles.

use std::collections::{BTreeMap, HashSet};

use divmerge::pipeline::run;
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{Config, GroundParams, MaskSource, Taxonomy};

const CAR: u16 = 10;
const BUILDING: u16 = 50;
const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];

/// A car park as a network may see it: ground beside cars is called car, as are patches of what is
/// no thing, and the last third of each car along x is called building.
#[test]
fn patches_go_and_ends_of_cars_come_back() {
    let frame = Drive::new(Sensor::Hdl64e, Scene::Parking, 3).frame(0);
    let truth = frame.cloud.class.clone().unwrap();
    let cell = |point: usize, side: f32| {
        let [x, y, _] = frame.cloud.position(point);
        [x, y].map(|along| (along / side).floor() as i64)
    };
    let returns = || (0..frame.cloud.len()).filter(|&point| frame.cloud.is_return(point));
    let is_car = |point: usize| truth[point] == CAR;
    let is_upright = |point: usize| !is_car(point) && !GROUND.contains(&truth[point]);
    let near_cars: HashSet<_> =
        returns().filter(|&point| is_car(point)).map(|point| cell(point, 0.4)).collect();
    let mut of_car: BTreeMap<u16, Vec<usize>> = BTreeMap::new();
    for point in returns().filter(|&point| is_car(point)) {
        of_car.entry(frame.true_instance[point]).or_default().push(point);
    }
    let mut ends: HashSet<usize> = HashSet::new();
    for points in of_car.values_mut() {
        points.sort_by(|&a, &b| frame.cloud.x[a].total_cmp(&frame.cloud.x[b]));
        ends.extend(&points[points.len() * 2 / 3..]);
    }
    let mut class = truth.clone();
    for point in returns() {
        let ([x, y], [p, q]) = (cell(point, 0.4), cell(point, 1.0));
        let beside = (-1..=1).any(|i| (-1..=1).any(|j| near_cars.contains(&[x + i, y + j])));
        let is_patch = is_upright(point) && (3 * p + q).rem_euclid(7) == 0;
        if is_patch || (GROUND.contains(&truth[point]) && beside) {
            class[point] = CAR;
        } else if is_car(point) && ends.contains(&point) {
            class[point] = BUILDING;
        }
    }
    let taxonomy = Taxonomy::semantic_kitti();
    let cloud = frame.cloud.clone().with_class(class).unwrap();
    let ground = GroundParams::default();
    let errors = |config: &Config| {
        let stages = run(&cloud, MaskSource::NetworkClasses(&taxonomy, &ground), config);
        assert!(stages.mask.bleeds);
        let called = &stages.labels.semantic;
        let patches = returns().filter(|&p| is_upright(p) && called[p] == CAR).count();
        let ends_lost = returns().filter(|&p| is_car(p) && called[p] == BUILDING).count();
        [patches, ends_lost]
    };
    let before = errors(&Config { segment_vote: None, ..Config::best() });
    let after = errors(&Config::best());
    assert!(before.iter().all(|&count| count > 500), "{before:?}");
    assert!(after[0] * 2 < before[0], "{after:?} of {before:?}");
    assert!(after[1] * 5 < before[1], "{after:?} of {before:?}");
}

/// A street as a network may see it: a strip of each wall is called car. It is taken for one unless
/// strips are none, and stays where classes do not bleed onto the ground.
#[test]
fn strips_of_walls_go_where_classes_bleed() {
    let frame = Drive::new(Sensor::Hdl64e, Scene::Street, 3).frame(0);
    let truth = frame.cloud.class.clone().unwrap();
    let cell = |point: usize| {
        let [x, y, _] = frame.cloud.position(point);
        [x, y].map(|along| (along / 0.4).floor() as i64)
    };
    let returns = || (0..frame.cloud.len()).filter(|&point| frame.cloud.is_return(point));
    let near_cars: HashSet<_> = returns().filter(|&p| truth[p] == CAR).map(cell).collect();
    let is_strip = |point: usize| {
        truth[point] == BUILDING && (-0.6..-0.3).contains(&frame.cloud.position(point)[2])
    };
    let taxonomy = Taxonomy::semantic_kitti();
    let ground = GroundParams::default();
    let called_cars = |bleeds: bool, config: &Config| {
        let mut class = truth.clone();
        for point in returns() {
            let [x, y] = cell(point);
            let beside = (-1..=1).any(|i| (-1..=1).any(|j| near_cars.contains(&[x + i, y + j])));
            if is_strip(point) || (bleeds && GROUND.contains(&truth[point]) && beside) {
                class[point] = CAR;
            }
        }
        let cloud = frame.cloud.clone().with_class(class).unwrap();
        let stages = run(&cloud, MaskSource::NetworkClasses(&taxonomy, &ground), config);
        assert_eq!(stages.mask.bleeds, bleeds);
        let called = &stages.labels.semantic;
        let walls = returns().filter(|&p| is_strip(p) && called[p] == CAR).count();
        let cars = returns().filter(|&p| truth[p] == CAR && called[p] == CAR).count();
        [walls, cars]
    };
    let without_votes = Config { segment_vote: None, ..Config::best() };
    let kept = Config { vehicle_strips: None, ..without_votes.clone() };
    let [before, after] = [&kept, &without_votes].map(|config| called_cars(true, config));
    assert!(before[0] > 100, "{before:?}");
    assert!(after[0] * 2 < before[0], "{after:?} of {before:?}");
    assert_eq!(after[1], before[1], "cars stay");
    assert_eq!(called_cars(false, &without_votes)[0], called_cars(false, &kept)[0]);
}
