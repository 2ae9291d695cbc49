//! One binary for all integration tests.

mod addresses;
mod bleeding_classes;
mod boxes;
mod broken;
mod class_evidence;
mod classes;
mod cli;
mod compare;
mod compressed;
mod convert;
mod coordinates;
mod documents;
mod dry_runs;
mod ego_motion;
mod encodings;
mod evaluate;
mod examples;
mod explain;
mod failures;
mod figure;
mod forms;
mod hostile;
mod house;
mod inputs;
mod inspect;
mod lookup;
mod mistakes;
mod networks;
mod odd_clouds;
mod onnx;
mod oracle;
mod outputs;
mod parameters;
mod partition;
mod parts;
mod recordings;
mod rings;
mod sensors;
mod shapes;
mod shared_data;
mod simulated;
mod skip;
mod slices;
mod threads;
mod tracks;
mod triage;
mod unopened;
mod unpacked;
mod vehicle;
#[cfg(feature = "rerun")]
mod viewer;
mod without_classes;

// Recordings of every shape, from the fuzz harness.
#[allow(dead_code)]
#[path = "../../fuzz/mutate.rs"]
mod mutate;
#[allow(dead_code)]
#[path = "../../fuzz/recordings.rs"]
mod recorded;
