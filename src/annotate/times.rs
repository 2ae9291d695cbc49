//! How long the steps of a frame take.

use serde::Serialize;

use divmerge_core::pipeline::StageTimes;

/// Mean milliseconds per frame, message bytes to message bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct FrameTimes {
    /// Message to cloud.
    pub decode_ms: f64,
    /// Classes that do not stand in the cloud itself: a network, files, another topic.
    pub semantics_ms: f64,
    /// Cloud to labels.
    #[serde(flatten)]
    pub stages: StageTimes,
    /// Labels to messages.
    pub encode_ms: f64,
}

impl FrameTimes {
    /// All of it.
    pub fn total_ms(&self) -> f64 {
        self.decode_ms + self.semantics_ms + self.stages.total_ms() + self.encode_ms
    }

    fn each(&mut self) -> [&mut f64; 8] {
        let stages = &mut self.stages;
        [
            &mut self.decode_ms,
            &mut self.semantics_ms,
            &mut stages.projection_ms,
            &mut stages.mask_ms,
            &mut stages.divide_ms,
            &mut stages.merge_ms,
            &mut stages.labels_ms,
            &mut self.encode_ms,
        ]
    }

    /// Takes one more frame into the mean over `frames` frames.
    pub(super) fn take(&mut self, mut frame: FrameTimes, frames: u64) {
        for (mean, value) in self.each().into_iter().zip(frame.each()) {
            *mean += (*value - *mean) / frames as f64;
        }
    }
}
