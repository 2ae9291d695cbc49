//! How messages are put together to turns.

use std::fmt;
use std::str::FromStr;

use divmerge_core::pipeline::overrides::limits;

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

impl FromStr for Assemble {
    type Err = String;

    /// Reads `auto`, a number of messages (10), or seconds, which have a point or an s (0.1, 1s).
    fn from_str(text: &str) -> Result<Self, String> {
        const FORM: &str = "use auto, a number of messages as in 10, or seconds as in 0.1 or 1s";
        if text == "auto" {
            return Ok(Assemble::Auto);
        }
        if let Ok(messages) = text.parse() {
            return limits::at_least_one(messages).map(Assemble::Messages);
        }
        let seconds =
            text.strip_suffix('s').unwrap_or(text).parse().map_err(|_| FORM.to_owned())?;
        let ns = limits::above_zero(seconds)? * 1e9;
        Ok(Assemble::Span(ns.round() as i64))
    }
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
