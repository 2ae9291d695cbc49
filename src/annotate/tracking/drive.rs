//! A topic of a recording, followed while nothing is written: for figures and explanations.

use std::ops::RangeBounds;
use std::path::Path;

use nalgebra::{Isometry3, Point3};
use serde::Serialize;

use super::follower::{Decided, TopicFollower};
use super::observation::observe_cloud;
use super::options::TrackOptions;
use super::recorded_motion::RecordedMotion;
use super::sensor_motion::MotionReport;
use super::summary::TrackSummary;
use crate::annotate::clustered::{Clustered, cluster};
use crate::annotate::config::AnnotateConfig;
use crate::annotate::types::Placement;
use crate::error::{Error, NoCloud, Result};
use crate::frames::EncodedClouds;
use divmerge_core::cloud::PointCloud;
use divmerge_core::over_time::{InstanceTrack, ObservedInstance, TrackLink, TrackedObject};
use divmerge_recording::Overview;

/// Returns of a cloud that are kept, about.
const SURROUNDINGS: usize = 1500;

/// A topic of a recording, followed from cloud to cloud.
#[derive(Debug, Clone)]
pub struct FollowedDrive {
    /// Its topic.
    pub topic: String,
    /// Its clouds in their order; those that cannot be read are left out.
    pub clouds: Vec<FollowedCloud>,
    /// Its objects, by the number of their track.
    pub tracks: Vec<TrackSummary>,
    /// Where the motion of the sensor came from.
    pub motion: MotionReport,
    /// Clouds that could not be read.
    pub unreadable: u64,
}

/// A cloud whose objects are followed.
#[derive(Debug, Clone)]
pub struct FollowedCloud {
    /// Number of the cloud on its topic, from 0.
    pub number: u64,
    /// From the cloud as it was clustered, z up, to a frame that stands still, metres.
    pub world_from_cloud: Isometry3<f64>,
    /// Whether that frame has nothing to do with the one before.
    pub began_anew: bool,
    /// Its instances, by their ids.
    pub instances: Vec<FollowedInstance>,
    /// Its objects as their tracks know them; background is none.
    pub objects: Vec<TrackedObject>,
    /// Some returns above the ground in the frame that stands still, x and y in metres.
    pub surroundings: Vec<[f32; 2]>,
}

/// An instance of a cloud, and its track.
#[derive(Debug, Clone)]
pub struct FollowedInstance {
    /// Its id in the cloud.
    pub id: u32,
    /// Its points.
    pub points: u32,
    /// Its track.
    pub track: InstanceTrack,
    /// Why it continues one.
    pub link: TrackLink,
}

/// How far a drive has been followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FollowProgress {
    /// Clouds so far.
    pub clouds: u64,
    /// All clouds of the topic.
    pub of: u64,
}

/// What is kept of a cloud beside its observation.
struct Item {
    number: u64,
    surroundings: Vec<[f32; 3]>,
}

/// Clusters clouds of a topic, by default the first with clouds, and follows their objects. Memory
/// grows with the number of clouds, by some 100 kB each.
///
/// # Errors
/// Those of [`EncodedClouds::open`] and of [`cluster`], but for a cloud that cannot be read; those
/// of `on_progress`; [`Error::NoCloud`] if none of the topic has the numbers.
pub fn follow_drive(
    input: &Path,
    (topic, numbers): (Option<&str>, impl RangeBounds<u64>),
    (config, options): (&AnnotateConfig, &TrackOptions),
    on_progress: &mut dyn FnMut(FollowProgress) -> Result<()>,
) -> Result<FollowedDrive> {
    let overview = Overview::read(input)?;
    let recorded = RecordedMotion::read(&overview, &options.ego_motion)?;
    let clouds = EncodedClouds::open_assembled(input, topic, numbers, config.assemble)?;
    let (topic, of) = (clouds.topic().to_owned(), clouds.message_count());
    let mut follower = TopicFollower::new(options);
    let (mut followed, mut unreadable) = (Vec::new(), 0);
    for (done, encoded) in (1..).zip(clouds) {
        let encoded = encoded?;
        let clustered = encoded.decode().map_err(Error::from).and_then(|message| {
            let clustered = cluster(&message, &encoded.key(&message), config)?;
            let placement = Placement::of(&message, &clustered.cloud);
            let observation = observe_cloud(&encoded, (&message, &placement), &clustered, options);
            Ok((clustered, observation))
        });
        match clustered {
            Ok((clustered, observation)) => {
                let surroundings = surroundings(&clustered);
                let item = Item { number: encoded.number, surroundings };
                followed.extend(follower.push(item, observation, &recorded));
            }
            Err(Error::Frame(_)) => unreadable += 1,
            Err(error) => return Err(error),
        }
        on_progress(FollowProgress { clouds: done, of })?;
    }
    followed.extend(follower.decide_all());
    if followed.is_empty() {
        let problem = NoCloud::NothingSelected { times_ns: None };
        return Err(Error::NoCloud { path: input.to_owned(), problem });
    }
    Ok(FollowedDrive {
        topic,
        clouds: followed.into_iter().map(FollowedCloud::new).collect(),
        tracks: follower.summaries(),
        motion: follower.motion_report().clone(),
        unreadable,
    })
}

impl FollowedCloud {
    fn new(decided: Decided<Item>) -> Self {
        let Decided { item, observed, frame, world_from_cloud, began_anew } = decided;
        let instance = |((observed, track), link): ((&ObservedInstance, _), _)| FollowedInstance {
            id: observed.id,
            points: observed.points,
            track,
            link,
        };
        let instances = observed.iter().zip(frame.tracks).zip(frame.links).map(instance);
        let pose = world_from_cloud.cast::<f32>();
        let in_world = |at: &[f32; 3]| {
            let at = pose * Point3::from(*at);
            [at.x, at.y]
        };
        FollowedCloud {
            number: item.number,
            world_from_cloud,
            began_anew,
            instances: instances.collect(),
            objects: frame.objects,
            surroundings: item.surroundings.iter().map(in_world).collect(),
        }
    }
}

/// Some returns that lie half a metre and more above the lowest fifth.
fn surroundings(clustered: &Clustered) -> Vec<[f32; 3]> {
    const LOWEST: f64 = 0.2;
    const ABOVE: f32 = 0.5;
    let cloud: &PointCloud = &clustered.cloud;
    let returns: Vec<usize> = (0..cloud.len()).filter(|&at| cloud.is_return(at)).collect();
    let mut heights: Vec<f32> = returns.iter().map(|&at| cloud.z[at]).collect();
    if heights.is_empty() {
        return Vec::new();
    }
    let place = (heights.len() as f64 * LOWEST) as usize;
    let least = *heights.select_nth_unstable_by(place, f32::total_cmp).1 + ABOVE;
    let high: Vec<usize> = returns.into_iter().filter(|&at| cloud.z[at] > least).collect();
    let stride = high.len().div_ceil(SURROUNDINGS).max(1);
    high.into_iter().step_by(stride).map(|at| cloud.position(at)).collect()
}
