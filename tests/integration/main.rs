//! One binary for all integration tests.

mod oracle;
mod partition;
mod shared_data;
