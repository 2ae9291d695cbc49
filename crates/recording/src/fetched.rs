//! What was fetched over the network.

use serde::Serialize;

/// What was fetched of an object over the network since this process first opened it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Fetched {
    /// Requests for it, repeated ones included.
    pub requests: u64,
    /// Bytes of it that were received and used.
    pub bytes: u64,
}
