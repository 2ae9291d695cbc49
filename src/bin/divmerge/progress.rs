//! Progress bars on stderr. They are hidden if stderr is not a terminal.

use std::io::IsTerminal;
use std::path::Path;
use std::time::Duration;

use divmerge::annotate::RunEvent;
use indicatif::{ProgressBar, ProgressStyle};

use crate::terminal::escaped;

/// A bar over frames.
pub fn frame_bar(task: &str, frames: u64) -> ProgressBar {
    let bar = bar(task, "{msg} [{bar:30}] {pos}/{len} frames, {eta} left");
    bar.set_length(frames);
    bar
}

/// Progress through the bytes of a recording, and its warnings.
pub struct RecordingProgress<'a> {
    bar: ProgressBar,
    input: &'a Path,
}

impl<'a> RecordingProgress<'a> {
    pub fn new(task: &str, input: &'a Path) -> Self {
        let template = "{msg} [{bar:30}] {bytes}/{total_bytes}, {bytes_per_sec}, {eta} left";
        RecordingProgress { bar: bar(task, template), input }
    }

    /// Moves the bar or prints a warning. Frames show nothing.
    pub fn show(&self, event: &RunEvent) {
        match event {
            RunEvent::Progress { bytes, total } => {
                self.bar.set_length(*total.max(bytes));
                self.bar.set_position(*bytes);
            }
            RunEvent::Warning(warning) => {
                self.bar.suspend(|| eprintln!("warning: {}: {warning}", self.input.display()));
            }
            RunEvent::Frame(_) => {}
        }
    }
}

impl Drop for RecordingProgress<'_> {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

fn bar(task: &str, template: &str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template).expect("a valid template");
    let bar = ProgressBar::no_length().with_style(style).with_message(escaped(task));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
