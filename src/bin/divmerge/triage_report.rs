//! The pages of `divmerge triage --report`: the frames of the listed cases are read and clustered once more, so that
//! no more than one of them is in memory.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use divmerge::annotate::Method;
use divmerge::explain::{Frame, Subject, explain};
use divmerge::io::{CloudMessage, Which, cloud_message_at, write_file};
use divmerge::pipeline::{self, Stages};
use divmerge::view::triage_report::{CasePage, Head, folder, one_file};
use divmerge::view::{self, ColourTracker, Scene};

use crate::explain_text::{Report, Text};
use crate::terminal::frame_bar;
use crate::triage::{List, Listed};

/// What is asked for.
pub struct Request<'a> {
    pub input: &'a Path,
    pub report: &'a Path,
    pub force: bool,
}

/// Whether the report is to be one file.
pub fn is_one_file(report: &Path) -> bool {
    report.extension().is_some_and(|end| end.eq_ignore_ascii_case("html"))
}

/// The file that is opened to read a report.
pub fn entry(report: &Path) -> PathBuf {
    if is_one_file(report) { report.to_owned() } else { report.join("index.html") }
}

/// Draws and explains the listed cases and writes their pages.
pub fn write(request: Request, list: &List, method: &Method) -> Result<()> {
    let name = request.input.file_name().unwrap_or(request.input.as_os_str());
    let head = Head { recording: name.to_string_lossy().into_owned(), summary: list.summary() };
    let cases = pages(&request, &list.cases, method)?;
    if is_one_file(request.report) {
        write_file(request.report, one_file(&head, &cases).as_bytes(), request.force)?;
        return Ok(());
    }
    let making = || format!("making {}", request.report.display());
    std::fs::create_dir_all(request.report).with_context(making)?;
    // The index last: once it is there the rest is.
    for (name, page) in folder(&head, &cases).into_iter().rev() {
        write_file(&request.report.join(name), page.as_bytes(), request.force)?;
    }
    Ok(())
}

/// The pages in the order of the list; frame by frame, since several cases may be of one.
fn pages(request: &Request, cases: &[Listed], method: &Method) -> Result<Vec<CasePage>> {
    let place = |number: usize| (&cases[number].topic, cases[number].frame);
    let mut order: Vec<usize> = (0..cases.len()).collect();
    order.sort_by_key(|&number| place(number));
    let mut pages: Vec<Option<CasePage>> = vec![None; cases.len()];
    let bar = frame_bar("drawing", cases.len() as u64);
    for of_frame in order.chunk_by(|&a, &b| place(a) == place(b)) {
        let (topic, frame) = place(of_frame[0]);
        let message = cloud_message_at(request.input, Some(topic), Which::Frame(frame))?;
        let decoding = || format!("frame {frame} of {topic}");
        let wire = message.decode().with_context(decoding)?;
        let decoded = method.decode(&wire, message.which()).with_context(decoding)?;
        let stages = pipeline::run(&decoded.cloud, decoded.mask, &method.config);
        let run =
            Run { request, message: &message, semantics: &decoded.semantics, stages: &stages };
        let frame = Frame {
            cloud: &decoded.cloud,
            mask: decoded.mask,
            config: &method.config,
            stages: &stages,
        };
        for &number in of_frame {
            pages[number] = Some(run.page(&frame, &cases[number]));
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    Ok(pages.into_iter().flatten().collect())
}

/// A frame that was run again.
struct Run<'a> {
    request: &'a Request<'a>,
    message: &'a CloudMessage,
    semantics: &'a str,
    stages: &'a Stages,
}

impl Run<'_> {
    fn page(&self, frame: &Frame, case: &Listed) -> CasePage {
        const DPI: f64 = 120.0;
        let suspect = &case.suspects[0];
        let subject = match suspect.points[..] {
            [a, b] if a != b => Subject::Pair(a, b),
            _ => Subject::Point(suspect.points[0]),
        };
        let report = self.explained(frame, subject);
        let text = Text { report: &report, pairs: 3 };
        let figure =
            view::explanation(&self.scene(frame), &report.explanation, &text.headline(), DPI);
        let others = case.suspects[1..]
            .iter()
            .map(|other| (other.score, other.kind.name().to_owned(), other.sentence.clone()));
        CasePage {
            score: case.score,
            topic: case.topic.clone(),
            frame: case.frame,
            seconds: case.seconds,
            position: suspect.position,
            kind: suspect.kind.name().to_owned(),
            instance: case.instance.clone(),
            sentence: suspect.sentence.clone(),
            others: others.collect(),
            command: case.command.clone(),
            explanation: text.text(),
            figure,
        }
    }

    fn explained(&self, frame: &Frame, subject: Subject) -> Report {
        Report {
            file: self.request.input.to_owned(),
            topic: self.message.topic.clone(),
            frame: self.message.number,
            log_time_ns: self.message.log_time,
            preset: frame.config.preset,
            semantics: self.semantics.to_owned(),
            instances: self.stages.instances.len(),
            away: Vec::new(),
            explanation: explain(frame, subject),
            votes_per_border_pair: 2,
            // Seconds a case; the command on the page looks for it.
            what_if: None,
        }
    }

    fn scene<'b>(&self, frame: &Frame<'b>) -> Scene<'b> {
        let instances = &frame.stages.instances;
        Scene {
            cloud: frame.cloud,
            stages: frame.stages,
            classes: Vec::new(),
            intensity: None,
            merge_ratio: frame.config.cluster.merge_ratio,
            colour_numbers: ColourTracker::default().colour_numbers(instances),
            heading: format!("frame {} of {}", self.message.number, self.message.topic),
            remark: format!("objects: {}  ·  preset {}", self.semantics, frame.config.preset),
        }
    }
}
