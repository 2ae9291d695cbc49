//! Sweeps that come in parts: whole turns are put together of several messages of a topic, and
//! clustered as one cloud. Each part is annotated by itself.

mod assembler;
mod part;
mod turn;
mod watch;

use std::fmt;

pub(super) use assembler::Assembler;
pub(super) use turn::{AnnotatedTurn, annotate_turn};
pub(super) use watch::PartWatch;

/// How the messages of a topic are put together to turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Assemble {
    /// Once round where the messages follow each other around the sensor, and 0.1 s otherwise.
    Auto,
    /// So many messages, at least 1.
    Messages(usize),
    /// So many nanoseconds of the clouds' stamps.
    Span(i64),
}

impl fmt::Display for Assemble {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Assemble::Auto => f.write_str("auto"),
            Assemble::Messages(messages) => write!(f, "{messages} messages"),
            Assemble::Span(ns) => write!(f, "{} s", *ns as f64 * 1e-9),
        }
    }
}
