//! Annotated topics of a recording.

use std::path::Path;

use anyhow::{Result, bail};

use crate::frames::annotated_topics;
use crate::recording::Overview;

/// The annotated topics `T/instances`, at least one.
pub fn annotated(input: &Path) -> Result<Vec<String>> {
    let overview = Overview::read(input)?;
    let topics: Vec<String> = annotated_topics(&overview).into_iter().map(str::to_owned).collect();
    if topics.is_empty() {
        bail!("{}: no annotated topic (run `divmerge annotate`)", input.display());
    }
    Ok(topics)
}

/// The annotated topic that is called `T` or `T/instances`.
pub fn find_annotated<'a>(annotated: &'a [String], topic: &str) -> Option<&'a String> {
    annotated.iter().find(|&name| name == topic || name.strip_suffix("/instances") == Some(topic))
}
