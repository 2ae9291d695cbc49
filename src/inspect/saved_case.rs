//! A case as one file that opens without a server: the page, the frame, the selection, its
//! explanation, and what the changes that give the other answer lead to. What does not fit is left
//! out, and the page says what.

use serde::Serialize;
use serde_json::{Value, json};

use super::fitted_frame::{FittedFrame, packed};
use super::page_files::case_document;
use super::picture::picture;
use super::requests::Outcome;
use super::run::Run;
use super::scores::scores;
use super::session::Session;
use super::setting::Setting;
use super::why::{self, Change, ExplanationReply, Question};
use crate::text::counted;

/// Most bytes of a case.
const MOST_BYTES: usize = 6_000_000;
/// Most bytes of the frame where there are changes to be run.
const MOST_BYTES_BESIDE_CHANGES: usize = 3_600_000;
/// Most bytes of the outlines of nodes.
const MOST_BYTES_OF_OUTLINES: usize = 800_000;
/// Runs of changes that a case holds at most.
const MOST_ALTERNATIVES: usize = 12;

/// Most points of a cloud whose changes are searched in order to save them: of a million the search
/// takes minutes.
const MOST_POINTS_SEARCHED: usize = 300_000;

/// What stands in a case.
#[derive(Serialize)]
struct Case<'a> {
    session: Value,
    topic: &'a str,
    frame: u64,
    setting: &'a Setting,
    /// What the page showed.
    shown: Value,
    scores: Option<Value>,
    explanation: Option<ExplanationReply>,
    picture: String,
    alternatives: Vec<Value>,
    /// What is not in it, in words.
    left_out: Vec<String>,
}

impl Case<'_> {
    fn document(&self) -> String {
        case_document(&serde_json::to_string(self).expect("a case has a form in JSON"))
    }

    /// Adds the explanation, with its changes unless these take minutes or a later search calls
    /// them off.
    fn explain(&mut self, session: &Session, run: &Run, question: &Question) -> Outcome<()> {
        let mut report = why::known(session, run, question);
        if report.is_none() && run.cloud.cloud.len() <= MOST_POINTS_SEARCHED {
            report = why::changed(session, run, question)?;
        }
        if report.is_none() {
            self.left_out.push("the changes that give the other answer".into());
        }
        let report = report.map_or_else(|| why::explained(session, run, question), Ok)?;
        self.explanation = Some(ExplanationReply::new(run, report, question));
        Ok(())
    }

    /// Leaves out the outlines of nodes if they are too large.
    fn fit_outlines(&mut self) {
        let Some(explanation) = &mut self.explanation else { return };
        if explanation.bytes_of_outlines() > MOST_BYTES_OF_OUTLINES {
            explanation.leave_out_outlines();
            self.left_out.push("outlines of nodes in the range image".into());
        }
    }

    /// Adds the changes that fit.
    fn add_changes(&mut self, session: &Session, run: &Run, frame: &FittedFrame) {
        let changes =
            self.explanation.as_ref().map_or_else(Vec::new, |reply| reply.changes.clone());
        let changes = &changes[..changes.len().min(MOST_ALTERNATIVES)];
        let mut size = self.document().len();
        for change in changes {
            let Ok(alternative) = alternative(session, run, change, frame) else { continue };
            // One more for the comma.
            size += alternative.to_string().len() + 1;
            if size > MOST_BYTES - 1000 {
                break;
            }
            self.alternatives.push(alternative);
        }
        let missing = changes.len() - self.alternatives.len();
        if missing > 0 {
            self.left_out.push(format!("what {} lead to", counted(missing, "change")));
        }
    }
}

/// The case of a run and a question, as a page shows it.
///
/// # Errors
/// Those of [`explained`], and of the session.
pub(super) fn saved_case(
    session: &Session,
    run: &Run,
    question: Option<&Question>,
    shown: &Value,
) -> Outcome<Vec<u8>> {
    let mut case = Case {
        session: session.facts(),
        topic: &run.cloud.message.topic,
        frame: run.cloud.message.number,
        setting: &run.setting,
        shown: shown.clone(),
        scores: scores(run),
        explanation: None,
        picture: String::new(),
        alternatives: Vec::new(),
        left_out: Vec::new(),
    };
    if let Some(question) = question {
        case.explain(session, run, question)?;
    }
    case.fit_outlines();
    let has_changes = case.explanation.as_ref().is_some_and(|reply| !reply.changes.is_empty());
    let most = if has_changes { MOST_BYTES_BESIDE_CHANGES } else { MOST_BYTES - 2000 };
    let room = most.saturating_sub(case.document().len());
    let points = question.map_or_else(Vec::new, Question::points);
    let frame = FittedFrame::new(session, run, &points, room)?;
    case.left_out.extend(frame.left_out.iter().cloned());
    if frame.detail.thinning.is_some() && shown.is_object() {
        case.shown["points"] = json!(frame.places(&points));
    }
    case.picture.clone_from(&frame.picture);
    case.add_changes(session, run, &frame);
    Ok(case.document().into_bytes())
}

/// What a change leads to: the run without the points of its cloud, and its scores.
fn alternative(
    session: &Session,
    run: &Run,
    change: &Change,
    frame: &FittedFrame,
) -> Outcome<Value> {
    let mut setting: Setting = run.setting.clone();
    setting.set.extend(change.set.clone());
    let message = &run.cloud.message;
    let changed = session.run(&message.topic, message.number, &setting)?;
    let mut compared = super::compared::compared(run, &changed);
    let labels = [run, &changed].map(|run| run.stages.labels.instance.as_slice());
    if let (Some(thinning), Some(all)) =
        (&frame.detail.thinning, compared["differences"].as_array_mut())
    {
        for one in all {
            let example = one["example"].as_u64().unwrap_or_default() as usize;
            one["example"] = json!(thinning.stand_in(example, labels));
        }
    }
    let own = picture(session, &changed, (false, frame.sums.clone()), &frame.detail)?;
    Ok(json!({
        "setting": setting,
        "scores": scores(&changed),
        "compared": compared,
        "picture": packed(&own.finish()),
    }))
}
