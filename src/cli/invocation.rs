//! How this program was called, so that it can call itself again.

use std::ffi::OsString;
use std::process::Command;
use std::sync::OnceLock;

use anyhow::{Context, Result};

/// The program with what comes before its arguments, and the arguments, secrets in addresses
/// included.
static CALLED: OnceLock<(Vec<OsString>, Vec<OsString>)> = OnceLock::new();

/// Notes the program, and the words of its command line: name and arguments.
pub fn remember(program: Vec<OsString>, words: Vec<OsString>) {
    let arguments = words.into_iter().skip(1).collect();
    // A second call in one process is answered as the first was made.
    let _ = CALLED.set((program, arguments));
}

/// A process of this program with the same arguments.
pub fn again() -> Result<Command> {
    let (program, arguments) = CALLED.get().context("how divmerge was called is not known")?;
    let (path, before) = program.split_first().context("where divmerge is is not known")?;
    let mut again = Command::new(path);
    again.args(before).args(arguments);
    Ok(again)
}
