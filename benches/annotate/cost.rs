//! Time of a run.

use std::time::Instant;

/// Milliseconds a frame.
#[derive(Clone, Copy)]
pub(super) struct Cost {
    pub(super) wall: f64,
    /// On processors, all threads.
    pub(super) all: f64,
    /// On processors, the thread that called.
    pub(super) alone: f64,
}

impl Cost {
    pub(super) const MOST: Cost =
        Cost { wall: f64::INFINITY, all: f64::INFINITY, alone: f64::INFINITY };

    pub(super) fn of(frames: usize, run: impl FnOnce()) -> Self {
        let (all, alone, started) = (process_ms(), thread_ms(), Instant::now());
        run();
        let wall = started.elapsed().as_secs_f64() * 1e3;
        let per_frame = |ms: f64| ms / frames as f64;
        Cost {
            wall: per_frame(wall),
            all: per_frame(process_ms() - all),
            alone: per_frame(thread_ms() - alone),
        }
    }

    pub(super) fn least(self, other: Cost) -> Self {
        Cost {
            wall: self.wall.min(other.wall),
            all: self.all.min(other.all),
            alone: self.alone.min(other.alone),
        }
    }

    /// On idle cores, two if the work is shared.
    pub(super) fn idle(self, is_shared: bool) -> f64 {
        if is_shared { self.alone.max(self.all / 2.0) } else { self.all }
    }
}

/// Milliseconds that this process was on processors, in steps of a hundredth of a second.
fn process_ms() -> f64 {
    const MS_PER_TICK: f64 = 10.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // User and system time are the 12th and 13th behind the command's name in brackets.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks = fields.skip(11).take(2).filter_map(|field| field.parse::<f64>().ok());
    ticks.sum::<f64>() * MS_PER_TICK
}

/// Milliseconds that this thread was on a processor.
fn thread_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let ns = stat.split_whitespace().next().and_then(|field| field.parse::<f64>().ok());
    ns.unwrap_or(f64::NAN) / 1e6
}
