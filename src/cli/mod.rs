//! The command line: arguments, exit codes, and one file a command. The binary and the Python
//! package's `divmerge` both call [`main`].

// First: its macros print for all others.
#[macro_use]
mod terminal;

mod annotate;
mod annotated;
mod arguments;
mod compare;
mod completions;
mod config;
mod convert;
mod demo;
mod diff;
mod dry_run;
mod evaluate;
mod exit;
mod explain;
mod export;
mod failures;
mod figure;
mod followed;
mod help;
mod info;
mod inspect;
mod interrupt;
mod invocation;
mod join;
mod layout;
mod output;
mod params;
mod plan;
mod progress;
mod report;
mod shell;
mod simulate;
mod sweep;
mod table;
mod text;
mod triage;
mod view;
mod viewer;

use std::ffi::OsString;

use anyhow::Result;
use clap::{ArgMatches, ColorChoice, CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::recording::address::put_secrets_aside;
use crate::recording::limit_unpacked;

use arguments::values::bytes;
use exit::Outcome;

/// Cluster the LiDAR clouds of a recording into object instances
///
/// Reads point clouds from an MCAP recording, clusters them by divide and merge on the range image
/// (Zhao, Zhang, Huang, arXiv 2109.08224), and writes an annotated MCAP that is otherwise the same
/// recording.
#[derive(Parser)]
#[command(name = "divmerge", version, after_help = EXIT_CODES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// Bytes to which a recording may unpack, as 500M or 16G; the default is 64 times the size of
    /// its file, or 4G if that is more: points compress to a half, images to a tenth
    #[arg(long, global = true, value_name = "SIZE", value_parser = bytes)]
    #[arg(help_heading = "Performance", hide_short_help = true)]
    max_unpacked: Option<u64>,

    /// Print results and errors alone
    ///
    /// No progress, no warnings, no report of a run.
    #[arg(short, long, global = true, help_heading = "Output", conflicts_with = "verbose")]
    quiet: bool,

    /// Also print which parameters are not the preset's; `annotate` also what it reads, believes
    /// and writes, and the time of each stage
    #[arg(short, long, global = true, help_heading = "Output", hide_short_help = true)]
    verbose: bool,

    /// Colours in help, errors and warnings; `auto`: on a terminal, unless NO_COLOR is set
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    #[arg(help_heading = "Output", hide_short_help = true)]
    color: ColorChoice,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 failed; 2 wrong usage, such as an output that exists or a topic that is not \
there; 3 done, but some clouds could not be read or the input is cut off (each named on stderr); \
130 interrupted.

Start with `divmerge demo`.";

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
    Inspect(inspect::Arguments),
    Figure(figure::Arguments),
    Explain(explain::Arguments),
    Triage(triage::Arguments),
    Evaluate(evaluate::Arguments),
    Failures(failures::Arguments),
    Compare(compare::Arguments),
    Sweep(sweep::Arguments),
    Diff(diff::Arguments),
    Export(export::Arguments),
    Params(params::Arguments),
    Completions(completions::Arguments),
}

/// Runs a command and returns the exit code of this process, which is its own: it answers Ctrl-C,
/// reports panics, and ends where nobody reads what it prints or its arguments are wrong.
///
/// `program` starts this program again: its path, and what comes before the arguments. `words` are
/// the name by which it was called, and the arguments.
pub fn main(program: Vec<OsString>, words: Vec<OsString>) -> u8 {
    exit::report_panics();
    let shown: Vec<OsString> = words.iter().map(without_secrets).collect();
    invocation::remember(program, words);
    end_of(&shown)
}

fn end_of(words: &[OsString]) -> u8 {
    terminal::set_up(false, false, color(words));
    let mut matches = parsed(words);
    if let Some(words) = config::with_options(words, &matches, &mut Cli::command()) {
        matches = parsed(&words.unwrap_or_else(exit::end_with_usage));
    }
    let name = matches.subcommand_name().unwrap_or_default();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(exit::end_with_usage);
    cli.max_unpacked.into_iter().for_each(limit_unpacked);
    terminal::set_up(cli.quiet, cli.verbose, cli.color);
    let ended = exit::catch_panic(|| run(cli.command));
    terminal::flush();
    ended.map_or_else(|code| code, |result| exit::exit_code(result, || command(name)))
}

fn parsed(words: &[OsString]) -> ArgMatches {
    let cli = help::arranged(Cli::command()).color(color(words));
    cli.try_get_matches_from(words).unwrap_or_else(exit::end_with_usage)
}

/// The colours that are asked for: known before the other arguments are, for help and errors.
fn color(words: &[OsString]) -> ColorChoice {
    let texts = || words.iter().filter_map(|word| word.to_str());
    let after = texts().zip(texts().skip(1)).filter(|(option, _)| *option == "--color");
    let joined = texts().filter_map(|word| word.strip_prefix("--color="));
    let choice = joined.chain(after.map(|(_, value)| value)).last();
    choice.and_then(|choice| choice.parse().ok()).unwrap_or_default()
}

fn run(command: Command) -> Result<Outcome> {
    match command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Annotate(arguments) => annotate::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Join(arguments) => join::run(&arguments),
        Command::View(arguments) => view::run(&arguments),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Figure(arguments) => figure::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Triage(arguments) => triage::run(&arguments),
        Command::Evaluate(arguments) => evaluate::run(&arguments),
        Command::Failures(arguments) => failures::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Sweep(arguments) => sweep::run(&arguments),
        Command::Diff(arguments) => diff::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Params(arguments) => params::run(&arguments),
        Command::Completions(arguments) => {
            completions::run(&arguments, &mut help::arranged(Cli::command()))
        }
    }
}

/// A subcommand, to report its wrong usage.
fn command(name: &str) -> clap::Command {
    let mut cli = help::arranged(Cli::command());
    cli.build();
    cli.find_subcommand(name).expect("a parsed subcommand").clone()
}

/// A word of the command line. Secrets in addresses are removed before anything is printed.
fn without_secrets(word: &OsString) -> OsString {
    let Some(text) = word.to_str() else { return word.clone() };
    // Also in --option=value.
    let (option, value) = match text.split_once('=') {
        Some((option, value)) if option.starts_with("--") => (format!("{option}="), value),
        _ => (String::new(), text),
    };
    (option + &put_secrets_aside(value).to_string_lossy()).into()
}
