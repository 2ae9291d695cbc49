//! Ctrl-C ends a run cleanly and soon: what is half written is removed, or named where there is no time for that.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use divmerge::annotate::resume::journal_of;
use divmerge::io::{PartialFile, abandon_partial_files};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Outputs under way that can be gone on with.
static OUTPUTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Exit code of a process ended by Ctrl-C.
pub const ENDED: u8 = 130;

/// How long a run has to end by itself: it may be waiting for input that never comes, or be in the middle of a huge
/// chunk.
const GRACE: Duration = Duration::from_millis(600);

/// Takes Ctrl-C and a request to terminate as a wish to stop. A run that does not heed it in time is ended. Where they
/// cannot be had, they end it as ever.
pub fn listen() {
    // The handler has a thread of its own.
    let _ = ctrlc::set_handler(|| {
        if !INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::thread::sleep(GRACE);
        }
        eprintln!("error: interrupted; {}", left());
        std::process::exit(ENDED.into());
    });
}

/// Notes what is being written and can be gone on with, so that it is left and named.
pub fn is_writing(output: &Path) {
    OUTPUTS.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(output.to_owned());
}

/// What a run that is ended leaves behind; what nobody can go on with is removed.
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
            "what was done so far is left in {}: the same command with --resume goes on from there, one without \
             begins anew",
            left.join(" and ")
        ),
    }
}

/// Whether to go on.
pub fn wish() -> ControlFlow<()> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}
