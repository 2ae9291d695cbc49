//! The pages of `--report`. The frames of the listed cases are read and clustered again, one at a
//! time.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::annotate::AnnotateConfig;
use crate::cli::output::{OutputFile, Outputs, extension, make_folder};
use crate::cli::progress::frame_bar;
use crate::diagnose::explain::{ClusteredCloud, ExplanationReport, ExplanationText, Subject};
use crate::diagnose::triage::ranking::RankedCase;
use crate::frames::{CloudAt, encoded_cloud_at};
use crate::pipeline;
use crate::view::triage_report::{CasePage, Head, folder, one_file};
use crate::view::{self, explained_scene, explanation_report};

/// What the pages show.
pub struct Report<'a> {
    /// The recording.
    pub input: &'a Path,
    pub summary: String,
    pub cases: &'a [RankedCase],
    /// The command that explains each case.
    pub commands: Vec<String>,
}

/// Whether a report is one file, not a folder.
pub fn is_one_file(report: &Path) -> bool {
    extension(report) == "html"
}

/// The file to open.
pub fn entry(report: &Path) -> PathBuf {
    if is_one_file(report) { report.to_owned() } else { report.join("index.html") }
}

impl Report<'_> {
    /// Draws and explains the cases and writes their pages; `entry` is the file to open.
    pub fn write(
        &self,
        path: &Path,
        entry: &OutputFile,
        outputs: &mut Outputs,
        method: &AnnotateConfig,
    ) -> Result<()> {
        let name = self.input.file_name().unwrap_or(self.input.as_os_str());
        let recording = name.to_string_lossy().into_owned();
        let head = Head { recording, summary: self.summary.clone() };
        let cases = self.pages(method)?;
        if is_one_file(path) {
            return entry.write(one_file(&head, &cases).as_bytes());
        }
        let pages = folder(&head, &cases);
        let mut files = vec![entry.clone()];
        for (name, _) in &pages[1..] {
            files.push(outputs.file_in_made_folder(&path.join(name))?);
        }
        make_folder(path)?;
        // The index last: if it exists, the rest does.
        for (file, (_, page)) in files.iter().zip(&pages).rev() {
            file.write(page.as_bytes())?;
        }
        Ok(())
    }

    /// The pages in the order of the cases; each frame is clustered once.
    fn pages(&self, method: &AnnotateConfig) -> Result<Vec<CasePage>> {
        let cases = self.cases;
        let frame_of = |number: usize| (&cases[number].topic, cases[number].frame);
        let mut order: Vec<usize> = (0..cases.len()).collect();
        order.sort_by_key(|&number| frame_of(number));
        let mut pages: Vec<Option<CasePage>> = vec![None; cases.len()];
        let bar = frame_bar("drawing", cases.len() as u64);
        for of_frame in order.chunk_by(|&a, &b| frame_of(a) == frame_of(b)) {
            let (topic, frame) = frame_of(of_frame[0]);
            let at = CloudAt::Frame(frame);
            let message = encoded_cloud_at(self.input, Some(topic), at, method.assemble)?;
            let place = || format!("frame {frame} of {topic}");
            let wire = message.decode().with_context(place)?;
            let decoded = method.decode(&wire, &message.key(&wire)).with_context(place)?;
            let (cloud, mask, config) = (&decoded.cloud, decoded.mask, &method.pipeline);
            let stages = pipeline::run(cloud, mask, config);
            let frame = ClusteredCloud { cloud, mask, config, stages: &stages };
            for &number in of_frame {
                let subject = subject(&cases[number]);
                let semantics = &decoded.semantics;
                let report = explanation_report(self.input, &message, semantics, &frame, subject);
                pages[number] = Some(self.page(&frame, &report, number));
                bar.inc(1);
            }
        }
        bar.finish_and_clear();
        Ok(pages.into_iter().flatten().collect())
    }

    fn page(&self, frame: &ClusteredCloud, report: &ExplanationReport, number: usize) -> CasePage {
        const DPI: f64 = 120.0;
        let case = &self.cases[number];
        let suspect = &case.suspects[0];
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
            command: self.commands[number].clone(),
            explanation: ExplanationText { report, max_pairs: 3 }.to_string(),
            figure: view::explanation(
                &explained_scene(frame, report),
                &report.explanation,
                &report.explanation.headline(),
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
