//! Clouds that go through a network together.

use std::sync::Arc;

use super::pending::CloudResult;
use crate::annotate::config::{AnnotateConfig, Semantics};
use crate::annotate::message::annotate_messages;
use crate::annotate::types::MessageTypes;
use crate::error::Result;
use crate::frames::EncodedCloud;
use divmerge_recording::workers::{Promise, Ticket, Workers};

/// Clouds that wait for others to go through a network with them.
pub(super) struct Batch {
    /// How many go together; 0 without a network.
    pub(super) size: usize,
    config: Arc<AnnotateConfig>,
    types: MessageTypes,
    waiting: Vec<BatchItem>,
}

struct BatchItem {
    encoded: EncodedCloud,
    result: Promise<Result<CloudResult>>,
}

impl Batch {
    pub(super) fn new(config: Arc<AnnotateConfig>, types: MessageTypes) -> Self {
        let size = match &config.semantics {
            Semantics::Network(network) => network.batch(),
            _ => 0,
        };
        Batch { size, config, types, waiting: Vec::new() }
    }

    /// Adds a cloud to those that wait, which a thread takes as soon as they are enough.
    pub(super) fn push(
        &mut self,
        encoded: EncodedCloud,
        workers: &Workers,
    ) -> Ticket<Result<CloudResult>> {
        let (result, ticket) = Promise::new();
        self.waiting.push(BatchItem { encoded, result });
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
        let (network, config, types) = (Arc::clone(network), Arc::clone(&self.config), self.types);
        let waiting = std::mem::take(&mut self.waiting);
        workers.detach(move || {
            let (clouds, promises): (Vec<_>, Vec<_>) =
                waiting.into_iter().map(|item| (item.encoded, item.result)).unzip();
            let results = annotate_messages(&clouds, &network, &config, &types);
            drop(clouds);
            let results = match results {
                Ok(results) => results,
                // The run ends with the error of the first cloud; nobody waits for the others.
                Err(error) => vec![Err(error)],
            };
            for (promise, result) in promises.into_iter().zip(results) {
                promise.keep(result.map(|(clustered, annotated)| {
                    CloudResult::Annotated(Box::new(clustered), annotated)
                }));
            }
        });
    }
}
