//! Clouds that go through a network together.

use std::sync::Arc;

use super::cloud_job::CloudJob;
use super::pending::CloudResult;
use crate::annotate::config::{AnnotateConfig, Semantics};
use crate::annotate::message::cluster_messages;
use crate::error::Result;
use crate::frames::EncodedCloud;
use divmerge_recording::workers::{Promise, Ticket, Workers};

/// Clouds that wait for others to go through a network with them.
pub(super) struct Batch {
    /// How many go together; 0 without a network.
    pub(super) size: usize,
    config: Arc<AnnotateConfig>,
    job: CloudJob,
    waiting: Vec<BatchItem>,
}

struct BatchItem {
    encoded: EncodedCloud,
    is_followed: bool,
    result: Promise<Result<CloudResult>>,
}

impl Batch {
    pub(super) fn new(config: Arc<AnnotateConfig>, job: CloudJob) -> Self {
        let size = match &config.semantics {
            Semantics::Network(network) => network.batch(),
            _ => 0,
        };
        Batch { size, config, job, waiting: Vec::new() }
    }

    /// Adds a cloud to those that wait, which a thread takes as soon as they are enough.
    pub(super) fn push(
        &mut self,
        (encoded, is_followed): (EncodedCloud, bool),
        workers: &Workers,
    ) -> Ticket<Result<CloudResult>> {
        let (result, ticket) = Promise::new();
        self.waiting.push(BatchItem { encoded, is_followed, result });
        if self.waiting.len() >= self.size {
            self.run(workers);
        }
        ticket
    }

    /// Gives the clouds that wait to a thread.
    pub(super) fn run(&mut self, workers: &Workers) {
        let Semantics::Network(network) = &self.config.semantics else { return };
        if self.waiting.is_empty() {
            return;
        }
        let (network, config, job) =
            (Arc::clone(network), Arc::clone(&self.config), self.job.clone());
        let waiting = std::mem::take(&mut self.waiting);
        workers.detach(move || {
            let mut clouds = Vec::with_capacity(waiting.len());
            let mut promises = Vec::with_capacity(waiting.len());
            for BatchItem { encoded, is_followed, result } in waiting {
                clouds.push((encoded, is_followed));
                promises.push(result);
            }
            let writing = job.writing(&config);
            let results = cluster_messages(&clouds, &network, writing);
            let results = match results {
                Ok(results) => results,
                // The run ends with the error of the first cloud; nobody waits for the others.
                Err(error) => vec![Err(error)],
            };
            for ((promise, result), (encoded, _)) in promises.into_iter().zip(results).zip(&clouds)
            {
                promise.keep(result.and_then(|written| {
                    CloudResult::of(encoded, written, (writing, job.is_of_slice))
                }));
            }
        });
    }
}
