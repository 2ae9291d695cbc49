//! The most suspect cases of a recording.

use super::score::{Case, Triage};
use super::suspect::Suspect;
use crate::annotate::ClusteredFrame;
use crate::text::counted;
use divmerge_core::cloud::PointCloud;

/// The most suspect cases of a recording so far, the most suspect first.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranking {
    /// The cases, at most `limit`.
    pub cases: Vec<RankedCase>,
    /// Frames that were added.
    pub frames: u64,
    /// Their suspects.
    pub suspects: u64,
    /// Their instances.
    pub instances: u64,
    limit: usize,
    start_ns: u64,
}

/// A case and where it is.
#[derive(Debug, Clone, PartialEq)]
pub struct RankedCase {
    /// Cloud topic.
    pub topic: String,
    /// Number of the cloud on its topic, from 0.
    pub frame: u64,
    /// Seconds from the start of the recording.
    pub seconds: f64,
    /// How likely it is in a failure, 0 to 1.
    pub score: f64,
    /// Title of the instance; empty if its points have none.
    pub instance: String,
    /// Its suspects, the one of the greatest weight first.
    pub suspects: Vec<Suspect>,
    /// The points of the first suspect: metres, the recording's frame.
    pub at: Vec<[f64; 3]>,
}

impl Ranking {
    /// No cases yet, and at most `limit` ever. The recording starts at `start_ns`.
    pub fn new(limit: usize, start_ns: u64) -> Self {
        Ranking { cases: Vec::new(), frames: 0, suspects: 0, instances: 0, limit, start_ns }
    }

    /// Adds a frame. Of cases with one score, the earlier stays before the later.
    pub fn add(&mut self, frame: &ClusteredFrame, found: &Triage) {
        self.frames += 1;
        self.suspects += found.suspects.len() as u64;
        self.instances += found.instances.len() as u64;
        let least = match self.cases.len() < self.limit {
            true => 0.0,
            false => self.cases.last().map_or(0.0, |last| last.score),
        };
        let cases = found.cases();
        let worse = cases.iter().take(self.limit).filter(|case| case.score > least);
        let worse: Vec<RankedCase> = worse.map(|case| self.ranked(frame, found, case)).collect();
        self.cases.extend(worse);
        self.cases.sort_by(|a, b| b.score.total_cmp(&a.score));
        self.cases.truncate(self.limit);
    }

    /// What was triaged, in a sentence.
    pub fn summary(&self) -> String {
        format!(
            "{}, {}, {}; {} listed, the most suspect first",
            counted(self.frames as usize, "frame"),
            counted(self.instances as usize, "instance"),
            counted(self.suspects as usize, "suspect"),
            counted(self.cases.len(), "case")
        )
    }

    /// Seconds from the start of the recording to a frame.
    pub fn seconds(&self, frame: &ClusteredFrame) -> f64 {
        frame.header.log_time.saturating_sub(self.start_ns) as f64 * 1e-9
    }

    fn ranked(&self, frame: &ClusteredFrame, found: &Triage, case: &Case) -> RankedCase {
        let suspects: Vec<Suspect> =
            case.suspects.iter().map(|&number| found.suspects[number].clone()).collect();
        let instance = case.instance.map(|id| frame.stages.instances[id as usize - 1].title());
        RankedCase {
            topic: frame.key.topic.to_owned(),
            frame: frame.key.number,
            seconds: self.seconds(frame),
            score: case.score,
            instance: instance.unwrap_or_default(),
            at: recorded_positions(frame.cloud, &suspects[0].points),
            suspects,
        }
    }
}

/// Positions of points in metres in the recording's frame.
pub fn recorded_positions(cloud: &PointCloud, points: &[usize]) -> Vec<[f64; 3]> {
    points.iter().map(|&point| cloud.recorded(cloud.position(point).map(f64::from))).collect()
}
