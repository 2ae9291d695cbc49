//! One execution, watched: does it panic, what does it allocate, how long does it take?

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What the last panic said, and where.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Bytes that an execution may have allocated at a time, beyond what was there before: so many for
/// each byte of the input, and so many besides.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    /// For each byte of the input.
    pub times: usize,
    /// Besides: tables and buffers whose size does not depend on the input.
    pub plus: usize,
}

/// What became of an execution.
pub struct Outcome {
    /// How it ended, in words: the same for inputs that end alike, but for numbers.
    pub words: String,
    /// Why it is a failure, if it is one.
    pub failure: Option<String>,
    /// Most bytes allocated at a time.
    pub bytes: usize,
    /// How long it took.
    pub time: Duration,
}

/// Lets panics be taken down, not printed.
pub fn listen() {
    std::panic::set_hook(Box::new(|panic| {
        let said = panic.payload();
        let said = said.downcast_ref::<String>().map(String::as_str);
        let said = said.or_else(|| panic.payload().downcast_ref::<&str>().copied());
        let place = panic.location().map(ToString::to_string).unwrap_or_default();
        let words = format!("panic at {place}: {}", said.unwrap_or("?"));
        *PANIC.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = words;
    }));
}

/// Runs `target` on `input`. An error that it returns is a good end; one that starts with `wrong:`
/// is not.
pub fn run(target: fn(&[u8]) -> Result<String, String>, input: &[u8], bound: Bound) -> Outcome {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let started = Instant::now();
    let ended = catch_unwind(AssertUnwindSafe(|| target(input)));
    let time = started.elapsed();
    let bytes = MEMORY.peak_usage().saturating_sub(before);
    let most = input.len() * bound.times + bound.plus;
    let (words, failure) = match ended {
        Err(_) => {
            let words = PANIC.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone();
            (words.clone(), Some(words))
        }
        Ok(Err(words)) if words.starts_with("wrong:") => (words.clone(), Some(words)),
        Ok(Ok(words) | Err(words)) if bytes > most => {
            let failure = format!("{bytes} bytes allocated for {} (at most {most})", input.len());
            (words, Some(failure))
        }
        Ok(Ok(words) | Err(words)) => (words, None),
    };
    Outcome { words, failure, bytes, time }
}
