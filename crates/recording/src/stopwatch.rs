//! How long steps take.

use std::time::Instant;

use serde::Serialize;

/// Steps of one kind: reading, compressing, writing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Steps {
    /// Number of steps.
    pub count: u64,
    /// Milliseconds of all, added up over threads.
    pub ms: f64,
    /// Milliseconds of the slowest step.
    pub slowest_ms: f64,
    /// Bytes that they processed.
    pub bytes: u64,
}

impl Steps {
    /// Adds a step.
    pub fn take(&mut self, ms: f64, bytes: u64) {
        self.count += 1;
        self.ms += ms;
        self.slowest_ms = self.slowest_ms.max(ms);
        self.bytes += bytes;
    }

    /// Adds a step that ends now.
    pub fn take_since(&mut self, started: Instant, bytes: u64) {
        self.take(ms_since(started), bytes);
    }
}

/// Milliseconds since an instant.
pub fn ms_since(started: Instant) -> f64 {
    started.elapsed().as_secs_f64() * 1e3
}
