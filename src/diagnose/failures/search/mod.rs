//! The cause of one failure: the first step of which one of the rules of
//! [`failures`](crate::diagnose::failures) holds.

mod context;
mod divide;
mod mask;
mod merge;
mod post_merge;

use crate::diagnose::failures::case::{LabelledRun, ObjectOrigin, Target};
use crate::diagnose::failures::cause::Cause;
use crate::diagnose::failures::oracles::Oracles;
use crate::evaluate::verdict::Verdict;
use context::{Found, Search};

/// The cause of a failure and the points to look at.
pub(super) fn cause(run: &LabelledRun, oracles: &Oracles, target: &Target) -> (Cause, Vec<usize>) {
    let search = Search { run, oracles, target, stages: run.frame.stages };
    let found = search
        .mask()
        .or_else(|| search.projection())
        .or_else(|| other_method(&search))
        .or_else(|| search.divide())
        .or_else(|| merges(&search))
        .or_else(|| search.mask_after_all());
    match found {
        Some((cause, show)) if !show.is_empty() => (cause, show),
        Some((cause, _)) => (cause, search.show()),
        None => (Cause::Unexplained, search.show()),
    }
}

fn other_method(search: &Search) -> Found {
    let method = search.run.frame.config.other_method.as_ref()?;
    Some((Cause::Method { name: method.name() }, Vec::new()))
}

/// The votes, or a stage after them.
fn merges(search: &Search) -> Found {
    let judged = &search.target.judged;
    let object = match search.target.side {
        ObjectOrigin::True => judged.object,
        ObjectOrigin::Found => judged.parts.first()?.object,
    };
    match judged.verdict {
        Verdict::Missed => search.dropped(),
        Verdict::OverSegmented => search.apart(),
        Verdict::UnderSegmented | Verdict::WrongClass => {
            let merged = search.oracles.merged.verdicts.of_true(object)?;
            match merged.verdict {
                Verdict::UnderSegmented | Verdict::WrongClass => search.joined_by_votes(object),
                _ => search.joined_later(object),
            }
        }
        Verdict::Correct | Verdict::Spurious => None,
    }
}
