//! One binary for all integration tests.

mod cli;
mod evaluate;
mod examples;
mod explain;
mod figure;
mod layers;
mod oracle;
mod partition;
mod recordings;
mod shared_data;
mod simulated;
mod triage;
#[cfg(feature = "rerun")]
mod viewer;
mod without_classes;
