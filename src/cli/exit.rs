//! How a command ends: its outcome, its errors, and their exit codes.

use std::io;
use std::io::ErrorKind::{BrokenPipe, NotFound};
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Command;
use clap::error::ErrorKind;

use crate::ParameterError;
use crate::error::Conflict;
use crate::error::spelling::did_you_mean;
use crate::frames::last_decoded_cloud;
use crate::recording;
use crate::recording::abandon_partial_files;

/// A command that did everything.
const DONE: u8 = 0;
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

/// Arguments that contradict each other or the input, and what to do instead.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Contradiction(pub String);

/// Ends a function with a [`Contradiction`].
macro_rules! contradict {
    ($($text:tt)*) => { return Err($crate::cli::exit::Contradiction(format!($($text)*)).into()) };
}
pub(crate) use contradict;

/// A feature that this binary was built without.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NotBuilt(pub &'static str);

/// Reports the errors of a finished command on stderr and returns its exit code. `command` is the
/// subcommand, whose usage is shown with [`WrongUsage`].
pub fn exit_code(result: anyhow::Result<Outcome>, command: impl FnOnce() -> Command) -> u8 {
    match result {
        Ok(Outcome::Done) => DONE,
        Ok(Outcome::Incomplete) => INCOMPLETE,
        Err(error) => match error.downcast::<WrongUsage>() {
            Ok(WrongUsage(kind, problem)) => end_with_usage(command().error(kind, problem)),
            Err(error) => report(&error),
        },
    }
}

/// Reports an error on stderr and returns its exit code. That the reader of standard output has
/// gone, as in `divmerge info F | head`, is not reported.
pub fn report(error: &anyhow::Error) -> u8 {
    let code = code_of(error);
    if code != CLOSED_PIPE {
        eprintln!("error: {}{}", error_chain(error), near_file(error));
    }
    code
}

/// A question behind the error of a file that is not there: the nearest name beside it, if one is
/// near.
fn near_file(error: &anyhow::Error) -> String {
    let missing = |path: &Path, source: &io::Error| {
        (source.kind() == NotFound && !path.exists()).then(|| path.to_owned())
    };
    let path = match error.downcast_ref::<crate::Error>() {
        Some(crate::Error::Io { path, source }) => missing(path, source),
        Some(crate::Error::Recording(recording::Error::Io { path, source })) => {
            missing(path, source)
        }
        _ => match error.downcast_ref::<recording::Error>() {
            Some(recording::Error::Io { path, source }) => missing(path, source),
            _ => None,
        },
    };
    path.map_or(String::new(), |path| nearest_file(&path))
}

/// A question behind a path that is not there: the nearest name beside it, if one is near.
pub fn nearest_file(path: &Path) -> String {
    let folder = path.parent().filter(|folder| *folder != "").unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names: Vec<String> =
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    did_you_mean(&name, &names)
}

fn code_of(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<crate::Error>() {
        Some(crate::Error::Interrupted { .. } | crate::Error::Left { .. }) => INTERRUPTED,
        Some(crate::Error::NoCloud { problem, .. }) if problem.is_of_arguments() => WRONG_USAGE,
        Some(crate::Error::Conflict { problem: Conflict::NoMotion { .. }, .. }) => WRONG_USAGE,
        Some(crate::Error::Recording(error)) => code_of_recording(error),
        Some(
            crate::Error::Setting(_)
            | crate::Error::Parameter(_)
            | crate::Error::Figure(_)
            | crate::Error::ParameterFile { .. },
        ) => WRONG_USAGE,
        _ if error.is::<ParameterError>() || error.is::<Contradiction>() => WRONG_USAGE,
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

/// What a command returns; the exit code if it panicked, on whichever thread. Its unfinished
/// outputs are removed then.
pub fn catch_panic<T>(command: impl FnOnce() -> T) -> Result<T, u8> {
    std::panic::catch_unwind(AssertUnwindSafe(command)).map_err(|_| {
        abandon_partial_files(&[]);
        FAILED
    })
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::path::Path;
    use std::process::Output;
    use std::sync::Arc;

    use crate::annotate::{AnnotateConfig, AnnotateOptions, annotate};
    use crate::datasets::drive::write_drive;
    use crate::pipeline::Config;
    use crate::recording::WriteOptions;
    use crate::simulate::{Drive, Scene, Sensor};
    use crate::{Method, MethodInput, Segmentation};

    use super::*;

    /// Names the folder in the process that panics.
    const FOLDER: &str = "DIVMERGE_FOLDER_OF_A_PANIC";
    /// Its number of threads.
    const THREADS: &str = "DIVMERGE_THREADS_OF_A_PANIC";
    const NAME: &str = "cli::exit::tests::a_panic_ends_in_a_report_and_without_an_output";

    /// A method with a bug.
    #[derive(Debug)]
    struct Buggy;

    impl Method for Buggy {
        fn name(&self) -> &'static str {
            "buggy"
        }

        fn parameters(&self) -> serde_json::Value {
            serde_json::Value::Null
        }

        fn segment(&self, _input: &MethodInput) -> Segmentation {
            panic!("a bug of the method")
        }
    }

    /// Annotates `in.mcap` of a folder as the command does, with a method that panics.
    fn annotate_with_a_bug(folder: &Path, threads: usize) -> u8 {
        report_panics();
        let pipeline = Config { other_method: Some(Arc::new(Buggy)), ..Config::best() };
        let options = AnnotateOptions {
            config: AnnotateConfig { pipeline, ..AnnotateConfig::default() },
            force: true,
            resumable: true,
            threads,
            ..AnnotateOptions::default()
        };
        let (input, output) = (folder.join("in.mcap"), folder.join("out.mcap"));
        let ended = catch_panic(|| {
            annotate(&input, &output, &options, &mut |_| ControlFlow::Continue(())).map(drop)
        });
        ended.map_or_else(|code| code, |_| 0)
    }

    /// This test in a process of its own, which panics.
    fn panicking(folder: &Path, threads: &str) -> Output {
        std::process::Command::new(std::env::current_exe().expect("a test"))
            .args([NAME, "--exact", "--nocapture"])
            .env(FOLDER, folder)
            .env(THREADS, threads)
            .env_remove("RUST_BACKTRACE")
            .output()
            .expect("the test runs")
    }

    #[test]
    fn a_panic_ends_in_a_report_and_without_an_output() {
        if let (Some(folder), Ok(threads)) = (std::env::var_os(FOLDER), std::env::var(THREADS)) {
            let threads = threads.parse().expect("a number");
            std::process::exit(annotate_with_a_bug(Path::new(&folder), threads).into());
        }
        let folder = tempfile::tempdir().expect("a folder");
        let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
        let (input, output) = (folder.path().join("in.mcap"), folder.path().join("out.mcap"));
        write_drive(&drive, 4, &input, &WriteOptions::default(), |_| ControlFlow::Continue(()))
            .expect("written");
        std::fs::write(&output, "older").expect("written");
        for threads in ["1", "3"] {
            let done = panicking(folder.path(), threads);
            let said = String::from_utf8_lossy(&done.stderr).into_owned();
            assert_eq!(done.status.code(), Some(1), "{said}");
            assert_eq!(said.lines().count(), 1, "{said}");
            for part in [
                "error: a bug in divmerge",
                "a bug of the method (src/cli/exit.rs:",
                "The last cloud read: frame ",
                " of /lidar/points, message ",
                " of the chunk at byte ",
                "Please report it",
            ] {
                assert!(said.contains(part), "{part}: {said}");
            }
            assert_eq!(std::fs::read(&output).expect("kept"), b"older");
            let left = std::fs::read_dir(folder.path()).expect("a folder").count();
            assert_eq!(left, 2, "input and older output");
        }
    }
}
