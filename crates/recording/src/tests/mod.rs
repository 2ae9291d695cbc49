//! Recordings of every shape, read, copied, cut, damaged and filtered.

mod copies;
mod damaged;
mod filter;
mod fixtures;
mod large;
mod lies;
mod outputs;
