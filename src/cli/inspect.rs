//! `divmerge inspect`

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use clap::Args;
use clap::error::ErrorKind;

use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::truth::SourceArguments;
use crate::cli::exit::{Outcome, WrongUsage};
use crate::cli::interrupt;
use crate::cli::shell::command_line;
use crate::datasets::bag::{Bag, METADATA_FILE};
use crate::inspect::{Server, Session, SessionOptions};

/// Look at a frame in the browser: what was found, why, and what another parameter would change
///
/// Serves one page on this machine alone, under an address with a random token, and opens it. It
/// shows the cloud in space, its range image and its bird's-eye plane; explains points that are
/// clicked; clusters the frame again when a parameter is changed; lists the worst frames; and saves
/// figures, commands and cases. It ends with Ctrl-C.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP), or the folder of a rosbag2 recording
    ///
    /// Of a folder with several files the first is taken.
    input: PathBuf,

    /// Cloud topic that is shown first [default: the first readable one]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Number of the cloud that is shown first, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u64,

    /// Address to listen on, of this machine alone; port 0 is any that is free
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:0", value_parser = address)]
    listen: SocketAddr,

    /// Print the address without opening it
    #[arg(long)]
    no_open: bool,

    #[command(flatten)]
    truth: SourceArguments,

    #[command(flatten)]
    method: MethodArguments,
}

fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| "use an address and a port, as in 127.0.0.1:8080".to_owned())
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    if !arguments.listen.ip().is_loopback() {
        let problem = format!(
            "--listen {}: the inspector listens on this machine alone; use 127.0.0.1 or [::1]",
            arguments.listen
        );
        return Err(WrongUsage(ErrorKind::ValueValidation, problem).into());
    }
    interrupt::end_quietly();
    let topics = arguments.topic.as_slice();
    let method = &arguments.method;
    let input = recording(&arguments.input)?;
    let session = Arc::new(Session::open(SessionOptions {
        input: input.clone(),
        topic: arguments.topic.clone(),
        frame: arguments.frame,
        config: method.config_with_warnings(&input, topics)?,
        truth: arguments.truth.source(),
        is_truth_said: arguments.truth.is_said(),
        words: method.words().to_vec(),
        command_line,
    })?);
    let server = Server::start(session, arguments.listen)
        .with_context(|| format!("listening on {}", arguments.listen))?;
    println!("{}", server.address());
    crate::cli::terminal::flush();
    eprintln!("inspecting {}; Ctrl-C ends it", input.display());
    if !arguments.no_open
        && let Err(error) = open::that_detached(server.address())
    {
        eprintln!("warning: no browser could be opened ({error}): open the address above");
    }
    server.wait();
    Ok(Outcome::Done)
}

/// The recording that is looked at: of the folder of a rosbag2 recording its first file.
fn recording(input: &Path) -> Result<PathBuf> {
    if !input.join(METADATA_FILE).is_file() {
        return Ok(input.to_owned());
    }
    let files = Bag::open(input)?.files;
    let first = files.first().map_or_else(|| input.to_owned(), |file| input.join(file));
    if let [_, others @ ..] = files.as_slice()
        && !others.is_empty()
    {
        let (folder, others) = (input.display(), others.join(", "));
        eprintln!("{folder} has more recordings; to look at another, name it: {others}");
    }
    Ok(first)
}
