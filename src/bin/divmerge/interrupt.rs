//! Ctrl-C ends a run cleanly: what is half written is removed.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Exit code of a process ended by Ctrl-C.
const ENDED: i32 = 130;

/// Takes Ctrl-C and a request to terminate as a wish to stop; the second ends the process at once. Where
/// they cannot be had, they end it as ever.
pub fn listen() {
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(ENDED);
        }
    });
}

/// Whether to go on.
pub fn wish() -> ControlFlow<()> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}
