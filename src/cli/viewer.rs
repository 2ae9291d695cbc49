//! The stream to the Rerun viewer, if this binary was built with it.

use std::path::Path;

use anyhow::{Context, Result};

use crate::annotate::{AnnotateConfig, RunEvent};
#[cfg(not(feature = "rerun"))]
use crate::annotate::{ClusteredFrame, TrackedFrame};
#[cfg(not(feature = "rerun"))]
use crate::diagnose::explain::Explanation;
#[cfg(feature = "rerun")]
pub use crate::view::rerun_stream::RerunStream;
#[cfg(feature = "rerun")]
use crate::view::rerun_stream::annotated_blueprint;
use crate::view::{ShownTopic, Target};

#[cfg(not(feature = "rerun"))]
use crate::cli::exit::NotBuilt;
use crate::cli::output::rrd;

/// The error of a binary without Rerun.
#[cfg(not(feature = "rerun"))]
const NOT_BUILT: NotBuilt = NotBuilt(
    "this divmerge was built without Rerun. Install it with `cargo install --path . --features \
     rerun` or `pip install ./python -C build-args=\"--features rerun\"`, or open the output of \
     `divmerge annotate --only` in a stock Rerun, which shows the instances in colour",
);

/// No stream: this binary was built without Rerun.
#[cfg(not(feature = "rerun"))]
pub enum RerunStream {}

#[cfg(not(feature = "rerun"))]
impl RerunStream {
    pub fn log(&mut self, _: &ClusteredFrame) -> crate::Result<()> {
        match *self {}
    }

    pub fn tracks(&mut self, _: &TrackedFrame) -> crate::Result<()> {
        match *self {}
    }

    pub fn explain(&mut self, _: &ClusteredFrame, _: &Explanation, _: &str) -> crate::Result<()> {
        match *self {}
    }

    pub fn warn(&mut self, _: &str) -> crate::Result<()> {
        match *self {}
    }

    pub fn finish(self) -> crate::Result<()> {
        match self {}
    }
}

/// An error if this binary was built without Rerun.
pub fn require_built() -> Result<()> {
    #[cfg(not(feature = "rerun"))]
    return Err(NOT_BUILT.into());
    #[cfg(feature = "rerun")]
    Ok(())
}

/// Opens a stream with the name of the recording, of clouds that are clustered with a method, and
/// whose objects are followed or not.
#[cfg(feature = "rerun")]
pub fn open(target: &Target, input: &Path, method: (&AnnotateConfig, bool)) -> Result<RerunStream> {
    let title = input.file_name().unwrap_or(input.as_os_str()).to_string_lossy();
    Ok(RerunStream::open(target, &title, method)?)
}

/// An error: this binary was built without Rerun.
#[cfg(not(feature = "rerun"))]
pub fn open(_: &Target, _: &Path, _: (&AnnotateConfig, bool)) -> Result<RerunStream> {
    Err(NOT_BUILT.into())
}

/// Whether this binary was built with Rerun.
pub const IS_BUILT: bool = cfg!(feature = "rerun");

/// The bytes of a layout for a stock Rerun that opens an annotated recording.
#[cfg(feature = "rerun")]
pub fn blueprint(recording: &Path, topics: &[ShownTopic]) -> Result<Vec<u8>> {
    Ok(annotated_blueprint(recording, topics)?)
}

/// An error: this binary was built without Rerun.
#[cfg(not(feature = "rerun"))]
pub fn blueprint(_: &Path, _: &[ShownTopic]) -> Result<Vec<u8>> {
    Err(NOT_BUILT.into())
}

/// Reads the target of `--rerun`.
pub fn target(text: &str) -> Result<Target, String> {
    match text {
        "spawn" => Ok(Target::Spawn),
        url if url.contains("://") => Ok(Target::Connect(url.to_owned())),
        file => rrd(file)
            .map(|path| Target::Save { path, force: false })
            .map_err(|_| "use F.rrd, rerun+http://127.0.0.1:9876/proxy or spawn".into()),
    }
}

/// Shows frames until the stream fails. The job continues without it, and its error is returned at
/// the end.
pub struct Watcher {
    stream: Option<RerunStream>,
    error: Option<crate::Error>,
}

impl Watcher {
    /// A stream to the target, if there is one.
    pub fn open(
        target: Option<&Target>,
        input: &Path,
        method: (&AnnotateConfig, bool),
    ) -> Result<Self> {
        let stream = target.map(|target| open(target, input, method)).transpose()?;
        Ok(Watcher { stream, error: None })
    }

    /// Shows a frame, or its tracks.
    pub fn show(&mut self, event: &RunEvent) {
        let shown = self.stream.as_mut().map_or(Ok(()), |stream| match event {
            RunEvent::Frame(frame) => stream.log(frame),
            RunEvent::Tracked(frame) => stream.tracks(frame),
            RunEvent::Warning(_) | RunEvent::Progress { .. } => Ok(()),
        });
        if let Err(error) = shown {
            self.stream = None;
            self.error = Some(error);
        }
    }

    /// Ends the stream.
    pub fn finish(self) -> Result<()> {
        let ended = self.stream.map_or(Ok(()), RerunStream::finish);
        let ended = self.error.map_or(ended, Err);
        ended.context("annotated, but the stream to Rerun failed")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets() {
        let url = "rerun+http://h:1/proxy";
        assert_eq!(target("spawn"), Ok(Target::Spawn));
        assert_eq!(target(url), Ok(Target::Connect(url.into())));
        assert_eq!(target("a/b.rrd"), Ok(Target::Save { path: "a/b.rrd".into(), force: false }));
        assert!(target("spwan").is_err() && target("out.mcap").is_err());
    }
}
