//! The estimator: scan after scan, a pose each.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::alignment::{Alignment, Fit, small_turn};
use super::scan::RegistrationScan;
use super::surfels::SurfelMap;

/// Steps of a piece after which its velocity is certain: a map of one scan has few surfaces.
const SETTLED: usize = 5;

/// Once the map has its surfaces and the motion is predicted, one of so many points of a scan is
/// enough.
const THINNED: usize = 2;

/// A share of points on surfaces below so much of the usual one says that the prediction was wrong
/// and the motion has to be searched: a vehicle started with a jerk.
const MISLED: f64 = 0.9;

/// How the motion is estimated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EgoMotionParams {
    /// Sides of the voxels of the local map from fine to coarse, metres. 1.5 and 3: with 1 or with
    /// one size, 16 beams leave too few surfaces.
    #[schemars(extend("unit" = "m", "slider" = [0.1, 20.0]))]
    pub voxels: Vec<f64>,
    /// How far the map reaches to each side, metres. 100: what kiss-icp keeps.
    #[schemars(range(max = 1000.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [20.0, 200.0]))]
    pub reach: f64,
    /// Width of the kernel that compares guesses where the motion is unknown, metres. 0.3: they lie
    /// 0.4 apart.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 2.0]))]
    pub first_width: f64,
    /// Width of the robust kernel at first where the motion is predicted, metres. 0.5: by so much a
    /// vehicle departs from constant velocity within a tenth of a second when it brakes hardest.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 2.0]))]
    pub width: f64,
    /// Width to which the kernel narrows, metres. 0.05: twice the noise of a range. With 0.1 the
    /// drift is twice as large.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.01, 0.5]))]
    pub least_width: f64,
    /// By how many points the prediction counts. 0.01: it settles what no surface holds and no
    /// more. With 1 it outweighs the few surfaces that hold the motion along a street.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    #[schemars(extend("unit" = "points", "slider" = [0.0, 10.0]))]
    pub prediction_weight: f64,
    /// Points that a scan needs. 100: fewer are a blocked sensor.
    #[schemars(range(min = 1, max = 1000000), extend("unit" = "points", "slider" = [10, 1000]))]
    pub least_points: usize,
    /// Least share of the points that lie in a voxel with a surface. 0.05: the second scan of 16
    /// beams has 0.2, that of 64 beams among trees 0.08.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub least_matched: f64,
    /// Least share of those that lie on it. 0.5: on drives it is 0.6 or more, in another place
    /// chance gives 0.3.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub least_inliers: f64,
    /// Highest speed, metres a second. 60: 216 km/h.
    #[schemars(range(max = 10000.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m/s", "slider" = [5.0, 100.0]))]
    pub highest_speed: f64,
    /// Highest change of velocity, metres a second squared. 50: five times the hardest braking.
    #[schemars(range(max = 10000.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m/s^2", "slider" = [5.0, 100.0]))]
    pub highest_acceleration: f64,
    /// Highest turn rate, radians a second. 3: a robot that turns on the spot.
    #[schemars(range(max = 1000.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "rad/s", "slider" = [0.5, 6.0]))]
    pub highest_turn_rate: f64,
    /// Longest time that is bridged, seconds. 1: ten scans of most sensors.
    #[schemars(range(min = 0.0, max = 600.0), extend("unit" = "s", "slider" = [0.1, 5.0]))]
    pub longest_gap: f64,
}

impl Default for EgoMotionParams {
    fn default() -> Self {
        EgoMotionParams {
            voxels: vec![1.5, 3.0],
            reach: 100.0,
            first_width: 0.3,
            width: 0.5,
            least_width: 0.05,
            prediction_weight: 0.01,
            least_points: 100,
            least_matched: 0.05,
            least_inliers: 0.5,
            highest_speed: 60.0,
            highest_acceleration: 50.0,
            highest_turn_rate: 3.0,
            longest_gap: 1.0,
        }
    }
}

/// Why a scan has no pose of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LostReason {
    /// The scan has too few points.
    TooFewPoints,
    /// No time has passed since the scan before.
    RepeatedStamp,
    /// Too few points lie where the map has surfaces, or on them.
    NoOverlap,
    /// The motion that fits best is faster than a vehicle moves or turns.
    NotPhysical,
}

/// Where the sensor is, and how it came there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionEstimate {
    /// Pose in the frame of the estimator's first scan. Where the scan is lost, the one predicted.
    pub world_from_sensor: Isometry3<f64>,
    /// Motion since the last scan that was not lost; the identity where this one is lost or where a
    /// piece begins.
    pub previous_from_current: Isometry3<f64>,
    /// Time of that motion, seconds.
    pub step_seconds: f64,
    /// Whether a new piece of the trajectory begins here: nothing ties it to poses before.
    pub began_anew: bool,
    /// How well the scan fits to those before.
    pub fit: Fit,
    /// Why the pose is not to be trusted; `None` if it is.
    pub lost: Option<LostReason>,
}

impl MotionEstimate {
    /// Whether the pose can be trusted.
    pub fn is_tracked(&self) -> bool {
        self.lost.is_none()
    }
}

/// Velocity in the sensor's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Velocity {
    /// Metres a second.
    shift: Vector3<f64>,
    /// Radians a second about the axis.
    turn: Vector3<f64>,
}

impl Velocity {
    const REST: Velocity =
        Velocity { shift: Vector3::new(0.0, 0.0, 0.0), turn: Vector3::new(0.0, 0.0, 0.0) };

    fn of(step: &Isometry3<f64>, seconds: f64) -> Self {
        let rotation = step.rotation.quaternion();
        let turn = 2.0 / rotation.w * rotation.imag();
        Velocity { shift: step.translation.vector / seconds, turn: turn / seconds }
    }

    fn step(&self, seconds: f64) -> Isometry3<f64> {
        let shift = self.shift * seconds;
        Isometry3::from_parts(shift.into(), small_turn(&(self.turn * seconds)))
    }
}

/// Estimates the motion of a sensor, scan by scan.
#[derive(Debug, Clone)]
pub struct EgoMotion {
    params: EgoMotionParams,
    /// Surfaces around the sensor, from fine to coarse.
    maps: Vec<SurfelMap>,
    /// Pose of the last scan that was not lost.
    pose: Isometry3<f64>,
    /// Its velocity; `None` where a piece has one scan.
    velocity: Option<Velocity>,
    /// Seconds since that scan.
    elapsed: f64,
    state: State,
    /// Steps since the piece began.
    steps: usize,
    /// The share of points on surfaces that is usual of late.
    usual_inliers: f64,
    points: Vec<Point3<f64>>,
}

/// What the next scan meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// No scan yet.
    Empty,
    /// The last scan was tracked, or had too few points.
    Tracked,
    /// The last scan did not fit.
    Misfit,
}

impl EgoMotion {
    /// An estimator that has seen nothing.
    pub fn new(params: EgoMotionParams) -> Self {
        EgoMotion {
            maps: params.voxels.iter().map(|&side| SurfelMap::new(side)).collect(),
            params,
            pose: Isometry3::identity(),
            velocity: None,
            elapsed: 0.0,
            state: State::Empty,
            steps: 0,
            usual_inliers: 0.0,
            points: Vec::new(),
        }
    }

    /// The pose of the next scan, `dt` seconds after the one before.
    ///
    /// A scan that does not fit is lost. If the next one does not fit either, or more than
    /// [`longest_gap`](EgoMotionParams::longest_gap) has passed, or time went back, a new piece
    /// begins with it.
    pub fn push(&mut self, scan: &RegistrationScan, dt: f64) -> MotionEstimate {
        let is_first = self.state == State::Empty;
        if dt == 0.0 && !is_first {
            return self.lost(LostReason::RepeatedStamp, Fit::default());
        }
        self.elapsed += dt;
        let is_bridged = dt > 0.0 && self.elapsed <= self.params.longest_gap;
        if scan.len() < self.params.least_points {
            // Later scans cannot be tied to those before an hour without points, or a leap back.
            self.elapsed = if dt > 0.0 { self.elapsed } else { f64::INFINITY };
            let fit = Fit { points: scan.len(), ..Fit::default() };
            return self.lost(LostReason::TooFewPoints, fit);
        }
        let every = if self.steps < SETTLED { 1 } else { THINNED };
        self.points.clear();
        self.points.extend(scan.positions().step_by(every).map(Point3::from));
        if is_first || !is_bridged {
            return self.begin_anew();
        }
        let (pose, fit) = self.aligned();
        let step = self.pose.inv_mul(&pose);
        match self.flaw(&step, &fit) {
            None => self.follow(pose, step, fit),
            Some(_) if self.state == State::Misfit => self.begin_anew(),
            Some(reason) => {
                self.state = State::Misfit;
                self.lost(reason, fit)
            }
        }
    }

    /// The pose that constant velocity leads to.
    fn predicted(&self) -> Isometry3<f64> {
        let seconds = if self.elapsed <= self.params.longest_gap { self.elapsed } else { 0.0 };
        self.pose * self.velocity.unwrap_or(Velocity::REST).step(seconds)
    }

    fn aligned(&self) -> (Isometry3<f64>, Fit) {
        let params = &self.params;
        let predicted = self.predicted();
        let alignment = Alignment {
            maps: &self.maps,
            points: &self.points,
            predicted,
            prediction_weight: params.prediction_weight,
        };
        let mut followed = None;
        if self.velocity.is_some() && self.state == State::Tracked {
            let (pose, fit) = alignment.align(predicted, params.width, params.least_width);
            if fit.inlier_share >= MISLED * self.usual_inliers {
                return (pose, fit);
            }
            followed = Some((pose, fit));
        }
        let guess = first_guess(&alignment, params);
        let alignment = Alignment { predicted: guess, ..alignment };
        let searched = alignment.align(guess, params.least_width, params.least_width);
        let is_better = |(_, fit): &(_, Fit)| fit.inlier_share >= searched.1.inlier_share;
        followed.filter(is_better).unwrap_or(searched)
    }

    /// What speaks against a step.
    fn flaw(&self, step: &Isometry3<f64>, fit: &Fit) -> Option<LostReason> {
        let params = &self.params;
        let (shift, seconds) = (step.translation.vector, self.elapsed);
        let change = self.velocity.map_or(0.0, |before| (shift / seconds - before.shift).norm());
        let turn = Velocity::of(step, seconds).turn.norm();
        let is_physical = shift.norm() <= params.highest_speed * seconds
            && (self.steps < SETTLED || change <= params.highest_acceleration * seconds)
            && turn <= params.highest_turn_rate;
        if fit.matched_share < params.least_matched || fit.inlier_share < params.least_inliers {
            Some(LostReason::NoOverlap)
        } else if !is_physical {
            Some(LostReason::NotPhysical)
        } else {
            None
        }
    }

    fn follow(&mut self, pose: Isometry3<f64>, step: Isometry3<f64>, fit: Fit) -> MotionEstimate {
        let step_seconds = self.elapsed;
        self.velocity = Some(Velocity::of(&step, step_seconds));
        self.pose = pose;
        self.steps += 1;
        let kept = if self.steps == 1 { 0.0 } else { 0.9 };
        self.usual_inliers = kept * self.usual_inliers + (1.0 - kept) * fit.inlier_share;
        self.extend_map();
        MotionEstimate {
            world_from_sensor: pose,
            previous_from_current: step,
            step_seconds,
            began_anew: false,
            fit,
            lost: None,
        }
    }

    fn begin_anew(&mut self) -> MotionEstimate {
        self.maps.iter_mut().for_each(SurfelMap::clear);
        self.velocity = None;
        self.steps = 0;
        self.extend_map();
        MotionEstimate {
            world_from_sensor: self.pose,
            previous_from_current: Isometry3::identity(),
            step_seconds: 0.0,
            began_anew: true,
            fit: Fit { points: self.points.len(), ..Fit::default() },
            lost: None,
        }
    }

    /// Adds the scan at the pose to the map, and forgets what is too far.
    fn extend_map(&mut self) {
        let pose = self.pose;
        let position = Point3::from(pose.translation.vector);
        for map in &mut self.maps {
            map.insert(&position, self.points.iter().map(|point| pose * point));
            map.keep_within(&position, self.params.reach);
        }
        (self.elapsed, self.state) = (0.0, State::Tracked);
    }

    fn lost(&self, reason: LostReason, fit: Fit) -> MotionEstimate {
        MotionEstimate {
            world_from_sensor: self.predicted(),
            previous_from_current: Isometry3::identity(),
            step_seconds: 0.0,
            began_anew: false,
            fit,
            lost: Some(reason),
        }
    }
}

/// A pose where the motion is unknown: of each way the guess that fits best is aligned with some of
/// the points, and the best of these is taken.
fn first_guess(alignment: &Alignment, params: &EgoMotionParams) -> Isometry3<f64> {
    const EVERY: usize = 4;
    /// Ways in metres.
    const WAYS: [f64; 7] = [0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4];
    let some: Vec<Point3<f64>> = alignment.points.iter().copied().step_by(EVERY).collect();
    let some = Alignment { points: &some, ..*alignment };
    let best_of = |poses: &mut dyn Iterator<Item = Isometry3<f64>>, width: f64| {
        let mut best = (0.0, alignment.predicted);
        for pose in poses {
            let score = some.score(&pose, width);
            if score > best.0 {
                best = (score, pose);
            }
        }
        best.1
    };
    let aligned = |way: f64| {
        let guess = best_of(&mut guesses(&alignment.predicted, way), params.first_width);
        Alignment { predicted: guess, ..some }.align(guess, params.width, params.least_width).0
    };
    best_of(&mut WAYS.into_iter().map(aligned), params.least_width)
}

/// Poses a way from one, in metres: in eight directions, and with five headings each.
fn guesses(from: &Isometry3<f64>, way: f64) -> impl Iterator<Item = Isometry3<f64>> {
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
    /// Cosines and sines of eighths of a turn.
    const DIRECTIONS: [[f64; 2]; 8] = [
        [1.0, 0.0],
        [HALF, HALF],
        [0.0, 1.0],
        [-HALF, HALF],
        [-1.0, 0.0],
        [-HALF, -HALF],
        [0.0, -1.0],
        [HALF, -HALF],
    ];
    /// Turns to the left, radians: two degrees each.
    const TURNS: [f64; 5] = [0.0, 0.035, -0.035, 0.07, -0.07];
    let directions = if way > 0.0 { &DIRECTIONS[..] } else { &DIRECTIONS[..1] };
    let shifts = directions.iter().map(move |[x, y]| Translation3::new(way * x, way * y, 0.0));
    shifts.flat_map(move |shift| {
        let turns = TURNS.map(|turn| small_turn(&Vector3::new(0.0, 0.0, turn)));
        turns.map(|turn| from * Isometry3::from_parts(shift, turn))
    })
}
