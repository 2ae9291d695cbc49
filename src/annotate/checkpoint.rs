//! Checkpoints: what became of each cloud, written so that it need not be done again, by a run that
//! may be cut off and by one that annotates a slice of a recording; and clouds taken from there.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::report::FrameReport;
use super::tracking::Stored;
use crate::error::{Error, Result, SliceProblem};
use divmerge_recording::{SharedBytes, SourceChunk, checksum};

/// A cloud, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Checkpoint {
    pub(super) topic: String,
    pub(super) number: u64,
    /// Checksum of the cloud's message.
    pub(super) cloud: u32,
    #[serde(flatten)]
    pub(super) outcome: CloudOutcome,
}

/// What became of a cloud.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum CloudOutcome {
    Annotated {
        /// Checksums of the messages that annotate it.
        instances: u32,
        objects: u32,
        report: FrameReport,
        /// What following its objects needs, if they are followed.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        observed: Option<String>,
    },
    /// It could not be read, and why.
    Unreadable { problem: String },
}

/// A cloud that a run before completed.
pub(super) enum CompletedCloud {
    Annotated(FrameReport, [StoredMessage; 2], Option<Box<Stored>>),
    Unreadable(String),
}

/// A message that a run before wrote.
pub(super) struct StoredMessage {
    pub(super) data: SharedBytes,
    /// The chunk that it lies in.
    pub(super) chunk: Option<Arc<SourceChunk>>,
}

/// Where checkpoints are read from, and the messages that they are about.
pub(super) trait CheckpointSource {
    /// The next checkpoint; `None` at the end.
    ///
    /// # Errors
    /// [`Error::Slices`] if a slice is damaged, and those of reading it.
    fn next(&mut self) -> Result<Option<Checkpoint>>;

    /// The next message, if it has that checksum.
    ///
    /// # Errors
    /// Those of [`next`](CheckpointSource::next).
    fn message(&mut self, checksum: u32) -> Result<Option<StoredMessage>>;

    /// Says that a cloud is not there; where every cloud has to be there, that is an error.
    ///
    /// # Errors
    /// [`Error::Slices`] with the problem.
    fn missing(&self, problem: SliceProblem) -> Result<()>;

    /// The error that the cloud of a topic and a number is not the one that was annotated.
    fn changed(&self, topic: &str, number: u64) -> Error;
}

/// Clouds that a run before completed, in the order of the recording.
pub(super) struct CompletedClouds {
    source: Box<dyn CheckpointSource>,
    next: Option<Checkpoint>,
    is_over: bool,
}

impl CompletedClouds {
    pub(super) fn new(source: impl CheckpointSource + 'static) -> Self {
        CompletedClouds { source: Box::new(source), next: None, is_over: false }
    }

    /// What became of the next cloud, whose message is `cloud`, if it was completed.
    ///
    /// # Errors
    /// [`Error::Conflict`] or [`Error::Slices`] if another cloud was annotated in its place.
    pub(super) fn take(
        &mut self,
        topic: &str,
        number: u64,
        cloud: &[u8],
    ) -> Result<Option<CompletedCloud>> {
        let Some(next) = self.peek()? else {
            self.source.missing(SliceProblem::LacksCloud { topic: topic.to_owned(), number })?;
            return Ok(None);
        };
        if (next.topic.as_str(), next.number) != (topic, number) {
            let (expected, found) = ((topic.to_owned(), number), (next.topic.clone(), next.number));
            self.source.missing(SliceProblem::OtherCloud { expected, found })?;
            return Ok(None);
        }
        if next.cloud != checksum(cloud) {
            return Err(self.source.changed(topic, number));
        }
        match self.next.take().map(|checkpoint| checkpoint.outcome) {
            Some(CloudOutcome::Annotated { instances, objects, report, observed }) => {
                let stored = observed.as_deref().and_then(Stored::from_text).map(Box::new);
                let messages = self.messages([instances, objects])?;
                Ok(messages.map(|messages| CompletedCloud::Annotated(report, messages, stored)))
            }
            Some(CloudOutcome::Unreadable { problem }) => {
                Ok(Some(CompletedCloud::Unreadable(problem)))
            }
            None => Ok(None),
        }
    }

    fn messages(&mut self, [instances, objects]: [u32; 2]) -> Result<Option<[StoredMessage; 2]>> {
        if let Some(instances) = self.source.message(instances)?
            && let Some(objects) = self.source.message(objects)?
        {
            return Ok(Some([instances, objects]));
        }
        self.source.missing(SliceProblem::OtherMessages)?;
        self.is_over = true;
        Ok(None)
    }

    fn peek(&mut self) -> Result<Option<&Checkpoint>> {
        if self.next.is_none() && !self.is_over {
            self.next = self.source.next()?;
            self.is_over = self.next.is_none();
        }
        Ok(self.next.as_ref())
    }

    /// Says that no more clouds are to come.
    ///
    /// # Errors
    /// [`Error::Slices`] if there are more that have to be used.
    pub(super) fn finish(&mut self) -> Result<()> {
        match self.peek()? {
            None => Ok(()),
            Some(&Checkpoint { ref topic, number, .. }) => {
                let problem = SliceProblem::ExtraCloud { topic: topic.clone(), number };
                self.source.missing(problem)
            }
        }
    }
}
