//! The options in the file of `--config`, which stand for those that are not given.

use std::ffi::OsString;

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command, Error};

use crate::cli::arguments::parameters::ConfigFile;
use crate::parameter_file::ParameterFile;

/// Commands whose options a file may hold.
const COMMANDS: &[&str] = &["annotate", "explain", "figure", "triage", "failures", "view"];

/// The words of the command line with those options of the file of `--config` that are not given;
/// `None` without such a file. Options of other commands are left out.
pub fn with_options(
    words: &[OsString],
    matches: &ArgMatches,
    cli: &mut Command,
) -> Option<Result<Vec<OsString>, Error>> {
    let (name, given) = matches.subcommand()?;
    let config = given.try_get_one::<ConfigFile>("config").ok().flatten()?;
    cli.build();
    let place = words.iter().skip(1).position(|word| word == name)? + 2;
    let command = cli.find_subcommand(name)?;
    Some(options(config, command, given, cli).map(|options| {
        let (before, after) = words.split_at(place);
        before.iter().cloned().chain(options).chain(after.iter().cloned()).collect()
    }))
}

/// The options of the file that are not given, as words.
fn options(
    ConfigFile { path, file }: &ConfigFile,
    command: &Command,
    given: &ArgMatches,
    cli: &Command,
) -> Result<Vec<OsString>, Error> {
    let wrong = |kind, problem: String| {
        Err(command.clone().error(kind, format!("--config {}: {problem}", path.display())))
    };
    let is_given =
        |arg: &Arg| given.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine);
    for (name, was) in &file.options.needs {
        if option(command, name).is_some_and(|arg| !is_given(arg)) {
            let problem = format!(
                "the run had --{name} {was}; give it again, since recordings hold no names of files"
            );
            return wrong(ErrorKind::MissingRequiredArgument, problem);
        }
    }
    let mut words = Vec::new();
    for (name, values) in all_options(file) {
        match option(command, &name) {
            Some(arg) if is_given(arg) => {}
            Some(_) if values.is_empty() => words.push(format!("--{name}").into()),
            Some(_) => {
                words.extend(values.iter().map(|value| format!("--{name}={value}").into()));
            }
            None if is_known(cli, &name) => {}
            None => return wrong(ErrorKind::UnknownArgument, format!("no option `{name}`")),
        }
    }
    Ok(words)
}

/// The options of a file, with its preset and its method.
fn all_options(file: &ParameterFile) -> Vec<(String, Vec<String>)> {
    let preset = file.preset.map(|preset| ("preset".to_owned(), vec![preset.name().to_owned()]));
    let method = file.method.clone().map(|method| ("method".to_owned(), vec![method]));
    let others = file.options.given.clone();
    preset.into_iter().chain(method).chain(others).collect()
}

fn option<'a>(command: &'a Command, name: &str) -> Option<&'a Arg> {
    command.get_arguments().find(|arg| arg.get_long() == Some(name))
}

/// Whether another command has the option.
fn is_known(cli: &Command, name: &str) -> bool {
    let commands = COMMANDS.iter().filter_map(|command| cli.find_subcommand(command));
    commands.into_iter().any(|command| option(command, name).is_some())
}
