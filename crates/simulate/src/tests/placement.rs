//! Things stand where they should, and do not overlap.

use super::*;

/// A box's footprint: middle, unit axes, half sizes.
pub(super) struct Footprint {
    pub middle: Point2<f64>,
    axes: [Vector2<f64>; 2],
    half: [f64; 2],
}

pub(super) fn footprint(object: &Placed) -> Footprint {
    let (low, high) = (object.model.low, object.model.high);
    let pose = &object.world_from_object;
    let axes = [nalgebra::Vector3::x(), nalgebra::Vector3::y()];
    Footprint {
        middle: (pose * nalgebra::center(&low, &high)).xy(),
        axes: axes.map(|axis| (pose * axis).xy().normalize()),
        half: [0.5 * (high.x - low.x), 0.5 * (high.y - low.y)],
    }
}

/// Whether no axis of either rectangle separates the two.
pub(super) fn overlap(a: &Footprint, b: &Footprint) -> bool {
    let between = b.middle - a.middle;
    a.axes.iter().chain(&b.axes).all(|axis| {
        let reach = |f: &Footprint| {
            f.half[0] * f.axes[0].dot(axis).abs() + f.half[1] * f.axes[1].dot(axis).abs()
        };
        between.dot(axis).abs() < reach(a) + reach(b)
    })
}

#[test]
fn no_two_things_overlap() {
    for scene in Scene::ALL {
        for (seed, time) in (0..100u64).map(|s| (s, s as f64 * 2.7)) {
            let objects = World::new(scene, seed).objects(time, 80.0);
            let things: Vec<_> = objects.iter().filter(|object| object.id != 0).collect();
            let boxes: Vec<_> = things.iter().map(|thing| footprint(thing)).collect();
            for i in 0..boxes.len() {
                for j in 0..i {
                    let [a, b] = [things[i], things[j]];
                    let (here, class) = (boxes[i].middle, |o: &Placed| o.model.parts[0].class);
                    assert!(
                        !overlap(&boxes[i], &boxes[j]),
                        "{scene} {seed}: {} and {} at {here}",
                        class(a),
                        class(b)
                    );
                }
            }
        }
    }
}

#[test]
fn the_ego_vehicle_hits_nothing() {
    let drives = Scene::ALL.map(|scene| (0..5).map(move |seed| (scene, seed)));
    for (scene, seed) in drives.into_iter().flatten() {
        let world = World::new(scene, seed);
        for tenth in 0..1000 {
            let time = 0.1 * f64::from(tenth);
            let pose = world.ego(time);
            let ego = Footprint {
                middle: pose.translation.vector.xy().into(),
                axes: [nalgebra::Vector3::x(), nalgebra::Vector3::y()]
                    .map(|axis| (pose * axis).xy().normalize()),
                half: [2.3, 0.95],
            };
            for object in world.objects(time, 10.0).iter().filter(|o| o.id != 0) {
                assert!(!overlap(&ego, &footprint(object)), "{scene} at {time} s");
            }
        }
    }
}

/// Gaps between neighbours along x or y, bodies of one class within a metre of each other across.
fn gaps(objects: &[Placed], class: u16, along: usize) -> Vec<f64> {
    let of_class = |o: &&Placed| o.id != 0 && o.model.parts[0].class == class;
    let boxes: Vec<_> = objects.iter().filter(of_class).map(footprint).collect();
    let reach = |f: &Footprint| (0..2).map(|i| f.half[i] * f.axes[i][along].abs()).sum::<f64>();
    let mut gaps = Vec::new();
    for a in &boxes {
        let ahead = boxes.iter().filter_map(|b| {
            let between = b.middle - a.middle;
            let is_level = between[1 - along].abs() < 0.35 && between[along] > 0.0;
            is_level.then(|| between[along] - reach(a) - reach(b))
        });
        gaps.extend(ahead.min_by(f64::total_cmp));
    }
    gaps
}

#[test]
fn neighbours_are_as_close_as_promised() {
    let people = World::new(Scene::Crowd, 0).objects(0.0, 60.0);
    let together = gaps(&people, class::MOVING_PERSON, 1).into_iter();
    let together: Vec<f64> = together.filter(|&gap| gap < 0.6).collect();
    assert!(together.len() > 20, "{}", together.len());
    assert!(together.iter().all(|gap| (0.08..0.52).contains(gap)));

    let cars = World::new(Scene::Parking, 0).objects(0.0, 60.0);
    let perpendicular = gaps(&cars, class::CAR, 0);
    let close = perpendicular.iter().filter(|gap| (0.4..0.9).contains(*gap));
    assert!(close.count() > 30);

    let street = World::new(Scene::Street, 0).objects(0.0, 60.0);
    let right = |o: &Placed| o.world_from_object.translation.y < 0.0;
    let kerbside: Vec<Placed> = street.into_iter().filter(right).collect();
    let end_to_end = gaps(&kerbside, class::CAR, 0);
    let close = end_to_end.iter().filter(|gap| (0.55..1.25).contains(*gap));
    assert!(close.count() > 8);
}
