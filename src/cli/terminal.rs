//! What is printed. Names out of recordings (topics, frames, fields, schemas, paths) may hold
//! anything, also sequences that command a terminal, so that all text is escaped on its way out.
//!
//! The macros here stand in front of those of the standard library: no file of the command line
//! prints otherwise.

use std::fmt::{Arguments, Write as _};
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use clap::ColorChoice;

use crate::recording::{self, abandon_partial_files};

use crate::cli::exit;

/// Whether results and errors alone are printed.
static IS_QUIET: AtomicBool = AtomicBool::new(false);
/// Whether more is printed than usual.
static IS_VERBOSE: AtomicBool = AtomicBool::new(false);
/// Whether errors and warnings are coloured.
static HAS_COLORS: AtomicBool = AtomicBool::new(false);

/// What is printed from here on.
pub fn set_up(quiet: bool, verbose: bool, color: ColorChoice) {
    IS_QUIET.store(quiet, Ordering::Relaxed);
    IS_VERBOSE.store(verbose, Ordering::Relaxed);
    HAS_COLORS.store(has_colors(color), Ordering::Relaxed);
}

/// Whether results and errors alone are printed.
pub fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Whether more is printed than usual.
pub fn is_verbose() -> bool {
    IS_VERBOSE.load(Ordering::Relaxed)
}

/// `auto` is a terminal, unless `NO_COLOR` is set (no-color.org) or the terminal is dumb.
fn has_colors(color: ColorChoice) -> bool {
    match color {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
            let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
            io::stderr().is_terminal() && !is_set("NO_COLOR") && !is_dumb
        }
    }
}

macro_rules! print {
    ($($text:tt)*) => { $crate::cli::terminal::to_stdout(format_args!($($text)*), "") };
}

macro_rules! println {
    () => { $crate::cli::terminal::to_stdout(format_args!(""), "\n") };
    ($($text:tt)*) => { $crate::cli::terminal::to_stdout(format_args!($($text)*), "\n") };
}

macro_rules! eprint {
    ($($text:tt)*) => { $crate::cli::terminal::to_stderr(format_args!($($text)*), "") };
}

macro_rules! eprintln {
    ($($text:tt)*) => { $crate::cli::terminal::to_stderr(format_args!($($text)*), "\n") };
}

/// Prints text and what ends it, escaped. A standard output that takes nothing more ends the
/// process ([`flush`]).
pub fn to_stdout(text: Arguments, end: &str) {
    let text = escaped(&format!("{text}{end}"));
    end_unless_written(io::stdout().write_all(text.as_bytes()));
}

/// Prints text and what ends it on stderr, escaped. Whether it is read is not known.
pub fn to_stderr(text: Arguments, end: &str) {
    let text = escaped(&format!("{text}{end}"));
    if is_quiet() && text.starts_with(WARNING) {
        return;
    }
    let text = match HAS_COLORS.load(Ordering::Relaxed) {
        true => painted(&text),
        false => text,
    };
    let _ = io::stderr().write_all(text.as_bytes());
}

const ERROR: &str = "error:";
const WARNING: &str = "warning:";

/// The text with its first word in colour, if that says that something is wrong.
fn painted(text: &str) -> String {
    let paint = |word: &str, color: u8| {
        text.strip_prefix(word).map(|rest| format!("\u{1b}[1;{color}m{word}\u{1b}[0m{rest}"))
    };
    paint(ERROR, 31).or_else(|| paint(WARNING, 33)).unwrap_or_else(|| text.to_owned())
}

/// Prints what is still to be printed. Where the reader has gone, as in `divmerge info F | head`,
/// the process ends as quietly as one that SIGPIPE ends; where the output is full, with an error.
pub fn flush() {
    end_unless_written(io::stdout().flush());
}

fn end_unless_written(written: io::Result<()>) {
    let Err(source) = written else { return };
    // Nothing that is half written may get its name.
    abandon_partial_files(&[]);
    let error = recording::Error::StandardOutput { source };
    std::process::exit(exit::report(&error.into()).into());
}

/// Text in which characters that a terminal obeys, or that turn the order of others around, are
/// written as `\u001b`. Line ends and tabs stay. JSON stays the same JSON.
pub fn escaped(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for letter in text.chars() {
        match is_hidden(letter) && !matches!(letter, '\n' | '\t') {
            true => {
                let _ = write!(shown, "\\u{:04x}", u32::from(letter));
            }
            false => shown.push(letter),
        }
    }
    shown
}

/// Whether a character is a control character, or one that changes how others are laid out.
pub fn is_hidden(letter: char) -> bool {
    let is_of_layout = matches!(
        letter,
        '\u{61c}'
            | '\u{200b}'..='\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}'
            | '\u{feff}'
    );
    letter.is_control() || is_of_layout
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_shown_as_text() {
        assert_eq!(
            escaped("/p\u{1b}[2J\u{7}\r\u{9b}\u{7f}"),
            r"/p\u001b[2J\u0007\u000d\u009b\u007f"
        );
        assert_eq!(escaped("a\u{202e}b\u{2066}"), r"a\u202eb\u2066");
        assert_eq!(escaped("größer\n\tals 點"), "größer\n\tals 點");
    }

    #[test]
    fn only_the_first_word_is_coloured() {
        assert_eq!(painted("error: no\n"), "\u{1b}[1;31merror:\u{1b}[0m no\n");
        assert_eq!(painted("warning: x"), "\u{1b}[1;33mwarning:\u{1b}[0m x");
        assert_eq!(painted("an error: no"), "an error: no");
    }

    #[test]
    fn json_keeps_its_meaning() {
        let value = "a\u{1b}\u{9b}\u{202e}\"";
        let text = escaped(&serde_json::json!(value).to_string());
        assert_eq!(serde_json::from_str::<String>(&text).unwrap(), value);
    }
}
