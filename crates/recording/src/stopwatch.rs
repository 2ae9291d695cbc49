//! How long the steps of a kind take.

use std::time::Instant;

use serde::Serialize;

/// Steps of one kind: reading, compressing, writing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Steps {
    /// How many.
    pub count: u64,
    /// Milliseconds of all, those of several threads added up.
    pub ms: f64,
    /// Milliseconds of the slowest.
    pub slowest_ms: f64,
    /// Bytes that they worked through.
    pub bytes: u64,
}

impl Steps {
    /// Takes a step.
    pub fn take(&mut self, ms: f64, bytes: u64) {
        self.count += 1;
        self.ms += ms;
        self.slowest_ms = self.slowest_ms.max(ms);
        self.bytes += bytes;
    }

    /// Takes a step that ends now.
    pub fn take_since(&mut self, started: Instant, bytes: u64) {
        self.take(ms_since(started), bytes);
    }
}

/// Milliseconds since then.
pub fn ms_since(started: Instant) -> f64 {
    started.elapsed().as_secs_f64() * 1e3
}
