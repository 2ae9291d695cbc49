//! The stream to the Rerun viewer, where this binary was built with one.

use std::path::Path;

use anyhow::{Context, Result};
use divmerge::annotate::{Frame, Method};
use divmerge::view::Target;
#[cfg(feature = "rerun")]
pub use divmerge::view::rerun_stream::RerunStream;

/// What a binary without the viewer's library says.
#[cfg(not(feature = "rerun"))]
const NOT_BUILT: crate::NotBuilt = crate::NotBuilt(
    "this divmerge was built without Rerun. Install it with `cargo install --path . --features rerun`, \
     or open the output of `divmerge annotate` in a stock Rerun: a view of T/instances alone shows the \
     instances of cloud topic T",
);

/// No stream: this binary was built without the viewer's library.
#[cfg(not(feature = "rerun"))]
pub enum RerunStream {}

#[cfg(not(feature = "rerun"))]
impl RerunStream {
    pub fn log(&mut self, _: &Frame) -> divmerge::Result<()> {
        match *self {}
    }

    pub fn warn(&mut self, _: &str) -> divmerge::Result<()> {
        match *self {}
    }

    pub fn finish(self) -> divmerge::Result<()> {
        match self {}
    }
}

/// Refuses what this binary was not built to do.
pub fn require_built() -> Result<()> {
    #[cfg(not(feature = "rerun"))]
    return Err(NOT_BUILT.into());
    #[cfg(feature = "rerun")]
    Ok(())
}

/// Opens a stream that is named like the recording.
#[cfg(feature = "rerun")]
pub fn open(target: &Target, input: &Path, method: &Method) -> Result<RerunStream> {
    let title = input.file_name().unwrap_or(input.as_os_str()).to_string_lossy();
    Ok(RerunStream::open(target, &title, &method.taxonomy)?)
}

/// Opens a stream that is named like the recording.
#[cfg(not(feature = "rerun"))]
pub fn open(_: &Target, _: &Path, _: &Method) -> Result<RerunStream> {
    Err(NOT_BUILT.into())
}

/// Reads the target of `--rerun`.
pub fn target(text: &str, force: bool) -> Target {
    match text {
        "spawn" => Target::Spawn,
        url if url.contains("://") => Target::Connect(url.to_owned()),
        path => Target::Save { path: path.into(), force },
    }
}

/// Shows frames for as long as the stream holds; what breaks it is told at the end, since the job goes on
/// without it.
pub struct Watcher {
    stream: Option<RerunStream>,
    broken: Option<divmerge::Error>,
}

impl Watcher {
    /// A stream to the target; none without one.
    pub fn open(target: Option<&Target>, input: &Path, method: &Method) -> Result<Self> {
        let stream = target.map(|target| open(target, input, method)).transpose()?;
        Ok(Watcher { stream, broken: None })
    }

    /// Shows a frame.
    pub fn show(&mut self, frame: &Frame) {
        let shown = self.stream.as_mut().map_or(Ok(()), |stream| stream.log(frame));
        if let Err(error) = shown {
            self.stream = None;
            self.broken = Some(error);
        }
    }

    /// Ends the stream.
    pub fn finish(self) -> Result<()> {
        let ended = self.stream.map_or(Ok(()), RerunStream::finish);
        let ended = self.broken.map_or(ended, Err);
        ended.context("annotated, but the stream to Rerun broke off")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets() {
        assert_eq!(target("spawn", false), Target::Spawn);
        assert_eq!(
            target("rerun+http://h:1/proxy", false),
            Target::Connect("rerun+http://h:1/proxy".into())
        );
        assert_eq!(target("a/b.rrd", true), Target::Save { path: "a/b.rrd".into(), force: true });
    }
}
