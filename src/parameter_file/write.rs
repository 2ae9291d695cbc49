//! Parameters as TOML.

use serde_json::Value;

use super::{NEEDS, OPTIONS, RunOptions};
use divmerge_core::parameters::{Parameter, ParameterKind, ParameterSet};
use divmerge_core::pipeline::Preset;

use crate::text::wrapped;

/// Letters of a line of a comment.
const WIDTH: usize = 96;

/// The parameters and the options of a run, without a word about them.
pub fn plain_toml(parameters: &ParameterSet, options: &RunOptions) -> String {
    let mut text = head(parameters);
    if !options.given.is_empty() {
        text += &format!("\n[{OPTIONS}]\n");
        for (name, values) in &options.given {
            let value = match values.as_slice() {
                [] => true.into(),
                [one] => one.as_str().into(),
                several => Value::from(several),
            };
            text += &format!("{name} = {}\n", toml(&value));
        }
    }
    if !options.needs.is_empty() {
        text += &format!("\n[{NEEDS}]\n");
        for (name, was) in &options.needs {
            text += &format!("{name} = {}\n", toml(&was.as_str().into()));
        }
    }
    Tables::of(parameters, &|_| true, false).write(text)
}

/// The parameters with their meaning, unit, limits and source. Where one is not the preset's, that
/// is said. Parts that are off stand there with their usual values, as comments.
///
/// Only those that `is_shown`.
pub fn explained_toml(parameters: &ParameterSet, is_shown: impl Fn(&Parameter) -> bool) -> String {
    Tables::of(parameters, &is_shown, true).write(head(parameters))
}

fn head(parameters: &ParameterSet) -> String {
    format!("preset = {}\n", toml(&parameters.preset.into()))
}

/// The tables of a file in the order in which they are written.
struct Tables(Vec<Table>);

/// A table of a file.
#[derive(Default)]
struct Table {
    path: String,
    /// What its part of the method is, as a comment.
    about: String,
    lines: String,
    /// Whether its part is off, so that all of it is a comment.
    is_off: bool,
}

impl Tables {
    fn of(
        parameters: &ParameterSet,
        is_shown: &dyn Fn(&Parameter) -> bool,
        explains: bool,
    ) -> Self {
        let mut tables = Tables(Vec::new());
        // What stands in no table has to come first.
        tables.table("");
        if let Some(method) = &parameters.other_method {
            tables.table("method").lines = format!("name = {}\n", toml(&method.name().into()));
        }
        let preset: Preset = parameters.preset.parse().unwrap_or_default();
        let (usual, full) = (ParameterSet::of_preset(preset), ParameterSet::with_all_parts());
        for parameter in parameters.parameters().into_iter().filter(is_shown) {
            let path = parameter.path.as_str();
            let value = parameters.get(path).ok().flatten();
            let is_on = value != Some(Value::Bool(false));
            let comment = if explains { comment(&parameter, is_on) } else { String::new() };
            if let Some(own) = own_table(&parameter, value.as_ref(), &full) {
                tables.table(&own).about = comment;
                continue;
            }
            let is_off = value.is_none();
            let Some(shown) = value.or_else(|| full.get(path).ok().flatten().filter(|_| explains))
            else {
                continue;
            };
            let others = usual.get(path).ok().flatten().filter(|usual| !is_off && *usual != shown);
            let remark = match (explains, others, degrees(&parameter, &shown)) {
                (true, Some(others), _) => {
                    format!(" # preset {}: {}", parameters.preset, toml(&others))
                }
                (true, None, Some(degrees)) => format!(" # {degrees} degrees"),
                _ => String::new(),
            };
            let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
            let table = tables.table(table);
            table.is_off |= is_off;
            let space = if explains { "\n" } else { "" };
            table.lines += &format!("{space}{comment}{key} = {}{remark}\n", toml(&shown));
        }
        tables
    }

    fn table(&mut self, path: &str) -> &mut Table {
        let place = self.0.iter().position(|table| table.path == path);
        let place = place.unwrap_or_else(|| {
            self.0.push(Table { path: path.to_owned(), ..Table::default() });
            self.0.len() - 1
        });
        &mut self.0[place]
    }

    fn write(self, mut text: String) -> String {
        for Table { path, about, lines, is_off } in self.0 {
            let table = match path.as_str() {
                "" => lines,
                path => format!("\n{about}[{path}]\n{lines}"),
            };
            match is_off {
                false => text += &table,
                true => table.lines().for_each(|line| text += &commented(line)),
            }
        }
        text
    }
}

/// A line as a comment.
fn commented(line: &str) -> String {
    match line {
        "" => "\n".to_owned(),
        comment if comment.starts_with('#') => format!("#{comment}\n"),
        line => format!("# {line}\n"),
    }
}

/// The table that stands for a part that is on, or for a variant with parameters of its own.
fn own_table(parameter: &Parameter, value: Option<&Value>, full: &ParameterSet) -> Option<String> {
    let path = &parameter.path;
    match (&parameter.kind, value?) {
        (ParameterKind::Switch, Value::Bool(true)) => Some(path.clone()),
        (ParameterKind::Choice { .. }, Value::String(name)) => {
            let own = format!("{path}.{name}");
            let below = format!("{own}.");
            full.parameters().iter().any(|other| other.path.starts_with(&below)).then_some(own)
        }
        _ => None,
    }
}

/// What a parameter means, in lines of comment.
fn comment(parameter: &Parameter, is_on: bool) -> String {
    let mut lines = wrapped(&parameter.doc, WIDTH);
    if let ParameterKind::Choice { choices } = &parameter.kind {
        for choice in choices {
            let about = wrapped(&format!("{}: {}", choice.name, choice.doc), WIDTH - 2);
            let marks = std::iter::once("- ").chain(std::iter::repeat("  "));
            lines.extend(marks.zip(about).map(|(mark, line)| format!("{mark}{line}")));
        }
    }
    let source = parameter.source.as_deref().unwrap_or("ours");
    lines.extend(wrapped(&format!("{}Source: {source}.", wanted(parameter, is_on)), WIDTH));
    lines.iter().map(|line| format!("# {line}\n")).collect()
}

/// What may stand in the place of a value, as a sentence.
fn wanted(parameter: &Parameter, is_on: bool) -> String {
    let (table, key) = parameter.path.rsplit_once('.').unwrap_or(("", &parameter.path));
    let limits = match &parameter.kind {
        ParameterKind::Choice { .. } => return String::new(),
        ParameterKind::Switch if is_on && table.is_empty() => {
            return format!("`{key} = false` above all tables switches it off. ");
        }
        ParameterKind::Switch if is_on => {
            return format!("`{key} = false` under [{table}] switches it off. ");
        }
        ParameterKind::Switch => {
            return format!("A table [{}] in its place switches it on. ", parameter.path);
        }
        ParameterKind::Number { limits } | ParameterKind::Whole { limits } => limits.slider,
        ParameterKind::Flag | ParameterKind::List { .. } => None,
    };
    let wanted = parameter.wanted();
    let (first, rest) = wanted.split_at(1);
    let usual = limits.map_or(String::new(), |[from, to]| format!("; usually {from} to {to}"));
    format!("{}{rest}{usual}. ", first.to_uppercase())
}

/// An angle in degrees.
fn degrees(parameter: &Parameter, value: &Value) -> Option<f64> {
    let radians = value.as_f64().filter(|_| parameter.unit.as_deref() == Some("rad"))?;
    Some((radians.to_degrees() * 1e6).round() / 1e6)
}

/// A value as TOML, which has JSON's numbers, names and lists of them.
fn toml(value: &Value) -> String {
    // TOML wants this one escaped, JSON does not.
    value.to_string().replace('\u{7f}', "\\u007f")
}
