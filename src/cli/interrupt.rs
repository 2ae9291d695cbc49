//! Ctrl-C ends a run cleanly and soon. Partial outputs are removed, or kept and named if the run
//! can be resumed.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::Error;
use crate::annotate::resume::journal_of;
use crate::recording::{PartialFile, abandon_partial_files};

use crate::cli::exit::INTERRUPTED as EXIT_CODE;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Outputs of runs that can be resumed.
static OUTPUTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// How long a run may take to end by itself: it may wait for input that never comes, or be in the
/// middle of a huge chunk.
const GRACE: Duration = Duration::from_millis(600);

/// Catches Ctrl-C and requests to terminate. A run that does not stop in time is ended. If they
/// cannot be caught, they end the process as usual.
pub fn listen() {
    // The handler has a thread of its own.
    let _ = ctrlc::set_handler(|| {
        if !INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::thread::sleep(GRACE);
        }
        eprintln!("error: interrupted; {}", left());
        std::process::exit(EXIT_CODE.into());
    });
}

/// Ends the process at Ctrl-C without a word: what is served until then has done all it should.
pub fn end_quietly() {
    let _ = ctrlc::set_handler(|| std::process::exit(0));
}

/// Notes an output whose run can be resumed, so that its partial files are kept and named.
pub fn is_writing(output: &Path) {
    OUTPUTS.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(output.to_owned());
}

/// Removes partial files that cannot be resumed and names the others.
fn left() -> String {
    let outputs = OUTPUTS.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    abandon_partial_files(&outputs);
    let written =
        outputs.iter().flat_map(|output| [PartialFile::name_for(output), journal_of(output)]);
    let left: Vec<String> =
        written.filter(|path| path.exists()).map(|path| path.display().to_string()).collect();
    match left.is_empty() {
        true => "nothing was written".to_owned(),
        false => format!(
            "the work so far is kept in {}: run the same command with --resume to continue, or \
             without it to start again",
            left.join(" and ")
        ),
    }
}

/// `Break` after Ctrl-C.
pub fn check() -> ControlFlow<()> {
    match INTERRUPTED.load(Ordering::Relaxed) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}

/// An error after Ctrl-C that names the output.
pub fn check_for(output: &Path) -> crate::Result<()> {
    match check() {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Error::Interrupted { path: output.to_owned() }),
    }
}
