//! What is kept of a cloud to follow its objects.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use super::options::{EgoMotionSource, TrackOptions};
use crate::annotate::clustered::Clustered;
use crate::annotate::types::Placement;
use crate::frames::EncodedCloud;
use crate::messages::clouds::CloudMessage;
use divmerge_core::cloud::Instance;
use divmerge_core::over_time::ego_motion::{RegistrationScan, ScanParams};
use divmerge_core::over_time::{ObservedInstance, observe};

/// What is kept of a cloud to follow its objects.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(in crate::annotate) struct CloudObservation {
    /// Stamp of the cloud, or where it has none when it was logged; nanoseconds since 1970.
    pub(super) time_ns: i64,
    pub(super) motion: ObservedMotion,
    pub(super) instances: Vec<ObservedInstance>,
}

/// What tells how the sensor moved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum ObservedMotion {
    /// The pose of the cloud in a frame that stands still, metres.
    Pose(Isometry3<f64>),
    /// Points for registration, as bytes.
    Scan(Vec<u8>),
}

impl Default for ObservedMotion {
    fn default() -> Self {
        ObservedMotion::Scan(Vec::new())
    }
}

/// Observes a clustered cloud.
pub(in crate::annotate) fn observe_cloud(
    encoded: &EncodedCloud,
    (message, placement): (&CloudMessage, &Placement),
    clustered: &Clustered,
    options: &TrackOptions,
) -> CloudObservation {
    let (cloud, stages) = (&clustered.cloud, &clustered.stages);
    // A cloud that lies far from the origin of its frame is in one that stands still, as a map.
    let is_far = cloud.offset != [0.0; 3];
    let motion = match options.ego_motion {
        EgoMotionSource::Estimate if !is_far => {
            let scan = RegistrationScan::new(cloud, stages, &ScanParams::default());
            ObservedMotion::Scan(scan.to_bytes())
        }
        _ => ObservedMotion::Pose(placement.in_metres()),
    };
    let time_ns = match message.stamp_ns() {
        0 => encoded.header.log_time as i64,
        stamp_ns => stamp_ns,
    };
    CloudObservation { time_ns, motion, instances: observe(cloud, stages) }
}

/// What a checkpoint keeps of a cloud whose objects are followed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in crate::annotate) struct Stored {
    pub(in crate::annotate) observation: CloudObservation,
    pub(in crate::annotate) instances: Vec<Instance>,
    pub(in crate::annotate) placement: Placement,
}

impl Stored {
    /// As text for a line of JSON.
    pub(in crate::annotate) fn to_text(&self) -> String {
        let bytes = postcard::to_stdvec(self).expect("plain data");
        STANDARD.encode(bytes)
    }

    /// Read back; `None` if it is something else.
    pub(in crate::annotate) fn from_text(text: &str) -> Option<Self> {
        postcard::from_bytes(&STANDARD.decode(text).ok()?).ok()
    }
}
