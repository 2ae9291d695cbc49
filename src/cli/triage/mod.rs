//! `divmerge triage`

mod report;

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;

use crate::annotate::{AnnotateConfig, RunEvent};
use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::selection::SelectionArguments;
use crate::cli::arguments::values::{COMPRESSIONS, one_of};
use crate::cli::dry_run::{DryRun, DryRunArgument};
use crate::cli::exit::{Outcome, RefusedOutput};
use crate::cli::interrupt;
use crate::cli::output::{OutputFile, Outputs};
use crate::cli::progress::RecordingProgress;
use crate::cli::shell::{command_line, option_words, path_word};
use crate::cli::text::{fitted, grouped};
use crate::diagnose::triage::TriageParams;
use crate::diagnose::triage::ranking::{RankedCase, Ranking};
use crate::diagnose::triage::recording::{TriageOutput, Triaged, triage_recording};
use crate::diagnose::triage::table::SuspectTable;
use crate::frames::Selection;
use crate::recording::{Compression, Overview};
use crate::view::case_pages::{CaseReport, entry, is_one_file};

/// List the most suspect decisions in a recording, without any truth
///
/// Clusters every frame and looks for close decisions: joins that barely fitted, two instances that
/// would fit one object, thin majorities of votes, instances larger than their class or with two
/// masses, instances that almost touch, points without an instance, missing returns. The likeliest
/// failures come first, each with the command that explains it.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP); it is never changed. The original clouds of an annotated recording are
    /// clustered again
    input: PathBuf,

    #[command(flatten)]
    selection: SelectionArguments,

    #[command(flatten)]
    method: MethodArguments,

    /// Maximum number of cases to list and draw
    #[arg(long, value_name = "N", default_value_t = 20)]
    limit: usize,

    /// Instances of fewer points weigh less, in proportion; in evaluation they never count as
    /// failures
    #[arg(long, value_name = "N", default_value_t = TriageParams::default().min_points)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..))]
    weigh_points: u64,

    /// Write the recording with an additional topic T/suspicion for each cloud topic T: a
    /// DiagnosticArray per cloud
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,

    /// Compression of that recording
    #[arg(long, default_value = "zstd", value_parser = one_of(COMPRESSIONS), requires = "output")]
    compression: Compression,

    /// Write every suspect of every frame as a table
    #[arg(long, value_name = "F.csv")]
    csv: Option<PathBuf>,

    /// Write pages with a figure and an explanation of each case: one .html file, or a folder
    #[arg(long, value_name = "F.html|DIR")]
    report: Option<PathBuf>,

    #[command(flatten)]
    dry_run: DryRunArgument,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    let inputs = std::iter::once(arguments.input.as_path()).chain(arguments.method.files());
    let mut outputs = Outputs::new(inputs, arguments.force);
    let files = OutputFiles::new(arguments, &mut outputs)?;
    let selection = arguments.selection.selection(&arguments.input)?;
    selection.check(&arguments.input)?;
    let method = arguments.method.config_with_warnings(&arguments.input, &selection.topics)?;
    if arguments.dry_run.dry_run {
        return dry_run(arguments, &files, (&selection, &method));
    }
    let start_ns = Overview::read(&arguments.input)?.start_ns.unwrap_or(0);
    let mut ranking = Ranking::new(arguments.limit, start_ns);
    let triaged = triage(arguments, &files, (&selection, &method), &mut ranking)?;
    print(arguments, &ranking, &triaged);
    if let (Some(path), Some(entry)) = (&arguments.report, &files.report) {
        let commands = ranking.cases.iter().map(|case| explain_command(arguments, case)).collect();
        let input = &arguments.input;
        let cases = CaseReport { input, ranking: &ranking, method: &method, commands };
        report::write(&cases, path, entry, &mut outputs)?;
        println!("wrote {}", entry.path().display());
    }
    let replayed = &triaged.visited;
    Ok(Outcome::of(replayed.unreadable == 0 && !replayed.is_cut_off))
}

/// The outputs that were asked for.
struct OutputFiles {
    recording: Option<OutputFile>,
    csv: Option<OutputFile>,
    /// The file of the report to open.
    report: Option<OutputFile>,
}

impl OutputFiles {
    fn new(arguments: &Arguments, outputs: &mut Outputs) -> Result<Self, RefusedOutput> {
        let Arguments { output, csv, report, .. } = arguments;
        let recording = output.as_deref().map(|path| outputs.recording(path)).transpose()?;
        let csv = outputs.optional(csv.as_deref())?;
        let report = report.as_deref().map(|path| match is_one_file(path) {
            true => outputs.file(path),
            false => outputs.file_in_made_folder(&entry(path)),
        });
        Ok(OutputFiles { recording, csv, report: report.transpose()? })
    }
}

/// Says what would be done.
fn dry_run(
    arguments: &Arguments,
    files: &OutputFiles,
    (selection, method): (&Selection, &AnnotateConfig),
) -> Result<Outcome> {
    let (input, limits) = (&arguments.input, arguments.selection.limits());
    let mut plan = DryRun::of_clouds(input, &selection.topics, method, &limits)?;
    let OutputFiles { recording, csv, report } = files;
    if let Some(file) = recording {
        plan.writes(format_args!(
            "{}\n  T/suspicion for each topic T, and everything that the input holds",
            file.path().display()
        ));
    }
    csv.iter().for_each(|file| plan.writes(file.path().display()));
    report.iter().for_each(|file| plan.writes(file.path().display()));
    plan.print();
    Ok(Outcome::Done)
}

/// Triages the recording and writes its outputs but for the report.
fn triage(
    arguments: &Arguments,
    files: &OutputFiles,
    (selection, method): (&Selection, &AnnotateConfig),
    ranking: &mut Ranking,
) -> Result<Triaged> {
    let output = files.recording.as_ref().map(|file| TriageOutput {
        path: file.path(),
        compression: arguments.compression,
        force: file.force(),
    });
    let table = files.csv.as_ref();
    let mut table =
        table.map(|file| SuspectTable::create(file.path(), file.force())).transpose()?;
    let params = TriageParams { min_points: arguments.weigh_points };
    let progress = RecordingProgress::new("triaging", &arguments.input);
    let Arguments { output: copy, csv, report, .. } = arguments;
    let target = copy.as_ref().or(csv.as_ref()).or(report.as_ref()).map(PathBuf::as_path);
    let target = target.unwrap_or(Path::new("standard output"));
    let mut on_event = |event: RunEvent| {
        progress.show(&event);
        interrupt::check_for(target)
    };
    let asked = (selection, method, &params);
    let triaged =
        triage_recording(&arguments.input, output, asked, &mut on_event, &mut |frame, found| {
            if let Some(table) = &mut table {
                let (topic, number) = (frame.key.topic, frame.key.number);
                let command = |at: &[[f64; 3]]| command(arguments, topic, number, at);
                table.add(frame, ranking.seconds(frame), found, command);
            }
            ranking.add(frame, found);
            Ok(())
        })?;
    table.map_or(Ok(()), SuspectTable::finish)?;
    Ok(triaged)
}

/// The command that explains a case.
fn explain_command(arguments: &Arguments, case: &RankedCase) -> String {
    command(arguments, &case.topic, case.frame, &case.at)
}

fn command(arguments: &Arguments, topic: &str, frame: u64, at: &[[f64; 3]]) -> String {
    let input = path_word(&arguments.input);
    let mut words = vec!["divmerge".to_owned(), "explain".into(), input];
    words.extend(option_words("--topic", topic));
    words.extend(["--frame".into(), frame.to_string()]);
    for [x, y, z] in at {
        words.extend(["--at".into(), format!("{x:.3},{y:.3},{z:.3}")]);
    }
    words.extend_from_slice(arguments.method.words());
    command_line(&words)
}

fn print(arguments: &Arguments, ranking: &Ranking, triaged: &Triaged) {
    println!("{}", ranking.summary());
    for (rank, case) in (1..).zip(&ranking.cases) {
        let suspect = &case.suspects[0];
        let [x, y, z] = suspect.position;
        println!();
        println!(
            "{rank:>3}. {:3.0} %  {} frame {}, {:.3} s, at {x:.2},{y:.2},{z:.2}: {}",
            100.0 * case.score,
            case.topic,
            case.frame,
            case.seconds,
            suspect.kind.name()
        );
        print!("{}", fitted(&format!("     {}", suspect.sentence)));
        let others: Vec<&str> = case.suspects[1..].iter().map(|other| other.kind.name()).collect();
        if !others.is_empty() {
            println!("     also: {}", with_counts(&others));
        }
        println!("     {}", explain_command(arguments, case));
    }
    println!();
    if let (Some(output), Some(bytes)) = (&arguments.output, triaged.output_bytes) {
        println!("wrote {} ({} bytes)", output.display(), grouped(bytes));
    }
    if let Some(csv) = &arguments.csv {
        println!("wrote {}", csv.display());
    }
}

/// Names in their order, each once, with their counts.
fn with_counts(names: &[&str]) -> String {
    let mut seen: Vec<(&str, usize)> = Vec::new();
    for &name in names {
        match seen.iter_mut().find(|(other, _)| *other == name) {
            Some((_, count)) => *count += 1,
            None => seen.push((name, 1)),
        }
    }
    let each = seen.into_iter().map(|(name, count)| match count {
        1 => name.to_owned(),
        count => format!("{name} ({count})"),
    });
    each.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_counts() {
        assert_eq!(with_counts(&["b", "a", "b"]), "b (2), a");
    }
}
