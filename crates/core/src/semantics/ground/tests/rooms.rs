//! Indoors: walls, ceilings and furniture.

use super::*;

/// Four walls and a ceiling around the sensor, so many metres to each side along x and y.
fn room([x, y]: [f64; 2], ceiling: f64) -> Vec<Solid> {
    vec![
        [[-x, -y, 0.0], [x, -y + 0.2, ceiling]],
        [[-x, y - 0.2, 0.0], [x, y, ceiling]],
        [[-x, -y, 0.0], [-x + 0.2, y, ceiling]],
        [[x - 0.2, -y, 0.0], [x, y, ceiling]],
        [[-x, -y, ceiling], [x, y, ceiling + 0.2]],
    ]
}

/// F1 of the floor in a room, for a sensor of 16 beams that somebody carries through it.
fn floor_f1(half: [f64; 2], ceiling: f64, attitude: (f64, f64)) -> f64 {
    let scene = Scene {
        rows: 16,
        columns: 900,
        beams: (15.0, -15.0),
        sensor: 1.6,
        attitude,
        noise: 0.02,
        solids: room(half, ceiling),
        ..Scene::default()
    };
    let (cloud, over_floor) = scene.scan();
    f1(&cloud, over_floor.into_iter().map(|height| height < scene.noise))
}

#[test]
fn floor_of_a_small_room_is_not_a_slant_from_floor_to_ceiling() {
    for half in [[3.0, 4.0], [5.0, 4.0], [7.0, 5.0]] {
        for ceiling in [2.5, 3.0] {
            for attitude in [(-8.0, -15.0), (0.0, 20.0), (25.0, 0.0)] {
                let f1 = floor_f1(half, ceiling, attitude);
                assert!(f1 > 0.9, "{half:?}, {ceiling} m high, {attitude:?}: {f1}");
            }
        }
    }
}

#[test]
fn floor_under_a_ceiling_is_the_floor() {
    let room = [[[-30.0, -30.0, 3.0], [30.0, 30.0, 3.2]], CAR];
    let scene = Scene { beams: (25.0, -25.0), ..Scene::with(room) };
    let (cloud, over_floor) = scene.scan();
    let found = verdicts(&cloud);
    let count = |is_there: &dyn Fn(f64) -> bool| {
        (0..cloud.len()).filter(|&i| found[i] && is_there(over_floor[i])).count()
    };
    assert_eq!(count(&|height| height > 2.0), 0);
    assert!(count(&|height| height < 0.1) > 2000);
}

#[test]
fn a_ceiling_is_not_the_ground() {
    let hall = |sensor: f64, ceiling: f64, beams| {
        let solids = room([9.0, 9.0], ceiling);
        Scene { sensor, beams, solids, ..Scene::default() }
    };
    let above = |scene: &Scene| {
        let (cloud, ..) = scene.scan();
        let found = verdicts(&cloud);
        (0..cloud.len()).any(|point| found[point] && cloud.z[point] > 0.0)
    };
    assert!(!above(&hall(0.4, 3.0, (30.0, -10.0))), "more ceiling than floor in sight");
    assert!(!above(&hall(1.5, 3.0, (40.0, -5.0))), "no floor in sight");
}

#[test]
fn room_whose_lowest_beams_meet_furniture() {
    let scene = Scene {
        sensor: 1.0,
        beams: (15.0, -30.0),
        ..Scene::with([
            [[-4.0, -3.2, 0.0], [6.0, -3.0, 3.0]],
            [[-4.0, 4.0, 0.0], [6.0, 4.2, 3.0]],
            [[6.0, -3.0, 0.0], [6.2, 4.0, 3.0]],
            [[-4.2, -3.0, 0.0], [-4.0, 4.0, 3.0]],
            [[0.6, -0.6, 0.0], [1.8, 0.6, 0.75]],
            [[-2.0, 1.0, 0.0], [-1.0, 2.0, 0.45]],
        ])
    };
    assert_separated(&scene);
}

#[test]
fn foot_of_a_wall_is_rejected_where_rows_lie_closer_than_the_noise() {
    let scene = Scene {
        rows: 64,
        beams: (2.0, -16.0),
        sensor: 0.5,
        noise: 0.02,
        solids: room([3.0, 2.5], 2.5),
        ..Scene::default()
    };
    let foot = share_of_ground(&scene, 0.07, 0.2);
    assert!(foot < 0.2, "{foot} of the wall's foot taken for ground");
}
