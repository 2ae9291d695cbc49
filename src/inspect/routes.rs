//! From a request to a reply: functions over the session, without sockets.

use std::sync::Arc;

use serde_json::json;

use super::commands::command;
use super::compared::compared;
use super::exchange::{Asked, Reply};
use super::figures::figure;
use super::gate::{Access, Gate};
use super::page_files::{asset, document};
use super::picture::picture;
use super::requests::{
    CompareRequest, FrameRequest, Outcome, PointsRequest, Problem, SurveyRequest, read,
};
use super::run::Run;
use super::saved_case::saved_case;
use super::scores::scores;
use super::session::Session;
use super::thinning::Detail;
use super::why::{self, ExplanationReply, Question};

/// Answers a request.
pub fn reply(session: &Arc<Session>, gate: &Gate, asked: &Asked) -> Reply {
    match gate.access(asked) {
        Access::Refused(status, words) => Reply::problem(status, words),
        Access::Granted(path) => answer(session, path, asked)
            .unwrap_or_else(|Problem { status, words }| Reply::problem(status, &words)),
    }
}

fn answer(session: &Arc<Session>, path: &str, asked: &Asked) -> Outcome<Reply> {
    let body = asked.body.as_slice();
    let _busy = (path != "api/survey-state").then(|| session.is_asked());
    match (asked.is_post, path) {
        (false, "") => Ok(Reply::new("text/html; charset=utf-8", document())),
        (false, name) if name.starts_with("page/") => {
            let (content_type, text) = asset(&name[5..]).ok_or_else(Problem::nothing_here)?;
            Ok(Reply::new(content_type, text.into_owned()))
        }
        (true, "api/session") => Ok(Reply::json(&session.facts())),
        (true, "api/frame") => {
            let asked: FrameRequest = read(body)?;
            let run = session.run(&asked.topic, asked.frame, &asked.setting)?;
            let needed = (asked.with_points, asked.known);
            let pack = picture(session, &run, needed, &Detail::WHOLE)?;
            Ok(Reply::new("application/octet-stream", pack.finish()))
        }
        (true, "api/scores") => {
            let asked: FrameRequest = read(body)?;
            let run = session.run(&asked.topic, asked.frame, &asked.setting)?;
            Ok(Reply::json(&scores(&run)))
        }
        (true, "api/compare") => {
            let asked: CompareRequest = read(body)?;
            let run = |setting| session.run(&asked.topic, asked.frame, setting);
            Ok(Reply::json(&compared(&*run(&asked.first)?, &*run(&asked.second)?)))
        }
        (true, "api/survey") => {
            let asked: SurveyRequest = read(body)?;
            session.begin_survey(asked)?;
            Ok(Reply::json(&session.survey.state()))
        }
        (true, "api/survey-stop") => Ok(Reply::json(&session.survey.stop())),
        (true, "api/survey-state") => Ok(Reply::json(&session.survey.state())),
        (true, "api/tracks") => {
            let FrameRequest { topic, frame, setting, .. } = read(body)?;
            Ok(Reply::json(&session.survey.tracks(&topic, frame, &setting)))
        }
        (true, path) => of_points(session, path, read(body)?),
        _ => Err(Problem::nothing_here()),
    }
}

/// Answers what is about points of a frame.
fn of_points(session: &Session, path: &str, asked: PointsRequest) -> Outcome<Reply> {
    let run = session.run(&asked.topic, asked.frame, &asked.setting)?;
    let question = match asked.points.is_empty() {
        true => None,
        false => Some(Question::new(&run, &asked.points)?),
    };
    let needed = || question.as_ref().ok_or_else(|| Problem::wrong("choose a point"));
    match path {
        "api/explain" => {
            let report = why::explained(session, &run, needed()?)?;
            Ok(Reply::json(&ExplanationReply::new(&run, report, needed()?)))
        }
        "api/changes" => {
            let changed = why::changed(session, &run, needed()?)?;
            let called_off = Problem { status: 409, words: "a later search goes on".into() };
            let report = changed.ok_or(called_off)?;
            Ok(Reply::json(&ExplanationReply::new(&run, report, needed()?)))
        }
        "api/command" => command_reply(session, &run, question.as_ref(), &asked),
        "api/figure" => {
            let form = asked.figure.ok_or_else(|| Problem::wrong("say which form of figure"))?;
            let (content_type, bytes) = figure(session, &run, question.as_ref(), &form)?;
            Ok(Reply::new(content_type, bytes))
        }
        "api/case" => {
            let case = saved_case(session, &run, question.as_ref(), &asked.shown)?;
            Ok(Reply::new("text/html; charset=utf-8", case))
        }
        _ => Err(Problem::nothing_here()),
    }
}

fn command_reply(
    session: &Session,
    run: &Run,
    question: Option<&Question>,
    asked: &PointsRequest,
) -> Outcome<Reply> {
    let kind = asked.command.ok_or_else(|| Problem::wrong("say which command"))?;
    let at = question.map_or(&[][..], |question| &question.at);
    Ok(Reply::json(&json!({ "command": command(session, run, kind, at) })))
}
