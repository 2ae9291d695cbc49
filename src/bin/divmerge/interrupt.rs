//! Ctrl-C ends a run cleanly: what is half written is removed.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use divmerge::io::abandon_partial_files;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Exit code of a process ended by Ctrl-C.
pub const ENDED: u8 = 130;

/// How long a run may take to notice. Reading a recording without an index, a large cloud or a slow disk can keep it
/// longer; then it is ended where it is.
const PATIENCE: Duration = Duration::from_millis(600);

/// Takes Ctrl-C and a request to terminate as a wish to stop, which is enforced after [`PATIENCE`], or by a second.
/// Where they cannot be had, they end the process as ever.
pub fn listen() {
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            leave();
        }
        thread::spawn(|| {
            thread::sleep(PATIENCE);
            leave();
        });
    });
}

/// Removes what is half written, says so, and ends the process.
fn leave() -> ! {
    let outputs = abandon_partial_files();
    let outputs: Vec<String> = outputs.iter().map(|path| path.display().to_string()).collect();
    match outputs.is_empty() {
        true => eprintln!("error: interrupted; nothing was written"),
        false => eprintln!("error: interrupted; nothing was written to {}", outputs.join(", ")),
    }
    std::process::exit(ENDED.into());
}

/// Whether to go on.
pub fn wish() -> ControlFlow<()> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}
