//! `divmerge triage`

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use divmerge::Error;
use divmerge::annotate::{Event, Frame};
use divmerge::io::{Overview, PartialFile};
use divmerge::replay::Selection;
use divmerge::triage::recording::{Output, Triaged, triage_recording};
use divmerge::triage::{Case, Params, Suspect, Triage};

use crate::annotate::Compress;
use crate::arguments::{MethodArguments, SelectionArguments, command_line};
use crate::table::csv_cell;
use crate::terminal::{byte_bar, grouped};
use crate::{Outcome, interrupt, triage_report};

/// List what is most suspect in a recording, without any truth
///
/// Every frame is clustered and looked through for decisions that only just went one way: joins that barely fitted,
/// two instances that would fit one object, thin or bare majorities of votes, instances larger than their class comes
/// or of two masses, neighbours that all but touch, points without an instance, beams that came back with nothing.
/// The likeliest failures come first, each with the command that explains it.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP); it is never touched. Of an annotated one the original clouds are clustered anew
    input: PathBuf,

    #[command(flatten)]
    selection: SelectionArguments,

    #[command(flatten)]
    method: MethodArguments,

    /// Most cases to list and to draw
    #[arg(long, value_name = "N", default_value_t = 20)]
    limit: usize,

    /// Instances of fewer points weigh less, in proportion; as in evaluation, where they never count as failures
    #[arg(long, value_name = "N", default_value_t = Params::default().min_points, value_parser = clap::value_parser!(u64).range(1..))]
    weigh_points: u64,

    /// Write the recording again with a topic T/suspicion beside each cloud topic T: a DiagnosticArray per cloud
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,

    /// Compression of that recording
    #[arg(long, value_enum, default_value_t = Compress::Zstd, requires = "output")]
    compression: Compress,

    /// Write every suspect of every frame as a table
    #[arg(long, value_name = "F.csv")]
    csv: Option<PathBuf>,

    /// Write pages to read, with a figure and an explanation of each case: one file that ends in .html, or a folder
    #[arg(long, value_name = "F.html|DIR")]
    report: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// A case among the likeliest of all frames.
pub struct Listed {
    pub topic: String,
    pub frame: u64,
    pub seconds: f64,
    pub score: f64,
    /// Title of the instance; empty of points without one.
    pub instance: String,
    /// What is held against it, what weighs most first.
    pub suspects: Vec<Suspect>,
    /// The command that shows it.
    pub command: String,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    refuse(arguments)?;
    let selection = arguments.selection.selection(&arguments.input)?;
    selection.check(&arguments.input)?;
    let method = arguments.method.method(&arguments.input)?;
    let params = Params { min_points: arguments.weigh_points };
    let mut list = List::new(arguments)?;
    let triaged = watch(arguments, &selection, &method, &params, &mut list)?;
    list.finish()?;
    print(arguments, &list, &triaged);
    if let Some(report) = &arguments.report {
        triage_report::write(arguments_of(arguments, report), &list, &method)?;
        println!("wrote {}", triage_report::entry(report).display());
    }
    let is_complete = triaged.replayed.unreadable == 0 && !triaged.replayed.is_cut_off;
    Ok(if is_complete { Outcome::Done } else { Outcome::Incomplete })
}

fn arguments_of<'a>(arguments: &'a Arguments, report: &'a Path) -> triage_report::Request<'a> {
    triage_report::Request { input: &arguments.input, report, force: arguments.force }
}

/// Refuses outputs that exist or are one another, before anything is read.
fn refuse(arguments: &Arguments) -> Result<()> {
    let outputs = [&arguments.output, &arguments.csv, &arguments.report];
    let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
    for (number, output) in outputs.iter().enumerate() {
        if outputs[..number].contains(output) {
            bail!("{} is asked for twice", output.display());
        }
        if output
            .canonicalize()
            .is_ok_and(|output| arguments.input.canonicalize().is_ok_and(|input| input == output))
        {
            bail!("{} is the recording itself, which is never touched", output.display());
        }
        let is_folder =
            arguments.report.as_ref() == Some(output) && !triage_report::is_one_file(output);
        if !is_folder {
            crate::refuse_existing(output, arguments.force)?;
        }
    }
    if let Some(report) =
        arguments.report.as_deref().filter(|report| !triage_report::is_one_file(report))
    {
        crate::refuse_existing(&triage_report::entry(report), arguments.force)?;
    }
    Ok(())
}

fn watch(
    arguments: &Arguments,
    selection: &Selection,
    method: &divmerge::annotate::Method,
    params: &Params,
    list: &mut List,
) -> Result<Triaged> {
    let output = arguments.output.as_deref().map(|path| Output {
        path,
        compression: arguments.compression.into(),
        force: arguments.force,
    });
    let bar = byte_bar("triaging");
    let target = arguments.output.clone().unwrap_or_else(|| "the output".into());
    let mut on_event = |event: Event| match event {
        Event::Progress { bytes, total } => {
            bar.set_length(total);
            bar.set_position(bytes);
            match interrupt::wish() {
                ControlFlow::Continue(()) => Ok(()),
                ControlFlow::Break(()) => Err(Error::Interrupted { path: target.clone() }),
            }
        }
        Event::Warning(warning) => {
            bar.suspend(|| eprintln!("warning: {}: {warning}", arguments.input.display()));
            Ok(())
        }
        Event::Frame(_) => Ok(()),
    };
    let asked = (selection, method, params);
    let triaged =
        triage_recording(&arguments.input, output, asked, &mut on_event, &mut |frame, found| {
            list.add(frame, found);
            Ok(())
        });
    bar.finish_and_clear();
    Ok(triaged?)
}

/// The likeliest cases so far, and the table of all suspects as it is written.
pub struct List<'a> {
    arguments: &'a Arguments,
    /// How the commands that show a case begin and end.
    command: [Vec<String>; 2],
    start_ns: u64,
    pub cases: Vec<Listed>,
    pub frames: u64,
    pub suspects: u64,
    pub instances: u64,
    csv: Option<Table>,
}

/// A CSV file under way; what went wrong with it is told at the end.
struct Table {
    file: BufWriter<File>,
    partial: PartialFile,
    written: std::io::Result<()>,
    path: PathBuf,
}

const COLUMNS: &str = "topic,frame,log_time_ns,seconds,score,kind,evidence,instance,other_instance,x,y,z,measured,bound,unit,frame_score,sentence,command";

impl<'a> List<'a> {
    fn new(arguments: &'a Arguments) -> Result<Self> {
        let input = arguments.input.display().to_string();
        let csv = arguments.csv.as_deref().map(|path| Table::create(path, arguments.force));
        Ok(List {
            arguments,
            command: [vec!["divmerge".into(), "explain".into(), input], arguments.method.words()],
            start_ns: Overview::read(&arguments.input)?.start_ns.unwrap_or(0),
            cases: Vec::new(),
            frames: 0,
            suspects: 0,
            instances: 0,
            csv: csv.transpose()?,
        })
    }

    fn add(&mut self, frame: &Frame, found: &Triage) {
        self.frames += 1;
        self.suspects += found.suspects.len() as u64;
        self.instances += found.instances.len() as u64;
        let seconds = frame.log_time_ns.saturating_sub(self.start_ns) as f64 * 1e-9;
        if let Some(table) = &mut self.csv {
            let [before, after] = &self.command;
            table.add(frame, seconds, found, |suspect| command(before, after, frame, suspect));
        }
        let least = self.least();
        let cases = found.cases();
        let worse = cases.iter().take(self.arguments.limit).filter(|case| case.score > least);
        self.cases
            .extend(worse.map(|case| self.listed(frame, seconds, found, case)).collect::<Vec<_>>());
        // Stable: of cases of one score the earlier stays before.
        self.cases.sort_by(|a, b| b.score.total_cmp(&a.score));
        self.cases.truncate(self.arguments.limit);
    }

    /// What a case has to exceed to be listed.
    fn least(&self) -> f64 {
        let is_full = self.cases.len() >= self.arguments.limit;
        self.cases.last().filter(|_| is_full).map_or(0.0, |last| last.score)
    }

    fn listed(&self, frame: &Frame, seconds: f64, found: &Triage, case: &Case) -> Listed {
        let suspects: Vec<Suspect> =
            case.suspects.iter().map(|&number| found.suspects[number].clone()).collect();
        let [before, after] = &self.command;
        let instance = case.instance.map(|id| frame.stages.instances[id as usize - 1].title());
        Listed {
            topic: frame.topic.to_owned(),
            frame: frame.number,
            seconds,
            score: case.score,
            instance: instance.unwrap_or_default(),
            command: command(before, after, frame, &suspects[0]),
            suspects,
        }
    }

    fn finish(&mut self) -> Result<()> {
        self.csv.take().map_or(Ok(()), Table::finish)
    }
}

/// The command that explains a suspect.
fn command(before: &[String], after: &[String], frame: &Frame, suspect: &Suspect) -> String {
    let mut words = before.to_vec();
    words.extend(["--topic".into(), frame.topic.to_owned()]);
    words.extend(["--frame".into(), frame.number.to_string()]);
    for &point in &suspect.points {
        let at = frame.cloud.position(point).map(f64::from);
        let [x, y, z] = frame.cloud.recorded(at);
        words.extend(["--at".into(), format!("{x:.3},{y:.3},{z:.3}")]);
    }
    words.extend_from_slice(after);
    command_line(&words)
}

impl Table {
    fn create(path: &Path, force: bool) -> Result<Self> {
        let (file, partial) = PartialFile::create(path, force)?;
        let mut file = BufWriter::new(file);
        let written = writeln!(file, "{COLUMNS}");
        Ok(Table { file, partial, written, path: path.to_owned() })
    }

    fn add(
        &mut self,
        frame: &Frame,
        seconds: f64,
        found: &Triage,
        command: impl Fn(&Suspect) -> String,
    ) {
        let mut lines = String::new();
        for suspect in found.suspects.iter().filter(|suspect| suspect.score > 0.0) {
            let id = |place: usize| {
                suspect.concerns.get(place).map_or(String::new(), |c| c.instance.to_string())
            };
            let [x, y, z] = suspect.position;
            let _ = writeln!(
                lines,
                "{},{},{},{seconds:.3},{:.4},{},{:.4},{},{},{x:.3},{y:.3},{z:.3},{:.4},{:.4},{},{:.4},{},{}",
                csv_cell(frame.topic),
                frame.number,
                frame.log_time_ns,
                suspect.score,
                suspect.kind.name(),
                suspect.evidence,
                id(0),
                id(1),
                suspect.measured,
                suspect.bound,
                suspect.unit,
                found.score,
                csv_cell(&suspect.sentence),
                csv_cell(&command(suspect))
            );
        }
        if self.written.is_ok() {
            self.written = self.file.write_all(lines.as_bytes());
        }
    }

    fn finish(mut self) -> Result<()> {
        let written = self.written.and_then(|()| self.file.flush());
        written.with_context(|| format!("writing {}", self.path.display()))?;
        drop(self.file);
        Ok(self.partial.put()?)
    }
}

impl List<'_> {
    /// What was looked at, in a sentence.
    pub fn summary(&self) -> String {
        format!(
            "{} frames, {} instances, {} suspects; the {} most suspect cases follow.",
            grouped(self.frames),
            grouped(self.instances),
            grouped(self.suspects),
            self.cases.len()
        )
    }
}

fn print(arguments: &Arguments, list: &List, triaged: &Triaged) {
    println!("{}", list.summary());
    for (rank, case) in (1..).zip(&list.cases) {
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
        println!("     {}", suspect.sentence);
        let others: Vec<&str> = case.suspects[1..].iter().map(|other| other.kind.name()).collect();
        if !others.is_empty() {
            println!("     also: {}", counted(&others));
        }
        println!("     {}", case.command);
    }
    println!();
    if let (Some(output), Some(bytes)) = (&arguments.output, triaged.output_bytes) {
        println!("wrote {} ({} bytes)", output.display(), grouped(bytes));
    }
    if let Some(csv) = &arguments.csv {
        println!("wrote {}", csv.display());
    }
}

/// Names in their order, each once, with how often it is there.
fn counted(names: &[&str]) -> String {
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
    fn cells_and_counts() {
        assert_eq!(csv_cell("plain"), "plain");
        assert_eq!(csv_cell("a,\"b\"\n"), "\"a,\"\"b\"\"\n\"");
        assert_eq!(counted(&["b", "a", "b"]), "b (2), a");
    }
}
