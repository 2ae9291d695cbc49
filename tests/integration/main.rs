//! One binary for all integration tests.

mod boxes;
mod cli;
mod compare;
mod convert;
mod evaluate;
mod examples;
mod explain;
mod failures;
mod figure;
mod layers;
mod oracle;
mod partition;
mod recordings;
mod sensors;
mod shared_data;
mod simulated;
mod threads;
mod triage;
#[cfg(feature = "rerun")]
mod viewer;
mod without_classes;
