//! What a drive promises, checked on few frames.

mod back_projection;
mod placement;
mod registration;
mod traffic;

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Point2, Point3, Translation3, Vector2};

use super::material::Material;
use super::objects::vehicle::{Body, Vehicle};
use super::objects::{Placed, class};
use super::*;

/// Number of points of each key.
fn counts(keys: &[u16]) -> BTreeMap<u16, usize> {
    let mut counts = BTreeMap::new();
    for &key in keys {
        *counts.entry(key).or_insert(0) += 1;
    }
    counts
}

fn classes(frame: &SimulatedFrame) -> &[u16] {
    frame.cloud.class.as_deref().unwrap()
}

fn rings(frame: &SimulatedFrame) -> &[u16] {
    frame.cloud.ring.as_deref().unwrap()
}

fn in_world(frame: &SimulatedFrame, index: usize) -> Point3<f64> {
    frame.pose * Point3::from(frame.cloud.position(index).map(f64::from))
}

/// Middle of the returns of every instance, in the world frame, with its number of points.
fn middles(frame: &SimulatedFrame) -> BTreeMap<u16, (Point3<f64>, usize)> {
    let mut sums: BTreeMap<u16, (Point3<f64>, usize)> = BTreeMap::new();
    for (index, &id) in frame.true_instance.iter().enumerate() {
        let entry = sums.entry(id).or_insert((Point3::origin(), 0));
        entry.0 += in_world(frame, index).coords;
        entry.1 += 1;
    }
    for (sum, count) in sums.values_mut() {
        *sum /= *count as f64;
    }
    sums
}

fn azimuth(frame: &SimulatedFrame, index: usize) -> f64 {
    f64::from(frame.cloud.y[index]).atan2(f64::from(frame.cloud.x[index]))
}

fn elevation(frame: &SimulatedFrame, index: usize) -> f64 {
    let [x, y, z] = frame.cloud.position(index).map(f64::from);
    z.atan2(x.hypot(y))
}

#[test]
fn frames_depend_on_seed_and_number_alone() {
    let drive = Drive::new(Sensor::Vlp16, Scene::Street, 3);
    let alone = drive.frame(5);
    drive.frame(4);
    assert_eq!(drive.frame(5), alone);
    assert_eq!(Drive::new(Sensor::Vlp16, Scene::Street, 3).frame(5), alone);
    assert_ne!(Drive::new(Sensor::Vlp16, Scene::Street, 4).frame(5).cloud, alone.cloud);
    assert_ne!(drive.frame(6).cloud, alone.cloud);
    assert_eq!(alone.stamp_ns, EPOCH_NS + 500_000_000);
}

#[test]
fn hdl64e_stores_returns_ring_by_ring_from_the_highest_beam() {
    let frame = Drive::new(Sensor::Hdl64e, Scene::Street, 0).frame(0);
    let count = frame.cloud.len();
    assert!((95_000..130_000).contains(&count), "{count}");
    assert_eq!((frame.cloud.height, frame.cloud.width), (1, count));
    assert!((0..count).all(|index| frame.cloud.is_return(index)));
    let around = |index| azimuth(&frame, index).rem_euclid(TAU);
    for index in 1..count {
        let (before, ring) = (rings(&frame)[index - 1], rings(&frame)[index]);
        let ahead = around(index) + 6e-3 > around(index - 1);
        assert!(ring > before || (ring == before && ahead), "{index}");
    }
    for (index, &ring) in rings(&frame).iter().enumerate() {
        let expected = Sensor::Hdl64e.elevation(usize::from(ring));
        assert!((elevation(&frame, index) - expected).abs() < 1e-5);
    }
}

#[test]
fn vlp16_stores_returns_firing_by_firing_with_ring_0_lowest() {
    let frame = Drive::new(Sensor::Vlp16, Scene::Street, 0).frame(0);
    assert_eq!(frame.cloud.height, 1);
    assert!(frame.time_offset_ns.is_sorted());
    assert!(u64::from(*frame.time_offset_ns.last().unwrap()) < sensor::TURN_NS);
    for (index, &ring) in rings(&frame).iter().enumerate() {
        let expected = (-15.0 + 2.0 * f64::from(ring)).to_radians();
        assert!((elevation(&frame, index) - expected).abs() < 1e-5);
        let turn = f64::from(frame.time_offset_ns[index]) / sensor::TURN_NS as f64;
        let behind = (azimuth(&frame, index) - std::f64::consts::PI + TAU * turn).rem_euclid(TAU);
        assert!(behind.min(TAU - behind) < 6e-3, "{behind}");
    }
}

#[test]
fn os1_128_is_organised_with_origins_for_no_return() {
    let frame = Drive::new(Sensor::Os1_128, Scene::Crowd, 0).frame(0);
    assert_eq!((frame.cloud.height, frame.cloud.width), (128, 1024));
    for index in 0..frame.cloud.len() {
        let (row, column) = (index / 1024, index % 1024);
        assert_eq!(usize::from(rings(&frame)[index]), row);
        if frame.cloud.is_return(index) {
            assert!((elevation(&frame, index) - Sensor::Os1_128.elevation(row)).abs() < 1e-5);
            let expected = Sensor::Os1_128.azimuth(column);
            assert!((azimuth(&frame, index) - expected).abs() < 1e-3);
        } else {
            assert_eq!(frame.cloud.position(index), [0.0; 3]);
            assert_eq!((classes(&frame)[index], frame.true_instance[index]), (0, 0));
        }
    }
}

#[test]
fn scenes_hold_what_they_promise() {
    use class::*;
    let street = vec![
        (CAR, 3000),
        (MOVING_CAR, 300),
        (PERSON, 50),
        (MOVING_PERSON, 200),
        (MOVING_BICYCLIST, 100),
        (ROAD, 9000),
        (PARKING, 1000),
        (SIDEWALK, 500),
        (BUILDING, 1000),
        (TRUNK, 50),
        (POLE, 20),
    ];
    let parking = vec![(CAR, 9000), (MOVING_PERSON, 100), (ROAD, 9000), (PARKING, 500)];
    let crowd =
        vec![(PERSON, 500), (MOVING_PERSON, 3000), (MOVING_BICYCLIST, 100), (POLE, 300), (CAR, 10)];
    let promised = [street, parking, crowd];
    for (scene, promised) in Scene::ALL.into_iter().zip(promised) {
        let frame = Drive::new(Sensor::Hdl64e, scene, 1).frame(0);
        let found = counts(classes(&frame));
        for (class, least) in promised {
            let count = found.get(&class).copied().unwrap_or(0);
            assert!(count >= least, "{scene}: {count} points of class {class}");
        }
        for (&class, &id) in classes(&frame).iter().zip(&frame.true_instance) {
            assert_eq!(class::is_thing(class), id != 0, "{class} {id}");
        }
        let usual = frame.intensity.iter().all(|i| (0.0..=1.0).contains(i));
        assert!(usual, "{scene}");
    }
}

#[test]
fn a_crowd_is_sixty_to_a_hundred_people() {
    let frame = Drive::new(Sensor::Hdl64e, Scene::Crowd, 0).frame(0);
    let is_person = |class| class == class::PERSON || class == class::MOVING_PERSON;
    let people = (0..frame.cloud.len()).filter(|&index| {
        is_person(classes(&frame)[index]) && frame.cloud.squared_range(index) < 50.0 * 50.0
    });
    let ids: Vec<u16> = people.map(|index| frame.true_instance[index]).collect();
    let seen = counts(&ids).into_values().filter(|&n| n >= 10).count();
    assert!((60..=100).contains(&seen), "{seen} people");
}

#[test]
fn every_class_of_things_turns_up() {
    use class::*;
    let found: BTreeSet<u16> = Scene::ALL
        .into_iter()
        .flat_map(|scene| World::new(scene, 0).objects(0.0, 200.0))
        .flat_map(|object| object.model.parts)
        .map(|part| part.class)
        .collect();
    for class in [
        CAR,
        BICYCLE,
        MOTORCYCLE,
        TRUCK,
        OTHER_VEHICLE,
        PERSON,
        BICYCLIST,
        MOVING_CAR,
        MOVING_BICYCLIST,
        MOVING_PERSON,
        FENCE,
        VEGETATION,
        TRAFFIC_SIGN,
    ] {
        assert!(found.contains(&class), "{class}");
    }
}

#[test]
fn ids_are_one_object_each_and_stay_with_it() {
    for scene in Scene::ALL {
        let world = World::new(scene, 2);
        let [now, then] = [0.0, 1.0].map(|time| world.objects(time, 60.0));
        let things = now.iter().filter(|object| object.id != 0);
        let before: BTreeMap<u16, &Placed> = things.map(|thing| (thing.id, thing)).collect();
        assert_eq!(before.len(), now.iter().filter(|o| o.id != 0).count());
        let mut moved = 0;
        for after in then.iter().filter(|object| object.id != 0) {
            let Some(before) = before.get(&after.id) else {
                continue;
            };
            assert_eq!(before.model.parts[0].class, after.model.parts[0].class);
            let [from, to] = [before, after].map(|o| o.world_from_object.translation.vector);
            let step = (to - from).norm();
            let is_moving = after.model.parts[0].class >= class::MOVING_CAR;
            assert!(step < 13.0 && is_moving == (step > 0.5), "{step}");
            moved += usize::from(is_moving);
        }
        assert!(moved > 5, "{scene}: {moved}");
    }
}

#[test]
fn returns_of_parked_cars_stay_where_they_are_in_the_world() {
    let drive = Drive::new(Sensor::Hdl64e, Scene::Parking, 0);
    let [now, then] = [0, 10].map(|number| drive.frame(number));
    assert!((then.pose.translation.x - now.pose.translation.x - 2.5).abs() < 0.3);
    let after = middles(&then);
    let mut compared = 0;
    for (id, (from, count)) in middles(&now) {
        // Ids at rest are the lower ones.
        if (1..=24_576).contains(&id) && count > 500 {
            compared += 1;
            assert!((after[&id].0 - from).norm() < 1.5, "{id}");
        }
    }
    assert!(compared > 8, "{compared}");
}

#[test]
fn ground_returns_lie_on_the_sloped_ground() {
    let drive = Drive::new(Sensor::Vlp16, Scene::Crowd, 6);
    let frame = drive.frame(40);
    let ground = &drive.world.ground;
    let is_ground = |class| [class::ROAD, class::SIDEWALK].contains(&class);
    let is_kerb = |y: f64| (y.abs() - 3.0).abs() < 0.1;
    let (mut count, mut lowest, mut highest) = (0, f64::MAX, f64::MIN);
    for index in (0..frame.cloud.len()).filter(|&index| is_ground(classes(&frame)[index])) {
        let at = in_world(&frame, index);
        let below = at.z - ground.height(at.x, at.y);
        assert!(is_kerb(at.y) || below.abs() < 0.05, "{below}");
        (lowest, highest) = (f64::min(lowest, at.z), f64::max(highest, at.z));
        count += 1;
    }
    assert!(count > 3000 && highest - lowest > 0.3, "{lowest} {highest}");
    let up = frame.pose * nalgebra::Vector3::z();
    assert!(up.xy().norm() > 1e-3);
}

#[test]
fn windscreens_show_drivers() {
    let drive = Drive::new(Sensor::Hdl64e, Scene::Street, 0);
    let seen = |number| {
        let returns = drive.view(number).cast();
        let is_head = |r: &&Return| {
            r.material == Material::Skin && [class::CAR, class::MOVING_CAR].contains(&r.class)
        };
        returns.iter().flatten().flatten().filter(is_head).count()
    };
    let heads: usize = [0, 15, 30].map(seen).iter().sum();
    assert!(heads > 10, "{heads}");
}

/// Returns of a single car eight metres ahead of an HDL-64E.
fn returns_of_a_car(is_black: bool) -> Vec<Return> {
    let car = Vehicle {
        body: Body::Estate,
        length: 4.5,
        width: 1.8,
        height: 1.5,
        is_black,
        has_driver: false,
    };
    let drive = Drive::new(Sensor::Hdl64e, Scene::Street, 0);
    let ground = &drive.world.ground;
    let mut model = car.parked();
    // The body alone: no wheels, windows or seats.
    model.parts.truncate(1);
    let placed =
        Placed { id: 1, model, world_from_object: ground.frame_on_slope(8.0, -1.75, FRAC_PI_2) };
    let pose = drive.world.ego(0.0) * Translation3::new(0.0, 0.0, 1.73);
    let view = View::new(drive.sensor, ground, pose, (0, 0), vec![placed]);
    let returns = view.cast().into_iter().flatten().flatten();
    returns.filter(|found| found.id == 1).collect()
}

#[test]
fn black_cars_lose_their_paint_and_keep_their_lamps() {
    let [ordinary, black] = [false, true].map(returns_of_a_car);
    let lamps = |returns: &[Return]| {
        let is_lamp = |r: &&Return| r.material == Material::Retroreflector;
        returns.iter().filter(is_lamp).count()
    };
    let paint = [&ordinary, &black].map(|returns| (returns.len() - lamps(returns)) as f64);
    let kept = paint[1] / paint[0];
    assert!(paint[0] > 1000.0 && (0.08..0.17).contains(&kept), "{kept}");
    assert_eq!(lamps(&ordinary), lamps(&black));
}

#[test]
fn sorting_into_columns_loses_nothing() {
    let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
    let pose = drive.view(0).world_from_sensor;
    let without_foliage = || {
        let objects = drive.world.objects(0.0, 40.0).into_iter();
        let keep = |o: &Placed| !o.model.parts.iter().any(|part| part.coating.is_foliage());
        objects.filter(keep).collect()
    };
    let view = |objects| View::new(drive.sensor, &drive.world.ground, pose, (1, 0), objects);
    let sorted = view(without_foliage());
    let mut unsorted = view(without_foliage());
    unsorted.forget_bounds();
    assert!(sorted.cast() == unsorted.cast());
}

#[test]
fn a_turned_sensor_sees_the_same_place() {
    let level = Drive::new(Sensor::Os1_128, Scene::Yard, 1);
    let mut turned = level.clone();
    (turned.mount.pitch, turned.mount.roll) = (0.2, std::f64::consts::PI - 0.1);
    let frame = turned.frame(0);
    let mut seen = 0;
    for index in (0..frame.cloud.len()).filter(|&index| classes(&frame)[index] == class::ROAD) {
        let at = in_world(&frame, index);
        // Noise puts a return at the kerb on its other side.
        if at.y.abs() < 3.9 {
            assert!((at.z - level.world.ground.height(at.x, at.y)).abs() < 0.1, "{at}");
            seen += 1;
        }
    }
    assert!(seen > 5000, "{seen}");
}

#[test]
fn a_limited_field_of_view_is_a_part_of_the_whole() {
    let mut drive = Drive::new(Sensor::Hdl32e, Scene::Street, 1);
    let whole = drive.frame(0);
    drive.mount.field_of_view = FRAC_PI_2;
    let part = drive.frame(0);
    let inside = |frame: &SimulatedFrame| {
        let inside =
            (0..frame.cloud.len()).filter(|&i| azimuth(frame, i).abs() < 0.5 * FRAC_PI_2 - 0.01);
        inside.map(|i| frame.cloud.position(i)).collect::<Vec<_>>()
    };
    assert_eq!(inside(&part), inside(&whole));
    assert!((0..part.cloud.len()).all(|i| azimuth(&part, i).abs() < 0.5 * FRAC_PI_2 + 0.01));
}

#[test]
fn clutter_comes_as_often_as_it_is_asked_for() {
    let mut drive = Drive::new(Sensor::Hdl32e, Scene::Street, 1);
    drive.clutter.mirrored = 0.05;
    let frame = drive.frame(0);
    let ground = counts(classes(&frame)).into_iter().filter(|(class, _)| (40..50).contains(class));
    let ground: usize = ground.map(|(_, count)| count).sum();
    let below: Vec<usize> =
        (0..frame.cloud.len()).filter(|&i| classes(&frame)[i] == class::OUTLIER).collect();
    let share = below.len() as f64 / (ground + below.len()) as f64;
    assert!((0.03..0.08).contains(&share), "{share}");
    for &index in &below {
        let at = in_world(&frame, index);
        assert!(at.z < drive.world.ground.height(at.x, at.y), "{at}");
    }
    drive.clutter = Clutter { drops: 0.1, mirrored: 0.0 };
    let rain = counts(classes(&drive.frame(0)))[&class::OUTLIER];
    // A tenth of the beams meets a drop, most of them before any surface.
    let beams = Sensor::Hdl32e.beams() * Sensor::Hdl32e.columns();
    assert!((0.04..0.1).contains(&(rain as f64 / beams as f64)), "{rain}");
}
