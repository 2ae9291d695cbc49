//! The pages of a ranking of triage: the frames of its cases are read and clustered again, one at a
//! time.

use std::path::{Path, PathBuf};

use super::explanation::explanation;
use super::frame_scene::{explained_scene, explanation_report};
use super::triage_report::{CasePage, Head, folder, one_file};
use crate::annotate::AnnotateConfig;
use crate::diagnose::explain::{ClusteredCloud, ExplanationReport, ExplanationText, Subject};
use crate::diagnose::triage::ranking::{RankedCase, Ranking};
use crate::error::{Error, FrameError, Result};
use crate::frames::{CloudAt, encoded_cloud_at};
use divmerge_core::pipeline;

const DPI: f64 = 120.0;

/// What the pages show.
pub struct CaseReport<'a> {
    /// The recording.
    pub input: &'a Path,
    /// Its cases.
    pub ranking: &'a Ranking,
    /// How its clouds are clustered.
    pub method: &'a AnnotateConfig,
    /// What explains each case, in words of the program or of a language.
    pub commands: Vec<String>,
}

/// Whether a report is one file, not a folder.
pub fn is_one_file(report: &Path) -> bool {
    report.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("html"))
}

/// The file of a report to open.
pub fn entry(report: &Path) -> PathBuf {
    if is_one_file(report) { report.to_owned() } else { report.join("index.html") }
}

impl CaseReport<'_> {
    /// Its files by name, the one to open first: one file without a name if it is to be `report`
    /// itself, else those of a folder. `on_case` is called behind each case.
    ///
    /// # Errors
    /// Those of reading and clustering clouds.
    pub fn files(&self, report: &Path, on_case: impl FnMut()) -> Result<Vec<(String, String)>> {
        let name = self.input.file_name().unwrap_or(self.input.as_os_str());
        let recording = name.to_string_lossy().into_owned();
        let head = Head { recording, summary: self.ranking.summary() };
        let cases = self.pages(on_case)?;
        Ok(match is_one_file(report) {
            true => vec![(String::new(), one_file(&head, &cases))],
            false => folder(&head, &cases),
        })
    }

    /// The pages in the order of the cases; each frame is clustered once.
    fn pages(&self, mut on_case: impl FnMut()) -> Result<Vec<CasePage>> {
        let (cases, method) = (&self.ranking.cases, self.method);
        let frame_of = |number: usize| (&cases[number].topic, cases[number].frame);
        let mut order: Vec<usize> = (0..cases.len()).collect();
        order.sort_by_key(|&number| frame_of(number));
        let mut pages: Vec<Option<CasePage>> = vec![None; cases.len()];
        for of_frame in order.chunk_by(|&a, &b| frame_of(a) == frame_of(b)) {
            let (topic, frame) = frame_of(of_frame[0]);
            let at = CloudAt::Frame(frame);
            let message = encoded_cloud_at(self.input, Some(topic), at, method.assemble)?;
            let placed = |problem: FrameError| {
                let at = format!("{}: {}", self.input.display(), message.describe());
                Error::Unreadable { at, problem }
            };
            let wire = message.decode().map_err(placed)?;
            let decoded =
                method.decode(&wire, &message.key(&wire)).map_err(|error| match error {
                    Error::Frame(problem) => placed(problem),
                    other => other,
                })?;
            let (cloud, mask, config) = (&decoded.cloud, decoded.mask, &method.pipeline);
            let stages = pipeline::run(cloud, mask, config);
            let frame = ClusteredCloud { cloud, mask, config, stages: &stages };
            for &number in of_frame {
                let subject = subject(&cases[number]);
                let semantics = &decoded.semantics;
                let report = explanation_report(self.input, &message, semantics, &frame, subject);
                pages[number] = Some(self.page(&frame, &report, number));
                on_case();
            }
        }
        Ok(pages.into_iter().flatten().collect())
    }

    fn page(&self, frame: &ClusteredCloud, report: &ExplanationReport, number: usize) -> CasePage {
        let case = &self.ranking.cases[number];
        let suspect = &case.suspects[0];
        let others = case.suspects[1..]
            .iter()
            .map(|other| (other.score, other.kind.name().to_owned(), other.sentence.clone()));
        let explained = &report.explanation;
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
            command: self.commands[number].clone(),
            explanation: ExplanationText { report, max_pairs: 3 }.to_string(),
            figure: explanation(
                &explained_scene(frame, report),
                explained,
                &explained.headline(),
                DPI,
            ),
        }
    }
}

fn subject(case: &RankedCase) -> Subject {
    match case.suspects[0].points[..] {
        [a, b] if a != b => Subject::Pair(a, b),
        [a, ..] => Subject::Point(a),
        [] => unreachable!("a suspect has one or two points"),
    }
}
