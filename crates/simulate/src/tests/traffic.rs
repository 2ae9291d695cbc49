//! The script of scene `traffic`.

use super::placement::{footprint, overlap};
use super::*;

fn world(seed: u64) -> World {
    World::new(Scene::Traffic, seed)
}

/// Heading and place of the ego vehicle.
fn ego(time: f64) -> (f64, Point2<f64>) {
    let pose = world(0).ego(time);
    let ahead = pose * nalgebra::Vector3::x();
    (ahead.y.atan2(ahead.x), pose.translation.vector.xy().into())
}

#[test]
fn the_ego_vehicle_stops_and_turns_to_both_sides() {
    let (standing, after) = (ego(7.0), ego(13.5));
    assert!((standing.1 - after.1).norm() < 1e-9);
    let headings = [0.0, 20.0, 27.0].map(|time| ego(time).0.to_degrees());
    for (heading, expected) in headings.into_iter().zip([0.0, -90.0, 0.0]) {
        assert!((heading - expected).abs() < 0.5, "{headings:?}");
    }
    let steps = (0..600).map(|tenth| {
        let [now, then] = [tenth, tenth + 1].map(|tenth| ego(0.1 * f64::from(tenth)));
        (then.1 - now.1).norm()
    });
    // Never faster than 8 m/s.
    assert!(steps.into_iter().all(|step| step < 0.801));
}

#[test]
fn nothing_overlaps_while_people_cross() {
    for (seed, tenth) in (0..4).flat_map(|seed| (0..100).map(move |step| (seed, 4 * step + seed))) {
        let time = 0.1 * tenth as f64;
        let objects = world(seed as u64).objects(time, 60.0);
        let things: Vec<_> = objects.iter().filter(|object| object.id != 0).collect();
        let boxes: Vec<_> = things.iter().map(|thing| footprint(thing)).collect();
        for (i, one) in boxes.iter().enumerate() {
            for (j, other) in boxes[..i].iter().enumerate() {
                let ids = [things[i].id, things[j].id];
                assert!(!overlap(one, other), "{seed}, {time} s: {ids:?}, {}", one.middle);
            }
        }
    }
}

/// How objects lie to the ego vehicle, by id: metres ahead and to the left.
fn around(time: f64) -> BTreeMap<u16, (u16, Point3<f64>)> {
    let world = world(0);
    let from_world = world.ego(time).inverse();
    let objects = world.objects(time, 60.0).into_iter().filter(|object| object.id != 0);
    let place = |o: Placed| from_world * Point3::from(o.world_from_object.translation.vector);
    objects.map(|o| (o.id, (o.model.parts[0].class, place(o)))).collect()
}

#[test]
fn cars_overtake_and_come_towards_and_people_cross_in_front() {
    let [start, stopped] = [0.0, 7.0].map(around);
    let passes = |ahead: fn(f64) -> bool, to: fn(f64) -> bool, left: std::ops::Range<f64>| {
        let moved = start.iter().filter(|(id, (class, from))| {
            let then = stopped.get(id).map(|then| then.1);
            *class >= class::MOVING_CAR
                && left.contains(&from.y)
                && ahead(from.x)
                && then.is_some_and(|then| to(then.x))
        });
        moved.count()
    };
    assert_eq!(passes(|x| x < 0.0, |x| x > 0.0, 2.0..5.0), 3);
    assert!(passes(|x| x > 0.0, |x| x < 0.0, 9.0..16.0) >= 3);
    let [before, after] = [7.0, 16.0].map(around);
    let crossed = before.iter().filter(|(id, (class, from))| {
        let crosses = |to: Point3<f64>| from.y * to.y < 0.0 && from.x > 2.3;
        *class == class::MOVING_PERSON && after.get(id).is_some_and(|to| crosses(to.1))
    });
    assert_eq!(crossed.count(), 6);
}

/// Times that an object has ten points and more, then none for 1.5 to 2.5 s, then ten and more.
fn hidden(drive: &Drive, frames: usize) -> usize {
    let mut points: BTreeMap<u16, Vec<usize>> = BTreeMap::new();
    for number in 0..frames {
        for (id, count) in counts(&drive.frame(number).true_instance) {
            points.entry(id).or_insert_with(|| vec![0; frames])[number] = count;
        }
    }
    points.remove(&0);
    let cases = |points: Vec<usize>| {
        let seen: Vec<usize> = (0..frames).filter(|&number| points[number] > 0).collect();
        let is_large = |near: &[usize]| near.iter().any(|&points| points >= 10);
        let is_case = |gap: &&[usize]| {
            (15..=25).contains(&(gap[1] - gap[0] - 1))
                && is_large(&points[gap[0].saturating_sub(4)..=gap[0]])
                && is_large(&points[gap[1]..(gap[1] + 5).min(frames)])
        };
        seen.windows(2).filter(is_case).count()
    };
    points.into_values().map(cases).sum()
}

#[test]
fn objects_are_hidden_for_two_seconds_and_come_back() {
    let cases = hidden(&Drive::new(Sensor::Vlp16, Scene::Traffic, 21), 300);
    assert!(cases >= 10, "{cases}");
}

#[test]
fn every_sensor_sees_the_crossing() {
    for sensor in Sensor::ALL {
        let frame = Drive::new(sensor, Scene::Traffic, 1).frame(110);
        let seen = counts(classes(&frame));
        for class in [class::MOVING_PERSON, class::MOVING_TRUCK] {
            assert!(seen.get(&class).is_some_and(|&points| points > 20), "{sensor}: {seen:?}");
        }
    }
}
