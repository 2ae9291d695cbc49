//! Progress bars on stderr, in lines of 80 columns: what is done to which file, frames of frames,
//! rate, time left. They are hidden if stderr is not a terminal.

use std::cell::Cell;
use std::fmt::Write;
use std::io::IsTerminal;
use std::path::Path;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::annotate::RunEvent;
use crate::cli::terminal::{self, escaped};
use crate::frames::choose_topics;
use crate::recording::address::is_remote;
use crate::recording::{Overview, is_stream};

/// A bar over frames.
pub fn frame_bar(task: &str, frames: u64) -> ProgressBar {
    let task = shortened(task, 30);
    let bar = bar(&task, "{prefix} [{bar:10}] {pos}/{len} frames, {rate}, {eta} left");
    bar.set_length(frames);
    bar
}

/// Progress through the bytes of a recording, and its warnings.
pub struct RecordingProgress<'a> {
    bar: ProgressBar,
    input: &'a Path,
    /// Frames in all, if that is known.
    frames: Option<u64>,
    done: Cell<u64>,
    started: Instant,
}

impl<'a> RecordingProgress<'a> {
    pub fn new(task: &str, input: &'a Path) -> Self {
        let name = input.file_name().unwrap_or(input.as_os_str()).to_string_lossy();
        let prefix = format!("{task} {}", shortened(&name, 29 - task.chars().count().min(20)));
        let bar = bar(&prefix, "{prefix} [{bar:10}] {msg}{eta} left");
        let frames = if bar.is_hidden() { None } else { frame_count(input) };
        RecordingProgress { bar, input, frames, done: Cell::new(0), started: Instant::now() }
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
            RunEvent::Frame(_) => {
                let done = self.done.get() + 1;
                self.done.set(done);
                let of = self.frames.map_or(String::new(), |frames| format!("/{frames}"));
                let rate = done as f64 / self.started.elapsed().as_secs_f64();
                self.bar.set_message(format!("{done}{of} frames, {rate:.1}/s, "));
            }
            RunEvent::Tracked(_) => {}
        }
    }
}

/// The clouds of a recording, if its index tells; a stream is not looked into.
fn frame_count(input: &Path) -> Option<u64> {
    let overview =
        (!is_stream(input) && !is_remote(input)).then(|| Overview::read(input).ok())??;
    let topics = choose_topics(&overview, &[], None).ok()?;
    let counts = topics.keys().map(|channel| overview.message_counts.get(channel).copied());
    counts.sum()
}

/// A text of at most so many letters, with an ellipsis for what is left out of its middle.
fn shortened(text: &str, most: usize) -> String {
    let letters: Vec<char> = text.chars().collect();
    if letters.len() <= most {
        return text.to_owned();
    }
    let after = most / 2;
    let before = most - after - 1;
    let (start, end) = (&letters[..before], &letters[letters.len() - after..]);
    start.iter().chain(['\u{2026}'].iter()).chain(end).collect()
}

impl Drop for RecordingProgress<'_> {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

fn bar(prefix: &str, template: &str) -> ProgressBar {
    if terminal::is_quiet() || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template).expect("a valid template");
    let style = style.with_key("rate", |state: &ProgressState, text: &mut dyn Write| {
        let _ = write!(text, "{:.1}/s", state.per_sec());
    });
    let bar = ProgressBar::no_length().with_style(style).with_prefix(escaped(prefix));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_lose_their_middle() {
        assert_eq!(shortened("drive.mcap", 12), "drive.mcap");
        assert_eq!(shortened("2011_09_30_drive_0028.mcap", 13), "2011_0\u{2026}8.mcap");
        assert_eq!(shortened("größer als gedacht", 5).chars().count(), 5);
    }
}
