//! The number of each cloud on its topic.

use std::collections::BTreeMap;
use std::sync::Arc;

/// Counts the messages of each topic in the order of the file, read or passed over.
#[derive(Debug, Default)]
pub(crate) struct CloudCounter {
    next: BTreeMap<Arc<str>, u64>,
}

impl CloudCounter {
    /// The number of a topic's next message, from 0.
    pub(crate) fn count(&mut self, topic: &Arc<str>) -> u64 {
        self.skip(topic, 1) - 1
    }

    /// Counts messages that are passed over; the number of the one behind them.
    pub(crate) fn skip(&mut self, topic: &Arc<str>, messages: u64) -> u64 {
        match self.next.get_mut(topic) {
            Some(next) => {
                *next += messages;
                *next
            }
            None => *self.next.entry(Arc::clone(topic)).or_insert(messages),
        }
    }

    /// Messages of a topic so far.
    pub(crate) fn seen(&self, topic: &str) -> u64 {
        self.next.get(topic).copied().unwrap_or(0)
    }
}
