//! Progress bars, and numbers for people.

use std::io::IsTerminal;
use std::time::Duration;

pub use divmerge::error::grouped;
use indicatif::{ProgressBar, ProgressStyle};

/// A bar over bytes on stderr; hidden where stderr is no terminal.
pub fn byte_bar(what: &str) -> ProgressBar {
    bar(what, "{msg} [{bar:30}] {bytes}/{total_bytes}, {bytes_per_sec}, {eta} left")
}

/// A bar over frames on stderr; hidden where stderr is no terminal.
pub fn frame_bar(what: &str, frames: u64) -> ProgressBar {
    let bar = bar(what, "{msg} [{bar:30}] {pos}/{len} frames, {eta} left");
    bar.set_length(frames);
    bar
}

fn bar(what: &str, template: &str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template).expect("a valid template");
    let bar = ProgressBar::no_length().with_style(style).with_message(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
