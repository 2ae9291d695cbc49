//! A case as one file that opens without a server: the page, the frame, the selection, its
//! explanation, and what the changes that give the other answer lead to.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;
use serde_json::{Value, json};

use super::pack::Sums;
use super::page_files::case_document;
use super::picture::picture;
use super::requests::{Outcome, Problem};
use super::run::Run;
use super::scores::scores;
use super::session::Session;
use super::setting::Setting;
use super::why::{self, Change, ExplanationReply, Question};

/// Most bytes of a case.
const MOST_BYTES: usize = 6_000_000;
/// Runs of changes that a case holds at most.
const MOST_ALTERNATIVES: usize = 12;

/// What stands in a case.
#[derive(Serialize)]
struct Case<'a> {
    session: Value,
    topic: &'a str,
    frame: u64,
    setting: &'a Setting,
    /// What the page showed.
    shown: &'a Value,
    scores: Option<Value>,
    explanation: Option<ExplanationReply>,
    picture: String,
    alternatives: Vec<Value>,
}

impl Case<'_> {
    fn document(&self) -> String {
        case_document(&serde_json::to_string(self).expect("a case has a form in JSON"))
    }
}

/// The case of a run and a question, as a page shows it.
///
/// # Errors
/// If even the frame alone would be too large.
pub(super) fn saved_case(
    session: &Session,
    run: &Run,
    question: Option<&Question>,
    shown: &Value,
) -> Outcome<Vec<u8>> {
    let whole = picture(session, run, true, Sums::new())?;
    let known = whole.sums();
    let mut case = Case {
        session: session.facts(),
        topic: &run.cloud.message.topic,
        frame: run.cloud.message.number,
        setting: &run.setting,
        shown,
        scores: scores(run),
        explanation: question.map(|question| explained(session, run, question)).transpose()?,
        picture: packed(&whole.finish()),
        alternatives: Vec::new(),
    };
    let mut size = case.document().len();
    if size > MOST_BYTES {
        let problem = format!(
            "the frame alone would take {:.1} MB: a case holds {:.1} MB at most",
            size as f64 / 1e6,
            MOST_BYTES as f64 / 1e6
        );
        return Err(Problem::wrong(problem));
    }
    let changes = case.explanation.iter().flat_map(|reply| reply.changes.clone());
    for change in changes.take(MOST_ALTERNATIVES).collect::<Vec<_>>() {
        let Ok(alternative) = alternative(session, run, &change, known.clone()) else { continue };
        size += alternative.to_string().len();
        if size > MOST_BYTES {
            break;
        }
        case.alternatives.push(alternative);
    }
    Ok(case.document().into_bytes())
}

/// The explanation with its changes, unless a later search calls these off.
fn explained(session: &Session, run: &Run, question: &Question) -> Outcome<ExplanationReply> {
    let report = match why::changed(session, run, question)? {
        Some(report) => report,
        None => why::explained(session, run, question)?,
    };
    Ok(ExplanationReply::new(run, report, question))
}

/// What a change leads to: the run without the points of its cloud, and its scores.
fn alternative(session: &Session, run: &Run, change: &Change, known: Sums) -> Outcome<Value> {
    let mut setting: Setting = run.setting.clone();
    setting.set.extend(change.set.clone());
    let message = &run.cloud.message;
    let changed = session.run(&message.topic, message.number, &setting)?;
    Ok(json!({
        "setting": setting,
        "scores": scores(&changed),
        "compared": super::compared::compared(run, &changed),
        "picture": packed(&picture(session, &changed, false, known)?.finish()),
    }))
}

/// Bytes as text, compressed.
fn packed(bytes: &[u8]) -> String {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    let compressed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    BASE64.encode(compressed.expect("memory takes all bytes"))
}
