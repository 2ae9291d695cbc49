//! Why two points are one instance or not: the report of `explain`, for the same question as on the
//! command line.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Value, json};

use super::joined_nodes::{JoinedNode, joined_nodes};
use super::requests::{Outcome, Problem};
use super::run::Run;
use super::session::{Searched, Session};
use crate::diagnose::explain::{
    Choice, ExplanationReport, ExplanationText, Flip, Number, Subject, WhatIf, distances,
    return_at, what_if_while,
};
use crate::view::explanation_report;
use divmerge_core::cloud::PointCloud;

/// Maximum distance of a point from the position it is asked for by, metres: the default of
/// `explain`.
const WITHIN: f64 = 0.3;
/// Pairs of pixels that the text lists: the default of `explain`.
const PAIRS: usize = 3;

/// A question about one or two points, as `explain` is asked it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Question {
    subject: Subject,
    /// The points by their positions in the recording's frame, as on the command line.
    pub at: Vec<String>,
    /// The same in the cloud's frame.
    positions: Vec<[f64; 3]>,
}

impl Question {
    /// The question about some points of a run.
    ///
    /// # Errors
    /// If they are not one or two points of the cloud, are one point, or are no returns.
    pub fn new(run: &Run, points: &[usize]) -> Outcome<Self> {
        let cloud = &run.cloud.cloud;
        if let Some(point) = points.iter().find(|&&point| point >= cloud.len()) {
            let problem = format!("there is no point {point}: the cloud has {}", cloud.len());
            return Err(Problem::wrong(problem));
        }
        let subject = match *points {
            [a] => Subject::Point(a),
            [a, b] if a != b => Subject::Pair(a, b),
            _ => return Err(Problem::wrong("choose one point, or two different ones")),
        };
        let spelt = points.iter().map(|&point| spelt(cloud, point).ok_or(point));
        let at = spelt.collect::<Result<Vec<_>, usize>>().map_err(|point| {
            Problem::wrong(format!("point {point} is no return, so that it has no position"))
        })?;
        let positions = at.iter().map(|(_, position)| *position).collect();
        Ok(Question { subject, at: at.into_iter().map(|(text, _)| text).collect(), positions })
    }

    /// The points by their numbers.
    pub fn points(&self) -> Vec<usize> {
        self.subject.points()
    }
}

/// A position that leads to a point: to the millimetre, or as near as it takes, with what it is in
/// the cloud's frame. `None` of a point that is no return, or lies where another does.
fn spelt(cloud: &PointCloud, point: usize) -> Option<(String, [f64; 3])> {
    if !cloud.is_return(point) {
        return None;
    }
    let recorded = cloud.recorded(cloud.position(point).map(f64::from));
    (3..=9).find_map(|digits: usize| {
        let words = recorded.map(|along| format!("{along:.digits$}"));
        let read = words.each_ref().map(|word| word.parse().unwrap_or(f64::NAN));
        let position = cloud.from_recorded(read);
        let found = return_at(cloud, position, WITHIN).ok()?;
        let is_there = cloud.position(found) == cloud.position(point);
        is_there.then(|| (words.join(","), position))
    })
}

/// The report of a question, without changes that would give the other answer.
///
/// # Errors
/// If another method than ours made the run.
pub(super) fn explained(
    session: &Session,
    run: &Run,
    question: &Question,
) -> Outcome<ExplanationReport> {
    if let Some(other) = &run.config.pipeline.other_method {
        let problem = format!("{} has no votes or merges to explain", other.name());
        return Err(Problem::wrong(problem));
    }
    let (input, message) = (&session.options.input, &run.cloud.message);
    let semantics = &run.cloud.semantics;
    let frame = run.clustered();
    let report = explanation_report(input, message, semantics, &frame, question.subject);
    let away = distances(&report.explanation.points, &question.positions);
    Ok(ExplanationReport { away, ..report })
}

/// A report as the page gets it: as JSON and in words, both as `explain` writes them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ExplanationReply {
    /// The report.
    pub report: ExplanationReport,
    /// The answer in a sentence.
    headline: String,
    /// The report in words.
    text: String,
    /// The points by their positions, as on the command line.
    at: Vec<String>,
    /// What the buttons of the page set.
    pub changes: Vec<Change>,
    /// Without classes, the nodes from the points to where they join.
    nodes: Vec<JoinedNode>,
}

impl ExplanationReply {
    /// The reply to a question about a run.
    pub fn new(run: &Run, report: ExplanationReport, question: &Question) -> Self {
        ExplanationReply {
            nodes: joined_nodes(run, &report.explanation),
            headline: report.explanation.headline(),
            text: ExplanationText { report: &report, max_pairs: PAIRS }.to_string(),
            at: question.at.clone(),
            changes: report.what_if.iter().flatten().flat_map(changes).collect(),
            report,
        }
    }

    /// How many bytes the outlines of nodes take.
    pub fn bytes_of_outlines(&self) -> usize {
        let bytes = self.nodes.iter().flat_map(|node| &node.runs);
        bytes.map(|number| number.to_string().len() + 1).sum()
    }

    /// Leaves the nodes without the pixels that their outlines go around.
    pub fn leave_out_outlines(&mut self) {
        self.nodes.iter_mut().for_each(|node| node.runs.clear());
    }
}

/// The report with the changes that would give the other answer; `None` if a later search called it
/// off.
///
/// # Errors
/// Those of [`explained`].
pub(super) fn changed(
    session: &Session,
    run: &Run,
    question: &Question,
) -> Outcome<Option<ExplanationReport>> {
    if let Some(known) = known(session, run, question) {
        return Ok(Some(known));
    }
    let mut report = explained(session, run, question)?;
    let search = session.begin_search();
    let goes_on = || session.is_latest_search(search);
    report.what_if = Some(what_if_while(&run.clustered(), question.subject, &goes_on));
    if !goes_on() {
        return Ok(None);
    }
    session.keep_changes(searched(run, question), &report);
    Ok(Some(report))
}

/// The report with its changes, if these were searched last.
pub(super) fn known(
    session: &Session,
    run: &Run,
    question: &Question,
) -> Option<ExplanationReport> {
    session.known_changes(&searched(run, question))
}

fn searched(run: &Run, question: &Question) -> Searched {
    let message = &run.cloud.message;
    (message.topic.to_string(), message.number, run.setting.clone(), question.points())
}

/// A change of one parameter that gives the other answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Change {
    /// The parameter in words.
    pub parameter: &'static str,
    /// Its value then, in words.
    pub words: String,
    /// What a setting sets, by path.
    pub set: BTreeMap<String, Value>,
}

/// The changes of one parameter that give the other answer: of a number the nearest on either side.
fn changes(what_if: &WhatIf) -> Vec<Change> {
    match what_if {
        WhatIf::Number(Number { parameter, path, unit, lower, higher, .. }) => {
            let change = |flip: Flip| {
                let words = format!("{} {unit}", flip.value).trim_end().to_owned();
                let value = match *unit {
                    "pixels" => json!(flip.value as u64),
                    "degrees" => json!(format!("{} deg", flip.value)),
                    _ => json!(flip.value),
                };
                let set = BTreeMap::from([((*path).to_owned(), value)]);
                Change { parameter, words, set }
            };
            [lower, higher].into_iter().copied().flatten().map(change).collect()
        }
        WhatIf::Choice(Choice { parameter, path, flips, .. }) => {
            let change = |value: &&'static str| {
                let set = settings_of(*path, value).into_iter();
                let set = set.map(|(path, value)| (path.to_owned(), value)).collect();
                Change { parameter, words: (*value).to_owned(), set }
            };
            flips.iter().map(change).collect()
        }
    }
}

/// What sets a parameter that is one of a few; without a path, what is done on the plane.
fn settings_of(path: Option<&'static str>, value: &str) -> Vec<(&'static str, Value)> {
    match (path, value) {
        (Some(path), "only" | "on") => return vec![(path, json!(true))],
        (Some(path), "any" | "off") => return vec![(path, json!(false))],
        (Some(path), name) => return vec![(path, json!(name))],
        (None, _) => {}
    }
    let by_size = value == "size";
    let by_region = !by_size && value != "off";
    let mut all = vec![
        ("cluster.birds_eye", json!(by_region)),
        ("cluster.fragments", json!(by_size)),
        ("cluster.tree", json!(by_size)),
    ];
    if by_region {
        all.push(("cluster.birds_eye.region", json!(value)));
    }
    all
}
