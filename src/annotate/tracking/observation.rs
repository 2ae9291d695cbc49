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
use divmerge_core::over_time::ego_motion::RegistrationScan;
use divmerge_core::over_time::{ObservedInstance, observe};

/// What is kept of a cloud to follow its objects.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(in crate::annotate) struct CloudObservation {
    /// Stamp of the cloud, or where it has none when it was logged; nanoseconds since 1970.
    pub(super) time_ns: i64,
    /// Name of the frame of its message.
    pub(super) frame_id: String,
    /// From the cloud as it was clustered to that frame, metres.
    pub(super) place: Isometry3<f64>,
    /// Whether that frame stands still: the cloud lies far from its origin, as in a map.
    pub(super) stands_still: bool,
    /// Points for registration, as bytes; empty where the motion is not estimated.
    pub(super) scan: Vec<u8>,
    pub(super) instances: Vec<ObservedInstance>,
}

/// Observes a clustered cloud.
pub(in crate::annotate) fn observe_cloud(
    encoded: &EncodedCloud,
    (message, placement): (&CloudMessage, &Placement),
    clustered: &Clustered,
    options: &TrackOptions,
) -> CloudObservation {
    let (cloud, stages) = (&clustered.cloud, &clustered.stages);
    let stands_still = cloud.offset != [0.0; 3];
    let is_estimated =
        matches!(options.ego_motion, EgoMotionSource::Auto | EgoMotionSource::Estimate);
    let scan = match is_estimated && !stands_still {
        true => RegistrationScan::new(cloud, stages, &options.registration).to_bytes(),
        false => Vec::new(),
    };
    let time_ns = match message.stamp_ns() {
        0 => encoded.header.log_time as i64,
        stamp_ns => stamp_ns,
    };
    CloudObservation {
        time_ns,
        frame_id: message.frame_id.clone(),
        place: placement.in_metres(),
        stands_still,
        scan,
        instances: observe(cloud, stages),
    }
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
