//! `divmerge completions`

use anyhow::Result;
use clap::{Args, Command};
use clap_complete::Shell;

use crate::cli::exit::Outcome;

/// Print a shell completion script
#[derive(Args)]
pub struct Arguments {
    /// The shell
    shell: Shell,
}

pub fn run(arguments: &Arguments, command: &mut Command) -> Result<Outcome> {
    // Through memory: the generator panics where it cannot write.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, command, "divmerge", &mut script);
    print!("{}", String::from_utf8_lossy(&script));
    Ok(Outcome::Done)
}
