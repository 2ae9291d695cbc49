//! Why instances of different clouds are one object over time.

use std::fmt;

use serde::Serialize;

use crate::annotate::{FollowedCloud, FollowedDrive, FollowedInstance, TrackSummary};
use divmerge_core::over_time::{Agreement, InstanceTrack, TrackParams};

/// A track, cloud after cloud.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackExplanation {
    /// The topic.
    pub topic: String,
    /// What is known of it as a whole; `None` of background.
    pub summary: Option<TrackSummary>,
    /// Its number.
    pub track: u32,
    /// Its instances in the order of the clouds.
    pub links: Vec<ExplainedLink>,
    /// Least affinity of a track and an instance.
    pub least_affinity: f64,
}

/// An instance of a track, and why it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExplainedLink {
    /// Number of the cloud on its topic, from 0.
    pub cloud: u64,
    /// Id of the instance in the cloud.
    pub instance: u32,
    /// Its points.
    pub points: u32,
    /// What part of it is of the track, 0 to 1.
    pub share: f64,
    /// Why.
    #[serde(flatten)]
    pub reason: LinkReason,
    /// Other tracks that the instance agrees with, and the affinities; the largest first.
    pub others: Vec<(u32, f64)>,
}

/// Why an instance is of a track.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum LinkReason {
    /// The track begins here.
    Begins,
    /// It comes into sight again: the velocities before and after lead from one to the other.
    ComesBack,
    /// It is where the track is expected and looks alike.
    Follows {
        /// Seconds since the track was seen before.
        since_s: f64,
        /// How well both agree.
        #[serde(flatten)]
        agreement: Agreement,
    },
    /// By itself it would be of another track, or part of another object; in the clouds around, the
    /// track is where it lies.
    Votes {
        /// The track that it would be of.
        instead_of: Option<u32>,
    },
}

impl TrackExplanation {
    /// The explanation of a track; `None` if no instance is of it.
    pub fn of(drive: &FollowedDrive, track: u32, params: &TrackParams) -> Option<Self> {
        let of_cloud = |cloud: &FollowedCloud| links_of(cloud, track);
        let mut links: Vec<ExplainedLink> = drive.clouds.iter().flat_map(of_cloud).collect();
        // What is of the track before anything else is, began it.
        if let Some(first) = links.first_mut()
            && matches!(first.reason, LinkReason::ComesBack)
        {
            first.reason = LinkReason::Begins;
        }
        let summary = drive.tracks.iter().find(|summary| summary.track == track).cloned();
        (!links.is_empty()).then(|| TrackExplanation {
            topic: drive.topic.clone(),
            summary,
            track,
            links,
            least_affinity: params.least_affinity,
        })
    }
}

/// The instances of a cloud that are of a track.
pub(super) fn links_of(cloud: &FollowedCloud, track: u32) -> Vec<ExplainedLink> {
    let of_instance = |instance: &FollowedInstance| {
        let share = match &instance.track {
            InstanceTrack::Whole(of) => f64::from(u8::from(*of == track)),
            InstanceTrack::Parts(of_cell) => {
                let count = of_cell.iter().filter(|&&of| of == track).count();
                count as f64 / of_cell.len().max(1) as f64
            }
        };
        (share > 0.0).then(|| ExplainedLink {
            cloud: cloud.number,
            instance: instance.id,
            points: instance.points,
            share,
            reason: reason(instance, track),
            others: instance.link.others.iter().filter(|(of, _)| *of != track).copied().collect(),
        })
    };
    cloud.instances.iter().filter_map(of_instance).collect()
}

fn reason(instance: &FollowedInstance, track: u32) -> LinkReason {
    let link = &instance.link;
    if link.associated != Some(track) {
        return LinkReason::Votes { instead_of: link.associated };
    }
    match (link.agreement, link.since_s) {
        (Some(agreement), Some(since_s)) => LinkReason::Follows { since_s, agreement },
        _ if link.is_continuation => LinkReason::ComesBack,
        _ => LinkReason::Begins,
    }
}

/// An explanation in words: all of it, or one cloud of it in detail.
pub struct TrackText<'a> {
    /// What is explained.
    pub explanation: &'a TrackExplanation,
    /// The cloud, by its number.
    pub link: Option<u64>,
}

impl fmt::Display for TrackText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let TrackExplanation { track, topic, links, .. } = self.explanation;
        let (first, last) = (links[0].cloud, links[links.len() - 1].cloud);
        writeln!(f, "track {track} of {topic}: frames {first} to {last}")?;
        if let Some(summary) = &self.explanation.summary {
            let [length, width, height] = summary.size;
            let motion = match summary.speed {
                Some([speed, error]) => format!("moved at {speed:.1} +- {error:.1} m/s"),
                None => "stood".to_owned(),
            };
            let body = summary.body;
            writeln!(f, "    {body}, {length:.1} x {width:.1} x {height:.1} m, {motion}")?;
        }
        match self.link {
            Some(cloud) => self.detail(f, cloud),
            None => self.table(f),
        }
    }
}

impl TrackText<'_> {
    fn table(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "\nframe  instance  points  why it is of the track")?;
        for link in &self.explanation.links {
            let ExplainedLink { cloud, instance, points, .. } = link;
            writeln!(f, "{cloud:>5}  {instance:>8}  {points:>6}  {}", in_short(link))?;
        }
        Ok(())
    }

    fn detail(&self, f: &mut fmt::Formatter, cloud: u64) -> fmt::Result {
        let TrackExplanation { track, least_affinity, links, .. } = self.explanation;
        let of_cloud = links.iter().filter(|link| link.cloud == cloud);
        for link in of_cloud {
            let ExplainedLink { instance, points, .. } = link;
            writeln!(
                f,
                "\nframe {cloud}, instance {instance} ({points} points): {}",
                in_short(link)
            )?;
            if let LinkReason::Follows { agreement, .. } = link.reason {
                let Agreement { nearness, overlap, overlap_weight, .. } = agreement;
                let Agreement { likeness, trust, affinity, .. } = agreement;
                writeln!(
                    f,
                    "    affinity {affinity:.2} = mean of nearness {nearness:.2} and overlap \
                     {overlap:.2} (weight {overlap_weight:.2}), times likeness {likeness:.2}, \
                     times trust {trust:.2}"
                )?;
                writeln!(
                    f,
                    "    it would begin a track of its own if the least affinity were above \
                     {affinity:.2}; it is {least_affinity:.2}"
                )?;
            }
            match link.others.as_slice() {
                [] => writeln!(f, "    no other track is near")?,
                others => {
                    for (other, affinity) in others {
                        writeln!(
                            f,
                            "    without track {track} it could be of track {other}, with \
                             affinity {affinity:.2}"
                        )?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Why an instance is of a track, in a line.
pub(super) fn in_short(link: &ExplainedLink) -> String {
    let why = match &link.reason {
        LinkReason::Begins => "begins".to_owned(),
        LinkReason::ComesBack => {
            "comes into sight again: its velocity leads there from where it was last seen"
                .to_owned()
        }
        LinkReason::Follows { since_s, agreement } => {
            let Agreement { away_m, overlap, affinity, .. } = agreement;
            let overlap = 100.0 * overlap;
            let unseen = match *since_s > 0.15 {
                true => format!(", unseen for {since_s:.1} s"),
                false => String::new(),
            };
            format!(
                "{away_m:.2} m from the prediction, {overlap:.0} % overlap, affinity \
                 {affinity:.2}{unseen}"
            )
        }
        LinkReason::Votes { instead_of: Some(other) } => format!(
            "the frames around have the track there; by itself it would be of track {other}"
        ),
        LinkReason::Votes { instead_of: None } => {
            "the frames around have the track there; by itself it would be a track of its own"
                .to_owned()
        }
    };
    match link.share < 1.0 {
        true => format!("{:.0} % of it: {why}", 100.0 * link.share),
        false => why,
    }
}
