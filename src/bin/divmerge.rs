//! The binary. The command line itself is a module of the library, which Python's `divmerge` calls
//! too.

use std::ffi::OsString;
use std::process::ExitCode;

fn main() -> ExitCode {
    let words: Vec<OsString> = std::env::args_os().collect();
    let program = std::env::current_exe().map(OsString::from).into_iter().collect();
    divmerge::cli::main(program, words).into()
}
