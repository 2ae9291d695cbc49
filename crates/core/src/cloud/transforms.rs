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

/// Names of frames that stand still, by ROS's custom (REP 105); `odom` first, which never jumps.
pub const WORLD_FRAMES: [&str; 4] = ["odom", "map", "world", "earth"];

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
    moving: BTreeMap<Pair, Trajectory>,
}

/// The names of two frames, the parent's first.
pub type Pair = (String, String);

/// The pose of a frame in another over time: nanoseconds since 1970, ascending, and poses.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory(VecDeque<(i64, Isometry3<f64>)>);

impl Trajectory {
    /// Takes in the pose at a time, nanoseconds since 1970; it replaces another at that time.
    pub fn insert(&mut self, stamp_ns: i64, pose: Isometry3<f64>) {
        let place = self.0.partition_point(|(stamp, _)| *stamp < stamp_ns);
        match self.0.get_mut(place) {
            Some((stamp, known)) if *stamp == stamp_ns => *known = pose,
            _ => self.0.insert(place, (stamp_ns, pose)),
        }
    }

    /// Forgets the poses before the last one at or before a time.
    pub fn forget_before(&mut self, stamp_ns: i64) {
        let later = self.0.partition_point(|(stamp, _)| *stamp <= stamp_ns);
        self.0.drain(..later.saturating_sub(1));
    }

    /// The pose at a time, between those before and after it, as tf2 has it: the place on a
    /// straight line and the rotation at a constant rate. `None` before the first, after the last,
    /// and where two poses are farther apart than tf2 remembers.
    pub fn at(&self, stamp_ns: i64) -> Option<Isometry3<f64>> {
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
        self.moving.entry(Transforms::pair(frames)).or_default().insert(stamp_ns, pose);
    }

    /// The names of a parent's frame and a child's as they are told apart: ROS 1 wrote some with a
    /// slash before them.
    pub fn pair((parent, child): (&str, &str)) -> Pair {
        let name = |frame: &str| frame.trim_start_matches('/').to_owned();
        (name(parent), name(child))
    }

    /// Forgets how frames moved before a time, nanoseconds since 1970.
    pub fn forget_before(&mut self, stamp_ns: i64) {
        self.moving.values_mut().for_each(|trajectory| trajectory.forget_before(stamp_ns));
    }

    /// Forgets the frames that move.
    pub fn forget_moving(&mut self) {
        self.moving.clear();
    }

    /// Whether a frame is no sensor's own by its name, and none leads from it to a sensor that does
    /// not move.
    pub fn lacks_sensor_at_rest(&self, frame_id: &str) -> bool {
        !is_sensor(frame_id) && self.sensors_in(frame_id).is_empty()
    }

    /// How the frames stand to each other at a time, nanoseconds since 1970; those that move only
    /// where that is known.
    pub fn at(&self, stamp_ns: i64) -> Cow<'_, Transforms> {
        if self.moving.is_empty() {
            return Cow::Borrowed(self);
        }
        self.fixed(|trajectory| trajectory.at(stamp_ns))
    }

    /// Whether the recording has the place of a sensor in a frame, but not at a time.
    pub fn is_missing_at(&self, frame_id: &str, stamp_ns: i64) -> bool {
        let has_sensor = |transforms: &Transforms| !transforms.sensors_in(frame_id).is_empty();
        !self.moving.is_empty()
            && !has_sensor(&self.at(stamp_ns))
            && has_sensor(&self.fixed(|trajectory| trajectory.0.front().map(|(_, pose)| *pose)))
    }

    /// The pairs of frames on the ways from a frame to sensors whose poses change.
    pub fn moving_pairs_to_sensors(&self, frame_id: &str) -> BTreeSet<Pair> {
        if is_sensor(frame_id) {
            return BTreeSet::new();
        }
        let fixed = self.fixed(|trajectory| trajectory.0.front().map(|(_, pose)| *pose));
        let reached = fixed.reachable(frame_id).into_iter();
        let ways =
            reached.filter(|reached| is_sensor(&reached.frame)).flat_map(|reached| reached.way);
        ways.filter(|pair| self.moving.contains_key(pair)).collect()
    }

    /// With one pose for each pair that moves and has one.
    fn fixed(&self, pose: impl Fn(&Trajectory) -> Option<Isometry3<f64>>) -> Cow<'_, Transforms> {
        let mut poses = self.poses.clone();
        let moving = self.moving.iter();
        poses.extend(moving.filter_map(|(pair, found)| Some((pair.clone(), pose(found)?))));
        Cow::Owned(Transforms { poses, moving: BTreeMap::new() })
    }

    /// A frame that stands still, and the pose of another in it at a time, nanoseconds since 1970,
    /// metres: of the frames that it moves in, the first of [`WORLD_FRAMES`], else the farthest.
    /// `None` where it moves in none at that time.
    pub fn pose_in_world(&self, frame_id: &str, stamp_ns: i64) -> Option<(String, Isometry3<f64>)> {
        let reached = self.at(stamp_ns).reachable(frame_id);
        let has_moved =
            |reached: &&Reached| reached.way.iter().any(|pair| self.moving.contains_key(pair));
        let moves_in = || reached.iter().filter(has_moved);
        let is_named = |reached: &&Reached, name: &str| {
            reached.frame.rsplit('/').next().is_some_and(|last| last == name)
        };
        let named = |name| moves_in().find(|reached| is_named(reached, name));
        let is_parent = |reached: &&Reached| {
            reached.way.last().is_some_and(|(parent, _)| *parent == reached.frame)
        };
        let world = WORLD_FRAMES.into_iter().find_map(named);
        let world = world.or_else(|| moves_in().rfind(is_parent))?;
        Some((world.frame.clone(), world.pose.inverse()))
    }

    /// The pose of a frame in another that stands still to it, metres.
    pub fn pose_at_rest(&self, frame_id: &str, in_frame: &str) -> Option<Isometry3<f64>> {
        let wanted = in_frame.trim_start_matches('/');
        let at_rest = Transforms { poses: self.poses.clone(), moving: BTreeMap::new() };
        let found = at_rest.reachable(frame_id).into_iter().find(|at| at.frame == wanted)?;
        Some(found.pose.inverse())
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
            .chain(self.moving.keys())
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
    fn a_frame_that_stands_still_is_found() {
        let mut transforms = Transforms::default();
        transforms.insert("base_link", "lidar", moved(1.0, 0.0));
        assert_eq!(transforms.pose_in_world("lidar", 5), None);
        for (stamp, x) in [(0, 0.0), (10, 4.0)] {
            transforms.insert_at(stamp, ("start", "base_link"), moved(x, 0.0));
        }
        let (name, pose) = transforms.pose_in_world("/lidar", 5).expect("a world");
        assert_eq!((name.as_str(), pose.translation.vector.x), ("start", 3.0));
        assert_eq!(transforms.pose_in_world("lidar", 11), None);
        // As some publish it: the odometry's frame below the vehicle's.
        for (stamp, x) in [(0, 0.0), (10, -4.0)] {
            transforms.insert_at(stamp, ("base_link", "car1/odom"), moved(x, 0.0));
        }
        let (name, pose) = transforms.pose_in_world("lidar", 5).expect("a world");
        assert_eq!((name.as_str(), pose.translation.vector.x), ("car1/odom", 3.0));
        transforms.forget_before(9);
        assert!(transforms.pose_in_world("lidar", 5).is_some());
        transforms.forget_before(10);
        assert_eq!(transforms.pose_in_world("lidar", 5), None);
        let at_rest = transforms.pose_at_rest("lidar", "base_link").expect("a pose");
        assert_eq!(at_rest.translation.vector.x, 1.0);
        assert_eq!(transforms.pose_at_rest("lidar", "start"), None);
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
