//! The command line: arguments, exit codes, and one file a command.

mod annotate;
mod arguments;
mod boxes;
mod compare;
mod completions;
mod convert;
mod demo;
mod diff;
mod evaluate;
mod explain;
mod explain_text;
mod export;
mod failures;
mod figure;
mod geometry;
mod info;
mod interrupt;
mod join;
mod objects;
mod plan;
mod profile;
mod simulate;
mod sweep;
mod table;
mod terminal;
mod triage;
mod triage_report;
mod truth;
mod view;
mod viewer;

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use divmerge::io::address::{is_remote, put_secrets_aside};
use divmerge::io::recording;

/// Cuts the LiDAR clouds of a recording into object instances.
///
/// Reads point clouds out of an MCAP recording, clusters them by divide and merge on the range image
/// (Zhao, Zhang, Huang, arXiv 2109.08224), and writes an annotated MCAP that is otherwise the same
/// recording.
#[derive(Parser)]
#[command(
    name = "divmerge",
    version,
    after_help = "Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but some clouds could not be \
                  read or the input is cut off (each named on stderr); 130 interrupted.\n\nStart with `divmerge demo`."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Arguments),
    Simulate(simulate::Arguments),
    Convert(convert::Arguments),
    Info(info::Arguments),
    Annotate(annotate::Arguments),
    Plan(plan::Arguments),
    Join(join::Arguments),
    View(view::Arguments),
    Figure(figure::Arguments),
    Explain(explain::Arguments),
    Triage(triage::Arguments),
    Evaluate(evaluate::Arguments),
    Failures(failures::Arguments),
    Compare(compare::Arguments),
    Sweep(sweep::Arguments),
    Diff(diff::Arguments),
    Export(export::Arguments),
    Completions(completions::Arguments),
}

/// How a command that did not fail ended.
enum Outcome {
    Done,
    /// Some clouds could not be read, or the input is cut off.
    Incomplete,
}

/// Something this binary was not built to do.
#[derive(Debug)]
struct NotBuilt(&'static str);

impl std::fmt::Display for NotBuilt {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.write_str(self.0)
    }
}

impl std::error::Error for NotBuilt {}

const FAILED: u8 = 1;
const WRONG_USAGE: u8 = 2;
const INCOMPLETE: u8 = 3;

fn main() -> ExitCode {
    end_quietly_on_a_closed_pipe();
    let result = match Cli::parse_from(arguments()).command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Annotate(arguments) => annotate::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Join(arguments) => join::run(&arguments),
        Command::View(arguments) => view::run(&arguments),
        Command::Figure(arguments) => figure::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Triage(arguments) => triage::run(&arguments),
        Command::Evaluate(arguments) => evaluate::run(&arguments),
        Command::Failures(arguments) => failures::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Sweep(arguments) => sweep::run(&arguments),
        Command::Diff(arguments) => diff::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Incomplete) => ExitCode::from(INCOMPLETE),
        Err(error) => {
            eprintln!("error: {}", told(&error));
            ExitCode::from(exit_code(&error))
        }
    }
}

/// The words of the command line; what is secret of addresses is put aside before anything is shown or written.
fn arguments() -> impl Iterator<Item = OsString> {
    std::env::args_os().map(|word| {
        let Some(text) = word.to_str() else { return word };
        // Also behind the name of an option.
        let (option, value) = match text.split_once('=') {
            Some((option, value)) if option.starts_with("--") => (format!("{option}="), value),
            _ => (String::new(), text),
        };
        (option + &put_secrets_aside(value).to_string_lossy()).into()
    })
}

fn exit_code(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<divmerge::Error>() {
        Some(divmerge::Error::Interrupted { .. } | divmerge::Error::Left { .. }) => {
            interrupt::ENDED
        }
        Some(divmerge::Error::Recording(error)) => recording_exit_code(error),
        _ if error.is::<NotBuilt>() => WRONG_USAGE,
        _ => error.downcast_ref().map_or(FAILED, recording_exit_code),
    }
}

fn recording_exit_code(error: &recording::Error) -> u8 {
    match error {
        recording::Error::Interrupted { .. } => interrupt::ENDED,
        recording::Error::NoRemote { .. } => WRONG_USAGE,
        _ => FAILED,
    }
}

/// `divmerge info F | head` closes our output early; printing then panics, and that is no failure to
/// report.
fn end_quietly_on_a_closed_pipe() {
    /// What a shell shows for a process ended by SIGPIPE.
    const ENDED: i32 = 141;
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let said = panic.payload().downcast_ref::<String>();
        if said.is_some_and(|said| said.starts_with("failed printing to stdout")) {
            std::process::exit(ENDED);
        }
        report(panic);
    }));
}

/// An error and its causes, each said once.
fn told(error: &anyhow::Error) -> String {
    let mut told = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !told.contains(&cause) {
            told += &format!(": {cause}");
        }
    }
    told
}

/// Refuses to replace a file unless that was asked for.
fn refuse_existing(output: &Path, force: bool) -> anyhow::Result<()> {
    refuse_address(output)?;
    if !force && output.symlink_metadata().is_ok() {
        anyhow::bail!("{} exists already; --force replaces it", output.display());
    }
    Ok(())
}

/// Refuses to write anywhere but into files.
fn refuse_address(output: &Path) -> anyhow::Result<()> {
    if is_remote(output) {
        anyhow::bail!("{}: is an address; outputs are files", output.display());
    }
    Ok(())
}
