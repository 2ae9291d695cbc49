//! The motion of a topic's sensor from cloud to cloud: as the recording has it where that agrees
//! with the clouds, else as the clouds show it.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;

use super::observation::CloudObservation;
use super::options::EgoMotionSource;
use super::recorded_motion::RecordedSource;
use divmerge_core::over_time::ego_motion::{EgoMotion, EgoMotionParams, RegistrationScan};

/// A recorded motion is compared with the clouds until the sensor has gone so far, metres, or
/// turned so far, radians: by then both are many times the errors of a registration.
const COMPARED_OVER: (f64, f64) = (5.0, 0.3);

/// The part of the way, and of the turn, by which a recorded motion may differ. 0.05: wheels that
/// are worn or slip are wrong by a few percent; a wrong frame or a drive of another vehicle by
/// much more.
const MAY_DIFFER: f64 = 0.05;

/// The same at rest, metres and radians.
const MAY_DIFFER_AT_REST: (f64, f64) = (0.1, 0.02);

/// The part of the way by which one may differ that heads where it drives, and at rest by so many
/// radians: its heading is that of a chord of two metres, between places of centimetres, and all of
/// the way is laid along the first.
const MAY_DIFFER_DRIVEN: (f64, f64) = (0.15, 0.1);

/// Most comparisons that are reported.
const MOST_COMPARISONS: usize = 8;

/// The poses of a topic's sensor, cloud after cloud.
pub(super) struct SensorMotion {
    source: EgoMotionSource,
    estimation: EgoMotionParams,
    estimator: EgoMotion,
    /// The recorded motions that are compared with the clouds.
    compared: BTreeMap<RecordedSource, Comparison>,
    /// The one that is used, and where its world lies in the one of the poses.
    used: Option<(RecordedSource, Isometry3<f64>)>,
    last: Option<Step>,
    report: MotionReport,
}

/// Where the motion of the sensor came from.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct MotionReport {
    /// Clouds, by what said where they are.
    pub sources: BTreeMap<String, u64>,
    /// How recorded motions compare with the clouds, in words.
    pub comparisons: Vec<String>,
    /// Those of them that contradict the clouds.
    #[serde(skip)]
    contradictions: Vec<String>,
    /// Why tracks ended where no recorded motion leads on, and how often.
    pub breaks: BTreeMap<String, u64>,
}

impl MotionReport {
    /// Whether no cloud was followed.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// What is worth a warning: what contradicts the clouds, and why tracks ended.
    pub(in crate::annotate) fn warnings(&self) -> impl Iterator<Item = String> {
        let contradictions = self
            .contradictions
            .iter()
            .map(|found| format!("the motion of the sensor: {found}; it is not used"));
        let breaks = self.breaks.iter().map(|(why, count)| {
            let times = if *count == 1 { "once".to_owned() } else { format!("{count} times") };
            format!("all tracks end and begin anew {times}: {why}")
        });
        contradictions.chain(breaks)
    }
}

/// The last pose, and the motion that led there.
#[derive(Clone, Copy)]
struct Step {
    pose: Isometry3<f64>,
    /// Metres a second; `None` at the first.
    velocity: Option<Vector3<f64>>,
}

/// A recorded motion beside the one that the clouds show.
struct Comparison {
    /// The first pose of both: recorded, and estimated.
    first: [Isometry3<f64>; 2],
    /// Whether the recorded one heads where it drives.
    is_driven: bool,
    /// The way of both, metres.
    ways: [f64; 2],
    last: [Isometry3<f64>; 2],
    /// Whether they agree, once that is known.
    agrees: Option<bool>,
}

impl Comparison {
    fn new(poses: [Isometry3<f64>; 2], is_driven: bool) -> Self {
        Comparison { first: poses, is_driven, ways: [0.0; 2], last: poses, agrees: None }
    }

    /// Takes the next poses; what is found out, in words, once the sensor has moved enough.
    fn push(&mut self, poses: [Isometry3<f64>; 2]) -> Option<String> {
        if self.agrees.is_some() {
            return None;
        }
        for (k, pose) in poses.iter().enumerate() {
            self.ways[k] += (pose.translation.vector - self.last[k].translation.vector).norm();
        }
        self.last = poses;
        let [recorded, shown] = [0, 1].map(|k| self.first[k].inv_mul(&poses[k]));
        let turns = [recorded.rotation.angle(), shown.rotation.angle()];
        let most = |values: [f64; 2]| values[0].max(values[1]);
        if most(self.ways) < COMPARED_OVER.0 && most(turns) < COMPARED_OVER.1 {
            return None;
        }
        let error = recorded.inv_mul(&shown);
        let (shift, turn) = (error.translation.vector.norm(), error.rotation.angle());
        let (way, turned) = (self.ways[1], turns[1]);
        let (of_way, at_rest) = match self.is_driven {
            true => MAY_DIFFER_DRIVEN,
            false => (MAY_DIFFER, MAY_DIFFER_AT_REST.1),
        };
        let agrees =
            shift <= MAY_DIFFER_AT_REST.0 + of_way * way && turn <= at_rest + MAY_DIFFER * turned;
        self.agrees = Some(agrees);
        let (shift, turn, turned) = (shift, turn.to_degrees(), turned.to_degrees());
        let verdict = if agrees { "agrees with" } else { "contradicts" };
        Some(format!(
            "{verdict} the clouds: {shift:.2} m and {turn:.2} degrees apart after {way:.1} m and \
             {turned:.0} degrees"
        ))
    }
}

/// The pose of a cloud's sensor.
pub(super) struct SensorPose {
    /// From the cloud's frame to one that stands still, metres.
    pub(super) world_from_cloud: Isometry3<f64>,
    /// Whether it has nothing to do with those before.
    pub(super) began_anew: bool,
}

impl SensorMotion {
    pub(super) fn new(source: &EgoMotionSource, estimation: &EgoMotionParams) -> Self {
        SensorMotion {
            source: source.clone(),
            estimator: EgoMotion::new(estimation.clone()),
            estimation: estimation.clone(),
            compared: BTreeMap::new(),
            used: None,
            last: None,
            report: MotionReport::default(),
        }
    }

    pub(super) fn report(&self) -> &MotionReport {
        &self.report
    }

    /// The pose of the next cloud, `step` seconds after the one before, and what the recording says
    /// of where its frame is.
    pub(super) fn push(
        &mut self,
        observation: &CloudObservation,
        recorded: &BTreeMap<RecordedSource, Isometry3<f64>>,
        step: f64,
    ) -> SensorPose {
        // Of the cloud as it was clustered, which may be turned upright.
        let recorded: BTreeMap<&RecordedSource, Isometry3<f64>> =
            recorded.iter().map(|(source, pose)| (source, pose * observation.place)).collect();
        let pose = match &self.source {
            EgoMotionSource::None => self.still(observation),
            _ if observation.stands_still => self.still(observation),
            EgoMotionSource::Estimate => self.estimated(observation, step),
            EgoMotionSource::Transforms | EgoMotionSource::Topic(_) => {
                self.as_recorded(recorded.first_key_value(), step)
            }
            EgoMotionSource::Auto => self.best(observation, &recorded, step),
        };
        let velocity = self.last.map(|last| {
            let moved = pose.world_from_cloud.translation.vector - last.pose.translation.vector;
            moved / step.max(1e-3)
        });
        let velocity = velocity.filter(|_| !pose.began_anew);
        self.last = Some(Step { pose: pose.world_from_cloud, velocity });
        pose
    }

    /// The pose in a frame that stands still.
    fn still(&mut self, observation: &CloudObservation) -> SensorPose {
        self.count("the frame of the clouds, which stands still");
        SensorPose { world_from_cloud: observation.place, began_anew: false }
    }

    /// The pose as the clouds show it.
    fn estimated(&mut self, observation: &CloudObservation, step: f64) -> SensorPose {
        self.count("the clouds");
        let scan = RegistrationScan::from_bytes(&observation.scan).unwrap_or_default();
        let estimate = self.estimator.push(&scan, step);
        SensorPose { world_from_cloud: estimate.world_from_sensor, began_anew: estimate.began_anew }
    }

    /// The pose as one source has it, whatever the clouds show.
    fn as_recorded(
        &mut self,
        recorded: Option<(&&RecordedSource, &Isometry3<f64>)>,
        step: f64,
    ) -> SensorPose {
        let Some((source, pose)) = recorded else {
            self.count("nothing: no pose is recorded at the time of the cloud");
            let used = self.used.take();
            let began_anew = used.is_some();
            used.into_iter().for_each(|(used, _)| self.note_break(format!("{used} says nothing")));
            let world_from_cloud = self.last.map_or_else(Isometry3::identity, |last| last.pose);
            return SensorPose { world_from_cloud, began_anew };
        };
        self.count(&source.to_string());
        let is_other = self.used.as_ref().is_none_or(|(used, _)| used != *source);
        // The first pose leads on from none.
        let jumps = self.used.is_some() && self.jumps_to(pose, step);
        if jumps {
            self.note_break(format!("{source} jumps"));
        }
        let began_anew = is_other || jumps;
        if began_anew {
            self.used = Some(((*source).clone(), Isometry3::identity()));
        }
        SensorPose { world_from_cloud: *pose, began_anew }
    }

    /// The pose as a recorded motion has it that agrees with the clouds, else as these show it.
    fn best(
        &mut self,
        observation: &CloudObservation,
        recorded: &BTreeMap<&RecordedSource, Isometry3<f64>>,
        step: f64,
    ) -> SensorPose {
        if let Some((source, world)) = &self.used {
            let found = recorded.get(source).map(|pose| world * pose);
            let name = source.to_string();
            match found.filter(|pose| !self.jumps_to(pose, step)) {
                Some(world_from_cloud) => {
                    self.count(&name);
                    return SensorPose { world_from_cloud, began_anew: false };
                }
                None => {
                    let why = if found.is_some() { "jumps" } else { "says nothing" };
                    self.note_break(format!("{name} {why}"));
                    self.used = None;
                    self.compared.clear();
                    self.estimator = EgoMotion::new(self.estimation.clone());
                    let estimated = self.estimated(observation, step);
                    return SensorPose { began_anew: true, ..estimated };
                }
            }
        }
        let estimated = self.estimated(observation, step);
        if estimated.began_anew {
            self.compared.clear();
        }
        self.compare(recorded, &estimated.world_from_cloud);
        let agreeing = self.compared.iter().find(|(_, found)| found.agrees == Some(true));
        if let Some((source, _)) = agreeing
            && let Some(pose) = recorded.get(source)
        {
            self.used = Some((source.clone(), estimated.world_from_cloud * pose.inverse()));
        }
        estimated
    }

    /// Compares what is recorded with what the clouds show.
    fn compare(
        &mut self,
        recorded: &BTreeMap<&RecordedSource, Isometry3<f64>>,
        shown: &Isometry3<f64>,
    ) {
        // One that says nothing of a cloud begins anew.
        self.compared
            .retain(|source, found| recorded.contains_key(source) || found.agrees.is_some());
        for (&source, pose) in recorded {
            match self.compared.get_mut(source) {
                None => {
                    let comparison =
                        Comparison::new([*pose, *shown], source.heads_where_it_drives());
                    self.compared.insert(source.clone(), comparison);
                }
                Some(comparison) => {
                    let Some(found) = comparison.push([*pose, *shown]) else { continue };
                    if self.report.comparisons.len() < MOST_COMPARISONS {
                        let found = format!("{source} {found}");
                        if comparison.agrees == Some(false) {
                            self.report.contradictions.push(found.clone());
                        }
                        self.report.comparisons.push(found);
                    }
                }
            }
        }
    }

    /// Whether no vehicle comes to a pose in so many seconds.
    fn jumps_to(&self, pose: &Isometry3<f64>, step: f64) -> bool {
        let Some(last) = self.last else { return false };
        let EgoMotionParams { highest_speed, highest_acceleration, highest_turn_rate, .. } =
            self.estimation;
        let seconds = step.max(1e-3);
        let velocity = (pose.translation.vector - last.pose.translation.vector) / seconds;
        let change = last.velocity.map_or(0.0, |before| (velocity - before).norm());
        let turn = last.pose.rotation.angle_to(&pose.rotation);
        velocity.norm() > highest_speed
            || change > highest_acceleration * seconds + 1.0
            || turn > highest_turn_rate * seconds + 0.1
    }

    fn count(&mut self, source: &str) {
        *self.report.sources.entry(source.to_owned()).or_default() += 1;
    }

    fn note_break(&mut self, problem: String) {
        *self.report.breaks.entry(problem).or_default() += 1;
    }
}
