//! Objects followed beside a walk over clouds.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::follower::{Decided, TopicFollower};
use super::observation::observe_cloud;
use super::options::TrackOptions;
use super::recorded_motion::RecordedMotion;
use crate::annotate::clustered::Clustered;
use crate::annotate::event::TrackedFrame;
use crate::annotate::types::Placement;
use crate::error::Result;
use crate::frames::EncodedCloud;
use crate::messages::clouds::CloudMessage;
use divmerge_recording::Overview;

/// Follows the objects of clouds, each topic by itself.
pub(in crate::annotate) struct FrameFollower {
    options: TrackOptions,
    recorded: RecordedMotion,
    topics: BTreeMap<Arc<str>, TopicFollower<TrackedFrame>>,
}

impl FrameFollower {
    /// Reads what is recorded of where the sensor was.
    ///
    /// # Errors
    /// Those of [`RecordedMotion::read`].
    pub(in crate::annotate) fn open(overview: &Overview, options: &TrackOptions) -> Result<Self> {
        let recorded = RecordedMotion::read(overview, &options.ego_motion)?;
        Ok(FrameFollower { options: options.clone(), recorded, topics: BTreeMap::new() })
    }

    /// Takes the next cloud; gives those whose tracks are decided by it.
    pub(in crate::annotate) fn push(
        &mut self,
        encoded: &EncodedCloud,
        message: &CloudMessage,
        clustered: &Clustered,
    ) -> Vec<TrackedFrame> {
        let placement = Placement::of(message, &clustered.cloud);
        let observation = observe_cloud(encoded, (message, &placement), clustered, &self.options);
        let key = encoded.key(message);
        let item = TrackedFrame {
            topic: key.topic.to_owned(),
            number: key.number,
            stamp_ns: key.stamp_ns,
            log_time_ns: encoded.header.log_time,
            frame_id: key.frame_id.to_owned(),
            objects: Vec::new(),
            world_from_cloud: nalgebra::Isometry3::identity(),
            began_anew: false,
        };
        let new = || TopicFollower::new(&self.options);
        let follower = self.topics.entry(Arc::clone(&encoded.topic)).or_insert_with(new);
        follower.push(item, observation, &self.recorded).into_iter().map(tracked).collect()
    }

    /// Decides all clouds with what is known.
    pub(in crate::annotate) fn finish(&mut self) -> Vec<TrackedFrame> {
        self.topics.values_mut().flat_map(TopicFollower::decide_all).map(tracked).collect()
    }
}

fn tracked(decided: Decided<TrackedFrame>) -> TrackedFrame {
    let Decided { item, frame, world_from_cloud, began_anew, .. } = decided;
    TrackedFrame { objects: frame.objects, world_from_cloud, began_anew, ..item }
}
