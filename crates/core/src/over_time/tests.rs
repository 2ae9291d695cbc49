//! Small drives by hand. Cars are boxes of cells; the sensor stands unless it is said to move.

use nalgebra::{Isometry3, Translation3};

use super::*;
use crate::cloud::Body;

/// Seconds between frames.
const STEP: f64 = 0.1;

/// The cells of a car side from `from` to `to` metres along x, at some distance to the left.
fn car(id: u32, [from, to]: [f32; 2], left: f32) -> ObservedInstance {
    let count = ((to - from) / 0.25).round() as usize;
    let along = (0..count).map(|k| from + (k as f32 + 0.5) * 0.25);
    let cell = |x: f32| [0.3, 0.9].map(|z| [x, left, z].map(|at| (at * 100.0).round() as i16));
    let cells: Vec<[i16; 3]> = along.flat_map(cell).collect();
    ObservedInstance {
        id,
        semantic: 10,
        body: Some(Body::Car),
        points: cells.len() as u32 * 5,
        size: [to - from, 0.2, 1.2],
        yaw: 0.0,
        cells,
    }
}

/// The tracks of each frame of a drive.
fn tracks(frames: &[Vec<ObservedInstance>], pose: impl Fn(usize) -> Isometry3<f64>) -> Tracks {
    followed(frames, pose).into_iter().map(|frame| frame.tracks).collect()
}

/// What is decided of each frame of a drive.
fn followed(
    frames: &[Vec<ObservedInstance>],
    pose: impl Fn(usize) -> Isometry3<f64>,
) -> Vec<DecidedFrame> {
    let mut tracker = Tracker::new(TrackParams::default());
    let mut decided = Vec::new();
    for (number, instances) in frames.iter().enumerate() {
        let (time, pose) = (number as f64 * STEP, pose(number));
        decided.extend(tracker.push(TrackerFrame { time, pose: &pose, instances }));
    }
    decided.extend(tracker.finish());
    assert_eq!(decided.len(), frames.len());
    decided
}

type Tracks = Vec<Vec<InstanceTrack>>;

fn still(_: usize) -> Isometry3<f64> {
    Isometry3::identity()
}

fn whole(track: u32) -> InstanceTrack {
    InstanceTrack::Whole(track)
}

#[test]
fn a_car_that_is_hidden_for_two_seconds_keeps_its_track() {
    // 8 m/s to the right, hidden in frames 10 to 29, while another one stands beside.
    let frame = |number: usize| {
        let from = 0.8 * number as f32 - 10.0;
        let moving = (!(10..30).contains(&number)).then(|| car(1, [from, from + 4.0], 6.0));
        moving.into_iter().chain([car(2, [20.0, 24.0], 3.0)]).collect()
    };
    let found = tracks(&(0..40).map(frame).collect::<Vec<_>>(), still);
    for (number, found) in found.iter().enumerate() {
        match number {
            10..30 => assert_eq!(*found, [whole(2)], "{number}"),
            _ => assert_eq!(*found, [whole(1), whole(2)], "{number}"),
        }
    }
}

#[test]
fn a_piece_goes_back_to_the_whole_that_it_was_part_of() {
    let frame = |number: usize| match number {
        8 => vec![car(1, [0.0, 2.5], 5.0), car(2, [2.5, 4.0], 5.0)],
        _ => vec![car(1, [0.0, 4.0], 5.0)],
    };
    let found = tracks(&(0..20).map(frame).collect::<Vec<_>>(), still);
    assert!(found.iter().flatten().all(|track| *track == whole(1)), "{found:?}");
    assert_eq!(found[8].len(), 2);
}

#[test]
fn a_car_that_another_one_swallowed_is_cut_out_again() {
    let frame = |number: usize| match number {
        8 => vec![car(1, [0.0, 8.5], 5.0)],
        _ => vec![car(1, [0.0, 4.0], 5.0), car(2, [4.5, 8.5], 5.0)],
    };
    let found = tracks(&(0..20).map(frame).collect::<Vec<_>>(), still);
    let InstanceTrack::Parts(parts) = &found[8][0] else { panic!("{:?}", found[8]) };
    // Cells at the lower x first: those of the first car, the gap, those of the second.
    assert!(parts[..32].iter().all(|&track| track == 1), "{parts:?}");
    assert!(parts[36..].iter().all(|&track| track == 2), "{parts:?}");
    for (number, found) in found.iter().enumerate().filter(|(number, _)| *number != 8) {
        assert_eq!(*found, [whole(1), whole(2)], "{number}");
    }
}

/// Parked cars, one every 250 m, seen from a drive far from the origin of the poses.
#[test]
fn the_world_goes_along_with_the_sensor() {
    let place = |number: usize| 5e6 + 25.0 * STEP * number as f64;
    let frame = |number: usize| {
        let from = (250.0 * (number / 100) as f64 - (place(number) - 5e6)) as f32;
        vec![car(1, [from + 20.0, from + 24.0], 5.0)]
    };
    let pose = |number: usize| Translation3::new(place(number), 4e6, 0.0).into();
    let found = tracks(&(0..900).map(frame).collect::<Vec<_>>(), pose);
    for (number, found) in found.iter().enumerate() {
        assert_eq!(*found, [whole(1 + (number / 100) as u32)], "{number}");
    }
}

#[test]
fn a_leap_of_the_pose_and_a_long_pause_end_all_tracks() {
    let frames: Vec<Vec<ObservedInstance>> =
        (0..6).map(|_| vec![car(1, [0.0, 4.0], 5.0)]).collect();
    let leap = |number: usize| Translation3::new(if number < 3 { 0.0 } else { 50.0 }, 0.0, 0.0);
    let found = tracks(&frames, |number| leap(number).into());
    assert_eq!(found.concat(), [1, 1, 1, 2, 2, 2].map(whole));

    let mut tracker = Tracker::new(TrackParams::default());
    let mut decided = Vec::new();
    for time in [0.0, 0.1, 60.0, 60.1, 60.1, 50.0] {
        let pose = &Isometry3::identity();
        decided.extend(tracker.push(TrackerFrame { time, pose, instances: &frames[0] }));
    }
    decided.extend(tracker.finish());
    let tracks: Vec<InstanceTrack> = decided.into_iter().flat_map(|frame| frame.tracks).collect();
    assert_eq!(tracks, [1, 1, 2, 2, 3, 4].map(whole));
}

#[test]
fn without_instances_there_are_no_tracks() {
    assert_eq!(tracks(&[vec![], vec![], vec![]], still), [[], [], []] as [[InstanceTrack; 0]; 3]);
    assert_eq!(Tracker::new(TrackParams::default()).finish(), []);
}

#[test]
fn velocity_and_size_are_those_of_the_whole_car() {
    // A car of 4 m passes at 8 m/s, of which 1.5 m are seen at first; the sensor drives ahead.
    let frame = |number: usize| {
        let front = 0.8 * number as f32 - 0.5 * number as f32 + 5.0;
        let seen = if number < 10 { 1.5 } else { 4.0 };
        vec![car(1, [front, front + seen], 6.0), car(2, [20.0 - 0.5 * number as f32, 24.0], 3.0)]
    };
    let drives = |number: usize| Translation3::new(0.5 * number as f64, 0.0, 0.0).into();
    let frames = followed(&(0..40).map(frame).collect::<Vec<_>>(), drives);
    let whole = tracks(&(0..40).map(frame).collect::<Vec<_>>(), drives)[0][0].clone();
    let of = |number: usize| {
        let objects = frames[number].objects.iter();
        let mut of_track = objects.filter(|object| InstanceTrack::Whole(object.track) == whole);
        *of_track.next().expect("the car")
    };
    for number in [15, 20, 30] {
        let velocity = of(number).velocity.expect("a velocity");
        assert!((velocity.along[0] - 8.0).abs() < 0.3, "{number}: {velocity:?}");
        assert!(velocity.is_moving && velocity.error < 0.5, "{velocity:?}");
        let bounds = of(number).bounds;
        assert!((bounds.size[0] - 4.0).abs() < 0.01, "{number}: {bounds:?}");
        let middle = 0.3 * number as f64 + 5.0 + 2.0;
        assert!((bounds.centre[0] - middle).abs() < 0.3, "{number}: {bounds:?} {middle}");
    }
    // What is hidden of it lies behind the face toward the sensor.
    let bounds = of(5).bounds;
    assert!((bounds.size[0] - 4.0).abs() < 0.01, "{bounds:?}");
    assert!((bounds.centre[0] - (0.3 * 5.0 + 5.0 + 2.0)).abs() < 0.5, "{bounds:?}");
}

#[test]
fn more_that_comes_into_sight_is_no_motion() {
    // Of a parked car of 4 m the sensor sees 1.5 m at first, and more as it passes.
    let frame = |number: usize| vec![car(1, [10.0, 11.5 + 0.2 * number.min(12) as f32], 3.0)];
    for frame in followed(&(0..25).map(frame).collect::<Vec<_>>(), still) {
        let [object] = frame.objects.as_slice() else { panic!("{frame:?}") };
        assert!(object.velocity.is_none_or(|velocity| !velocity.is_moving), "{object:?}");
    }
}

#[test]
fn what_stands_is_not_moving_seen_from_a_sensor_that_drives() {
    let frame = |number: usize| vec![car(1, [30.0 - number as f32, 34.0 - number as f32], 3.0)];
    let drives = |number: usize| Translation3::new(number as f64, 0.0, 0.0).into();
    for frame in followed(&(0..25).map(frame).collect::<Vec<_>>(), drives) {
        let [object] = frame.objects.as_slice() else { panic!("{frame:?}") };
        let velocity = object.velocity.expect("a velocity");
        assert!(!velocity.is_moving && velocity.speed() == 0.0, "{velocity:?}");
    }
}

/// Two points of a far car, nearer to its nose in one frame and to its tail in the next.
fn far_car(id: u32, nose: f32, shown: usize) -> ObservedInstance {
    let at = nose + [0.8, 2.4, 1.5, 2.9, 0.9, 2.2][shown % 6];
    let height = [0.4, 1.3, 0.9][shown % 3];
    let cells = [0.0, 0.3].map(|y: f32| [at, y, height].map(|at| (at * 100.0).round() as i16));
    ObservedInstance {
        points: 2,
        size: [0.3, 0.0, 0.0],
        cells: cells.into(),
        ..car(id, [0.0; 2], 0.0)
    }
}

#[test]
fn a_far_car_of_two_points_keeps_its_track() {
    let frame = |number: usize| vec![far_car(1, 60.0, number), far_car(2, 75.0, number + 1)];
    let found = tracks(&(0..30).map(frame).collect::<Vec<_>>(), still);
    for (number, found) in found.iter().enumerate() {
        assert_eq!(*found, [whole(1), whole(2)], "{number}");
    }
}

#[test]
fn the_middle_of_many_points_is_certain_and_that_of_few_is_not() {
    use super::sighting::sampling_variance;
    let error = |points| sampling_variance(Some(Body::Car), points).sqrt();
    // A uniform distribution of 4.5 m has a standard deviation of 1.3 m.
    assert!((error(1) - 1.299).abs() < 1e-3, "{}", error(1));
    assert!((error(100) - 0.13).abs() < 1e-3, "{}", error(100));
    assert_eq!(sampling_variance(None, 1), 0.0);
}
