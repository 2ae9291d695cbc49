//! Clouds that go through a network together.

use std::sync::Arc;

use super::{Job, Made};
use crate::annotate::message::{Method, OneOfSeveral, Semantics, annotate_messages};
use crate::error::Result;
use crate::io::{CloudFormat, CloudNumber, SharedBytes};
use crate::workers::{Promise, Ticket};

/// Clouds that wait for others to go through a network with them.
#[derive(Default)]
pub(super) struct Batch {
    /// How many go together; 0 without a network.
    pub(super) size: usize,
    waiting: Vec<One>,
}

struct One {
    message: SharedBytes,
    format: CloudFormat,
    topic: Arc<str>,
    number: u64,
    result: Promise<Result<Made>>,
}

impl Batch {
    pub(super) fn of(method: &Method) -> Self {
        match &method.semantics {
            Semantics::Network(network) => Batch { size: network.batch(), waiting: Vec::new() },
            _ => Batch::default(),
        }
    }
}

impl Job<'_> {
    /// Puts a cloud to those that wait, which a thread takes as soon as they are enough.
    pub(super) fn batch_cloud(
        &mut self,
        message: SharedBytes,
        format: CloudFormat,
        topic: Arc<str>,
        number: u64,
    ) -> Ticket<Result<Made>> {
        let (result, ticket) = Promise::new();
        self.batch.waiting.push(One { message, format, topic, number, result });
        if self.batch.waiting.len() >= self.batch.size {
            self.run_batch();
        }
        ticket
    }

    /// Gives the clouds that wait to a thread.
    pub(super) fn run_batch(&mut self) {
        let Semantics::Network(network) = &self.method.semantics else { return };
        let waiting = std::mem::take(&mut self.batch.waiting);
        if waiting.is_empty() {
            return;
        }
        let (network, method) = (Arc::clone(network), Arc::clone(&self.method));
        let types = self.options.types;
        self.workers.detach(move || {
            let several = waiting.iter().map(|one| OneOfSeveral {
                message: &one.message,
                format: one.format,
                which: CloudNumber { topic: &one.topic, number: one.number },
            });
            let messages: Vec<OneOfSeveral> = several.collect();
            let results = annotate_messages(&messages, &network, &method, &types);
            drop(messages);
            let results = match results {
                Ok(results) => results,
                // The run ends with the error of the first cloud; nobody waits for the others.
                Err(error) => vec![Err(error)],
            };
            for (one, result) in waiting.into_iter().zip(results) {
                let made =
                    result.map(|(clustered, annotated)| Made::Now(Box::new(clustered), annotated));
                one.result.keep(made);
            }
        });
    }
}
