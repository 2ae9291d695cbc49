//! `divmerge completions`

use anyhow::Result;
use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::{Cli, Outcome};

/// Print a shell completion script, as in `divmerge completions bash > ~/.local/share/bash-completion/completions/divmerge`
#[derive(Args)]
pub struct Arguments {
    /// Which shell
    shell: Shell,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    // Through memory: the generator panics where it cannot write.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "divmerge", &mut script);
    print!("{}", String::from_utf8_lossy(&script));
    Ok(Outcome::Done)
}
