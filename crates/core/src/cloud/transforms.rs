//! How the frames of a recording stand to each other, at rest and over time.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use nalgebra::{Isometry3, Vector3};

/// Names of frames that stand upright on the vehicle, in ROS's and others' customs.
pub const VEHICLE_FRAMES: [&str; 9] = [
    "base_link",
    "base_footprint",
    "base",
    "vehicle",
    "ego_vehicle",
    "ego",
    "chassis",
    "rear_axle",
    "car",
];

/// Words in the names of the frames of sensors that measure clouds.
const SENSOR_WORDS: [&str; 17] = [
    "lidar",
    "laser",
    "velodyne",
    "vlp",
    "hdl",
    "ouster",
    "os_sensor",
    "os0",
    "os1",
    "os2",
    "hesai",
    "pandar",
    "robosense",
    "rslidar",
    "livox",
    "sensor",
    "scanner",
];

/// Words in the names of frames that are no such sensor's, though another word says so.
const OTHER_WORDS: [&str; 5] = ["imu", "camera", "optical", "radar", "gps"];

/// How frames stand to each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Transforms {
    /// By parent and child: the pose of the child in the parent, where it does not change.
    poses: BTreeMap<Pair, Isometry3<f64>>,
    /// The same where it does.
    tracks: BTreeMap<Pair, Track>,
}

/// The names of two frames, the parent's first.
pub type Pair = (String, String);

/// The pose of a frame in its parent over time: nanoseconds since 1970, ascending, and poses.
#[derive(Debug, Clone, PartialEq, Default)]
struct Track(Vec<(i64, Isometry3<f64>)>);

impl Track {
    fn insert(&mut self, stamp_ns: i64, pose: Isometry3<f64>) {
        let place = self.0.partition_point(|(stamp, _)| *stamp < stamp_ns);
        match self.0.get_mut(place) {
            Some((stamp, known)) if *stamp == stamp_ns => *known = pose,
            _ => self.0.insert(place, (stamp_ns, pose)),
        }
    }

    /// The pose at a time, between those before and after it, as tf2 has it: the place on a
    /// straight line and the rotation at a constant rate. `None` before the first, after the last,
    /// and where two poses are farther apart than tf2 remembers.
    fn at(&self, stamp_ns: i64) -> Option<Isometry3<f64>> {
        /// Nanoseconds that a buffer of tf2 goes back unless told otherwise.
        const LONGEST: i64 = 10_000_000_000;
        let place = self.0.partition_point(|(stamp, _)| *stamp < stamp_ns);
        let &(after, next) = self.0.get(place)?;
        if after == stamp_ns {
            return Some(next);
        }
        let &(before, last) = self.0.get(place.checked_sub(1)?)?;
        let span = after.checked_sub(before).filter(|span| *span <= LONGEST)?;
        let share = (stamp_ns - before) as f64 / span as f64;
        let along = last.translation.vector.lerp(&next.translation.vector, share);
        let turned = last.rotation.try_slerp(&next.rotation, share, 1e-12);
        Some(Isometry3::from_parts(along.into(), turned.unwrap_or(next.rotation)))
    }
}

impl Transforms {
    /// Takes in the pose of a child's frame in its parent's, metres; a later word on the same two
    /// replaces an earlier one.
    pub fn insert(&mut self, parent: &str, child: &str, pose: Isometry3<f64>) {
        self.poses.insert(Transforms::pair((parent, child)), pose);
    }

    /// Takes in the pose of a child's frame in its parent's at a time, nanoseconds since 1970.
    pub fn insert_at(&mut self, stamp_ns: i64, frames: (&str, &str), pose: Isometry3<f64>) {
        self.tracks.entry(Transforms::pair(frames)).or_default().insert(stamp_ns, pose);
    }

    /// The names of a parent's frame and a child's as they are told apart: ROS 1 wrote some with a
    /// slash before them.
    pub fn pair((parent, child): (&str, &str)) -> Pair {
        let name = |frame: &str| frame.trim_start_matches('/').to_owned();
        (name(parent), name(child))
    }

    /// Forgets the frames that move.
    pub fn forget_moving(&mut self) {
        self.tracks.clear();
    }

    /// Whether a frame is no sensor's own by its name, and none leads from it to a sensor that does
    /// not move.
    pub fn lacks_sensor_at_rest(&self, frame_id: &str) -> bool {
        !is_sensor(frame_id) && self.sensors_in(frame_id).is_empty()
    }

    /// How the frames stand to each other at a time, nanoseconds since 1970; those that move only
    /// where that is known.
    pub fn at(&self, stamp_ns: i64) -> Cow<'_, Transforms> {
        if self.tracks.is_empty() {
            return Cow::Borrowed(self);
        }
        self.fixed(|track| track.at(stamp_ns))
    }

    /// Whether the recording has the place of a sensor in a frame, but not at a time.
    pub fn is_missing_at(&self, frame_id: &str, stamp_ns: i64) -> bool {
        let has_sensor = |transforms: &Transforms| !transforms.sensors_in(frame_id).is_empty();
        !self.tracks.is_empty()
            && !has_sensor(&self.at(stamp_ns))
            && has_sensor(&self.fixed(|track| track.0.first().map(|(_, pose)| *pose)))
    }

    /// The pairs of frames on the ways from a frame to sensors whose poses change.
    pub fn moving_pairs_to_sensors(&self, frame_id: &str) -> BTreeSet<Pair> {
        if is_sensor(frame_id) {
            return BTreeSet::new();
        }
        let fixed = self.fixed(|track| track.0.first().map(|(_, pose)| *pose));
        let reached = fixed.reachable(frame_id).into_iter();
        let ways =
            reached.filter(|reached| is_sensor(&reached.frame)).flat_map(|reached| reached.way);
        ways.filter(|pair| self.tracks.contains_key(pair)).collect()
    }

    /// With one pose for each track that has one.
    fn fixed(&self, pose: impl Fn(&Track) -> Option<Isometry3<f64>>) -> Cow<'_, Transforms> {
        let mut poses = self.poses.clone();
        let moving = self.tracks.iter();
        poses.extend(moving.filter_map(|(pair, track)| Some((pair.clone(), pose(track)?))));
        Cow::Owned(Transforms { poses, tracks: BTreeMap::new() })
    }

    /// The upward direction of the vehicle in a frame, if a chain of transforms leads from there to
    /// a frame of the vehicle. Of several the nearest counts.
    pub fn up_in(&self, frame_id: &str) -> Option<Vector3<f64>> {
        let mut reachable = self.reachable(frame_id).into_iter();
        let vehicle = reachable.find(|at| VEHICLE_FRAMES.contains(&at.frame.as_str()));
        vehicle.map(|at| at.pose * Vector3::z())
    }

    /// Where sensors stand in a frame that is no sensor's own by its name, metres.
    pub fn sensors_in(&self, frame_id: &str) -> Vec<Vector3<f64>> {
        if is_sensor(frame_id) {
            return Vec::new();
        }
        let sensors = self.reachable(frame_id).into_iter().filter(|at| is_sensor(&at.frame));
        sensors.map(|at| at.pose.translation.vector).collect()
    }

    /// A frame and those that a chain of transforms leads to, the nearest first.
    fn reachable(&self, frame_id: &str) -> Vec<Reached> {
        let frame = frame_id.trim_start_matches('/').to_owned();
        let mut seen = BTreeSet::from([frame.clone()]);
        let mut found = Vec::new();
        let start = Reached { frame, pose: Isometry3::identity(), way: Vec::new() };
        let mut queue = VecDeque::from([start]);
        while let Some(at) = queue.pop_front() {
            for (pair, parent_from_child) in &self.poses {
                let (parent, child) = pair;
                let (next, pose) = match &at.frame {
                    frame if frame == child => (parent, parent_from_child.inverse()),
                    frame if frame == parent => (child, *parent_from_child),
                    _ => continue,
                };
                if seen.insert(next.clone()) {
                    let way = at.way.iter().chain([pair]).cloned().collect();
                    queue.push_back(Reached { frame: next.clone(), pose: at.pose * pose, way });
                }
            }
            found.push(at);
        }
        found
    }

    /// The pairs of frames that are known, in words.
    pub(super) fn describe(&self) -> String {
        let pairs = self
            .poses
            .keys()
            .chain(self.tracks.keys())
            .map(|(parent, child)| format!("{parent} <- {child}"));
        match pairs.collect::<Vec<_>>().join(", ") {
            none if none.is_empty() => "none".to_owned(),
            some => some,
        }
    }
}

/// A frame that transforms lead to from another.
struct Reached {
    frame: String,
    /// Its pose in the frame that the way begins at.
    pose: Isometry3<f64>,
    /// The pairs of frames on the way.
    way: Vec<Pair>,
}

/// Whether a frame is that of a sensor by its name.
fn is_sensor(frame: &str) -> bool {
    let name = frame.to_lowercase();
    let has = |words: &[&str]| words.iter().any(|word| name.contains(word));
    has(&SENSOR_WORDS) && !has(&OTHER_WORDS)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion};

    use super::*;

    fn moved(x: f64, yaw: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
        Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), turn)
    }

    #[test]
    fn poses_between_two_times_lie_between_them() {
        let mut transforms = Transforms::default();
        transforms.insert("base_link", "lidar", Isometry3::translation(0.0, 0.0, 1.8));
        // Out of order, as two publishers make them.
        for (second, x, yaw) in [(4, 8.0, 0.0), (0, 0.0, 0.0), (2, 4.0, 1.0), (20, 9.0, 0.0)] {
            transforms.insert_at(second * 1_000_000_000, ("map", "base_link"), moved(x, yaw));
        }
        let pose = |seconds: f64| {
            let at = transforms.at((seconds * 1e9) as i64).into_owned();
            let found = at.reachable("/map").into_iter().find(|at| at.frame == "lidar");
            found.map(|found| (found.pose.translation.vector, found.pose.rotation.angle()))
        };
        for (seconds, x, yaw) in
            [(0.0, 0.0, 0.0), (0.5, 1.0, 0.25), (2.0, 4.0, 1.0), (3.5, 7.0, 0.25)]
        {
            let (place, angle) = pose(seconds).expect("between the first and the last");
            assert!((place - Vector3::new(x, 0.0, 1.8)).norm() < 1e-9, "{seconds}: {place}");
            assert!((angle - yaw).abs() < 1e-9, "{seconds}: {angle}");
        }
        for seconds in [-0.1, 20.1, 12.0] {
            assert_eq!(pose(seconds), None, "{seconds}");
            assert!(transforms.is_missing_at("map", (seconds * 1e9) as i64), "{seconds}");
        }
        assert!(!transforms.is_missing_at("map", 1));
        assert!(!transforms.is_missing_at("lidar", -1) && !transforms.is_missing_at("other", -1));
    }

    #[test]
    fn the_moving_pairs_on_the_way_to_a_sensor_are_known() {
        let mut transforms = Transforms::default();
        transforms.insert("base_link", "lidar", Isometry3::identity());
        for child in ["odom", "person"] {
            transforms.insert_at(5, ("map", child), Isometry3::identity());
        }
        transforms.insert_at(5, ("odom", "base_link"), Isometry3::identity());
        let names = |parent: &str, child: &str| (parent.to_owned(), child.to_owned());
        let all = BTreeSet::from([names("map", "odom"), names("odom", "base_link")]);
        assert_eq!(transforms.moving_pairs_to_sensors("/map"), all);
        assert_eq!(transforms.moving_pairs_to_sensors("lidar"), BTreeSet::new());
        assert_eq!(transforms.moving_pairs_to_sensors("base_link"), BTreeSet::new());
    }
}
