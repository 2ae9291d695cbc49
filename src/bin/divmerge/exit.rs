//! How a command ends: its outcome, its errors, and their exit codes.

use std::process::ExitCode;

use clap::Command;
use clap::error::ErrorKind;
use divmerge::recording;

/// A process that Ctrl-C ended.
pub const INTERRUPTED: u8 = 130;
const FAILED: u8 = 1;
/// Arguments that cannot be.
pub const WRONG_USAGE: u8 = 2;
const INCOMPLETE: u8 = 3;

/// How a command that did not fail ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything was done.
    Done,
    /// Some clouds could not be read, or the input is cut off.
    Incomplete,
}

impl Outcome {
    /// `Done` if everything was done.
    pub fn of(is_complete: bool) -> Self {
        if is_complete { Outcome::Done } else { Outcome::Incomplete }
    }
}

/// Arguments that do not fit each other.
#[derive(Debug, thiserror::Error)]
#[error("{1}")]
pub struct WrongUsage(pub ErrorKind, pub String);

/// An output that a command may not write, and what to do instead.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct RefusedOutput(pub String);

impl RefusedOutput {
    /// From an error of a check.
    pub fn of(error: recording::Error) -> Self {
        RefusedOutput(error.to_string())
    }
}

/// Arguments that name what the input does not have.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NotThere(pub String);

/// A feature that this binary was built without.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NotBuilt(pub &'static str);

/// Reports the errors of a finished command on stderr and returns its exit code. `command` is the
/// subcommand, whose usage is shown with [`WrongUsage`].
pub fn exit_code(result: anyhow::Result<Outcome>, command: impl FnOnce() -> Command) -> ExitCode {
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Incomplete) => INCOMPLETE.into(),
        Err(error) => match error.downcast::<WrongUsage>() {
            Ok(WrongUsage(kind, problem)) => command().error(kind, problem).exit(),
            Err(error) => {
                eprintln!("error: {}", error_chain(&error));
                code_of(&error).into()
            }
        },
    }
}

fn code_of(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<divmerge::Error>() {
        Some(divmerge::Error::Interrupted { .. } | divmerge::Error::Left { .. }) => INTERRUPTED,
        Some(divmerge::Error::NoCloud { problem, .. }) if problem.is_of_arguments() => WRONG_USAGE,
        Some(divmerge::Error::Recording(error)) => code_of_recording(error),
        _ if error.is::<NotBuilt>() || error.is::<RefusedOutput>() || error.is::<NotThere>() => {
            WRONG_USAGE
        }
        _ => error.downcast_ref().map_or(FAILED, code_of_recording),
    }
}

fn code_of_recording(error: &recording::Error) -> u8 {
    match error {
        recording::Error::Interrupted { .. } => INTERRUPTED,
        recording::Error::NoRemote { .. } => WRONG_USAGE,
        _ => FAILED,
    }
}

/// An error and its causes, without those that repeat the error before them.
pub fn error_chain(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text += &format!(": {cause}");
        }
    }
    text
}

/// Ends the process when the reader of its output has gone, as in `divmerge info F | head`.
/// Printing panics then, which is not a failure to report.
pub fn end_quietly_on_a_closed_pipe() {
    /// What a shell shows for a process ended by SIGPIPE.
    const CLOSED_PIPE: i32 = 141;
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let message = panic.payload().downcast_ref::<String>();
        if message.is_some_and(|text| text.starts_with("failed printing to stdout")) {
            std::process::exit(CLOSED_PIPE);
        }
        report(panic);
    }));
}
