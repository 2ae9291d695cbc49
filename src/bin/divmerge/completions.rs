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
    clap_complete::generate(
        arguments.shell,
        &mut Cli::command(),
        "divmerge",
        &mut std::io::stdout(),
    );
    Ok(Outcome::Done)
}
