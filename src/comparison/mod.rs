//! Methods side by side: how well and how fast they segment the same clouds ([`measure()`]), and
//! classes that are wrong by a known amount to compare them on ([`corrupt`]).

pub mod corruption;
mod measure;

pub use corruption::{Corruption, Surroundings, corrupt};
pub use measure::{MethodScores, measure};
