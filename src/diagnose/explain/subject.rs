//! What an explanation is about: a run of the pipeline, and one or two of its points.

use serde::Serialize;

use divmerge_core::cloud::PointCloud;
use divmerge_core::pipeline::{Config, Stages};
use divmerge_core::semantics::MaskSource;

/// One run of the pipeline with what went into it.
#[derive(Debug, Clone, Copy)]
pub struct ClusteredCloud<'a> {
    /// The cloud that was clustered.
    pub cloud: &'a PointCloud,
    /// Where its object mask came from.
    pub mask: MaskSource<'a>,
    /// Every parameter of the run.
    pub config: &'a Config,
    /// Every intermediate of the run.
    pub stages: &'a Stages,
}

/// What is asked about; points by their index in the cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// What is this point's instance, or why has it none?
    Point(usize),
    /// Are these two points one instance?
    Pair(usize, usize),
}

impl Subject {
    /// The points asked about, one or two.
    pub fn points(self) -> Vec<usize> {
        match self {
            Subject::Point(point) => vec![point],
            Subject::Pair(a, b) => vec![a, b],
        }
    }
}

/// The answer to a [`Subject`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// Two points, one instance.
    OneInstance,
    /// Two points that are not one instance.
    Apart,
    /// One point, which has an instance.
    HasInstance,
    /// One point, which has none.
    NoInstance,
}

/// The answer alone.
///
/// # Panics
/// If a point is not in the cloud.
pub fn answer(stages: &Stages, subject: Subject) -> Answer {
    let instance = &stages.labels.instance;
    match subject {
        Subject::Point(point) if instance[point] != 0 => Answer::HasInstance,
        Subject::Point(_) => Answer::NoInstance,
        Subject::Pair(a, b) if instance[a] != 0 && instance[a] == instance[b] => {
            Answer::OneInstance
        }
        Subject::Pair(..) => Answer::Apart,
    }
}
