//! Which clouds of a recording a command reads.

use std::ops::Bound;
use std::path::Path;
use std::str::FromStr;

use anyhow::Result;
use clap::Args;

use super::values::frames;
use crate::Error;
use crate::annotate::time_spec::{self, TimeSpec};
use crate::cli::exit::Contradiction;
use crate::frames::Selection;
use crate::recording::MessageRange;

/// Which clouds of a recording a command reads.
#[derive(Args)]
pub struct SelectionArguments {
    /// Read this cloud topic only; may be repeated [default: all]
    #[arg(long = "topic", value_name = "T")]
    topics: Vec<String>,

    /// Read only these frames of each topic, numbered from 0: 5..10 (without 10), 5.., ..10 or 5
    #[arg(long, value_name = "A..B", value_parser = frames)]
    frames: Option<MessageRange>,

    /// Skip clouds before this log time: seconds from the start (12.5), since 1970
    /// (@1317384506.4), a date (2011-09-30T12:28:26Z), or that of a cloud (frame:100, of the first
    /// selected topic)
    #[arg(long, value_name = "T", value_parser = TimeSpec::from_str)]
    from: Option<TimeSpec>,

    /// Skip clouds from this log time on
    #[arg(long, value_name = "T", value_parser = TimeSpec::from_str)]
    to: Option<TimeSpec>,
}

impl SelectionArguments {
    /// The selected clouds of a recording.
    pub fn selection(&self, input: &Path) -> Result<Selection> {
        let (from_ns, to_ns) = window(input, (self.from, self.to), &self.topics)?;
        let frames = self.frames.unwrap_or((Bound::Unbounded, Bound::Unbounded));
        Ok(Selection { topics: self.topics.clone(), frames, from_ns, to_ns })
    }
}

impl SelectionArguments {
    /// The arguments that leave clouds out.
    pub fn limits(&self) -> Vec<&'static str> {
        let is_given = [
            ("--frames", self.frames.is_some()),
            ("--from", self.from.is_some()),
            ("--to", self.to.is_some()),
        ];
        is_given.into_iter().filter(|(_, is_given)| *is_given).map(|(name, _)| name).collect()
    }
}

/// The log times in nanoseconds of `--from` and `--to`.
pub fn window(
    input: &Path,
    moments: (Option<TimeSpec>, Option<TimeSpec>),
    topics: &[String],
) -> Result<(Option<u64>, Option<u64>)> {
    time_spec::window(input, moments, topics).map_err(|error| match error {
        Error::Parameter(wrong) if wrong.name == "from" => {
            Contradiction("--from must lie before --to".to_owned()).into()
        }
        Error::Parameter(_) => Contradiction(
            "for a stream, --from and --to must be times since 1970 (@1317384506.4) or dates"
                .to_owned(),
        )
        .into(),
        other => other.into(),
    })
}
