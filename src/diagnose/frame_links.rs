//! Why each instance of a cloud is of its track.

use std::collections::BTreeSet;
use std::fmt;

use serde::Serialize;

use super::track::{ExplainedLink, in_short, links_of};
use crate::annotate::{FollowedCloud, FollowedDrive, FollowedInstance};
use divmerge_core::over_time::{InstanceTrack, TrackParams};

/// The instances of a cloud, and why each is of its track.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameExplanation {
    /// The topic.
    pub topic: String,
    /// Number of the cloud on its topic, from 0.
    pub cloud: u64,
    /// Its instances by their ids; one that is of several tracks comes once for each.
    pub links: Vec<FrameLink>,
    /// Least affinity of a track and an instance.
    pub least_affinity: f64,
}

/// An instance of a cloud, its track, and where that was before.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameLink {
    /// The track.
    pub track: u32,
    /// Where the track was seen last before this cloud; `None` where it begins.
    pub before: Option<SeenBefore>,
    /// Why.
    #[serde(flatten)]
    pub link: ExplainedLink,
}

/// Where a track was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SeenBefore {
    /// Number of the cloud.
    pub cloud: u64,
    /// Id of the instance in it; of several, that of which most is of the track.
    pub instance: u32,
}

impl FrameExplanation {
    /// The explanation of a cloud by its number; `None` if it was not followed.
    pub fn of(drive: &FollowedDrive, number: u64, params: &TrackParams) -> Option<Self> {
        let place = drive.clouds.iter().position(|cloud| cloud.number == number)?;
        let (before, cloud) = (&drive.clouds[..place], &drive.clouds[place]);
        let tracks: BTreeSet<u32> = cloud.instances.iter().flat_map(tracks_of).collect();
        let of_track = |track: u32| {
            let seen_before = seen_before(before, track);
            let frame_link = move |link| FrameLink { track, before: seen_before, link };
            links_of(cloud, track).into_iter().map(frame_link)
        };
        let mut links: Vec<FrameLink> = tracks.into_iter().flat_map(of_track).collect();
        links.sort_by_key(|link| (link.link.instance, link.track));
        let (topic, least_affinity) = (drive.topic.clone(), params.least_affinity);
        Some(FrameExplanation { topic, cloud: number, links, least_affinity })
    }
}

fn tracks_of(instance: &FollowedInstance) -> Vec<u32> {
    match &instance.track {
        InstanceTrack::Whole(track) => vec![*track],
        InstanceTrack::Parts(of_cell) => of_cell.clone(),
    }
}

/// Where a track was in the last of some clouds that has it.
fn seen_before(clouds: &[FollowedCloud], track: u32) -> Option<SeenBefore> {
    let in_cloud = |cloud: &FollowedCloud| {
        let links = links_of(cloud, track);
        let points = |link: &&ExplainedLink| f64::from(link.points) * link.share;
        let most = links.iter().max_by(|a, b| points(a).total_cmp(&points(b)))?;
        Some(SeenBefore { cloud: cloud.number, instance: most.instance })
    };
    clouds.iter().rev().find_map(in_cloud)
}

impl fmt::Display for FrameExplanation {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let FrameExplanation { topic, cloud, links, .. } = self;
        writeln!(f, "frame {cloud} of {topic}: why each instance is of its track")?;
        if links.is_empty() {
            return writeln!(f, "\nno instances");
        }
        writeln!(f, "\ninstance  points  track  before            why, and what else it could be")?;
        for FrameLink { track, before, link } in links {
            let ExplainedLink { instance, points, others, .. } = link;
            let before = before.map_or_else(String::new, |seen| match seen.cloud + 1 == *cloud {
                true => format!("instance {}", seen.instance),
                false => format!("{} in frame {}", seen.instance, seen.cloud),
            });
            let runner_up = others.first().map_or_else(String::new, |(other, affinity)| {
                format!("; else track {other}, affinity {affinity:.2}")
            });
            let why = in_short(link);
            writeln!(f, "{instance:>8}  {points:>6}  {track:>5}  {before:<16}  {why}{runner_up}")?;
        }
        Ok(())
    }
}
