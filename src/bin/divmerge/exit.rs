//! How a command ends: its outcome, its errors, and their exit codes.

use std::io::ErrorKind::BrokenPipe;
use std::panic::AssertUnwindSafe;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Command;
use clap::error::ErrorKind;
use divmerge::frames::last_decoded_cloud;
use divmerge::recording;
use divmerge::recording::abandon_partial_files;

/// A process that Ctrl-C ended.
pub const INTERRUPTED: u8 = 130;
/// A command that failed.
pub const FAILED: u8 = 1;
/// Arguments that cannot be.
pub const WRONG_USAGE: u8 = 2;
const INCOMPLETE: u8 = 3;
/// A standard output whose reader has gone: what a shell shows for a process ended by SIGPIPE.
const CLOSED_PIPE: u8 = 141;

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
            Ok(WrongUsage(kind, problem)) => end_with_usage(command().error(kind, problem)),
            Err(error) => report(&error).into(),
        },
    }
}

/// Reports an error on stderr and returns its exit code. That the reader of standard output has
/// gone, as in `divmerge info F | head`, is not reported.
pub fn report(error: &anyhow::Error) -> u8 {
    let code = code_of(error);
    if code != CLOSED_PIPE {
        eprintln!("error: {}", error_chain(error));
    }
    code
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
        recording::Error::StandardOutput { source } if source.kind() == BrokenPipe => CLOSED_PIPE,
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

/// Ends the process with the help that was asked for, or with an error in the arguments. Colours of
/// an error are left out: it may quote anything.
pub fn end_with_usage<T>(error: clap::Error) -> T {
    if !error.use_stderr() {
        error.exit();
    }
    eprint!("{}", error.render());
    std::process::exit(error.exit_code());
}

/// Says of the first panic of this process, on any thread, where it came from and which cloud was
/// worked on, and asks to report it. With `RUST_BACKTRACE` the backtrace comes before.
pub fn report_panics() {
    static IS_REPORTED: AtomicBool = AtomicBool::new(false);
    let backtrace = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if IS_REPORTED.swap(true, Ordering::Relaxed) {
            return;
        }
        if std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0") {
            backtrace(panic);
        }
        let problem = panic.payload_as_str().unwrap_or("no message");
        let place = panic.location().map(|place| format!(" ({place})")).unwrap_or_default();
        let cloud = last_decoded_cloud().map(|cloud| format!(" The last cloud read: {cloud}."));
        eprintln!(
            "error: a bug in divmerge {}: {problem}{place}.{} No unfinished output is kept. Please \
             report it with this message and, if you can, that cloud (docs/security.md)",
            env!("CARGO_PKG_VERSION"),
            cloud.unwrap_or_default(),
        );
    }));
}

/// What a command returns; `None` if it panicked, on whichever thread. Its unfinished outputs are
/// removed then.
pub fn catch_panic<T>(command: impl FnOnce() -> T) -> Option<T> {
    let result = std::panic::catch_unwind(AssertUnwindSafe(command));
    result.inspect_err(|_| abandon_partial_files(&[])).ok()
}
