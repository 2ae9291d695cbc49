//! Sweeps that come in parts: whole turns are put together of several messages of a topic, and
//! clustered as one cloud.

mod assembler;
mod part;
mod setting;
mod turns;
mod watch;

pub use setting::Assemble;
pub(crate) use turns::{Turns, shared_out};
pub(crate) use watch::PartWatch;
pub use watch::sweeps_in_parts;
