//! Command lines that repeat what is seen.

use super::requests::CommandKind;
use super::run::Run;
use super::session::Session;
use crate::text::{option_words, path_word};

/// The command of a kind on a run, with the positions of the points that are selected.
pub(super) fn command(session: &Session, run: &Run, kind: CommandKind, at: &[String]) -> String {
    let message = &run.cloud.message;
    let name = match kind {
        CommandKind::Figure => "figure",
        CommandKind::Explain => "explain",
        CommandKind::Annotate => "annotate",
        CommandKind::Inspect => "inspect",
    };
    let mut words = vec!["divmerge".to_owned(), name.into(), path_word(&session.options.input)];
    words.extend(option_words("--topic", &message.topic));
    if kind != CommandKind::Annotate {
        words.extend(["--frame".into(), message.number.to_string()]);
    }
    match kind {
        CommandKind::Figure => words.extend(["-o".into(), "figure.svg".into()]),
        CommandKind::Annotate => words.extend(["-o".into(), "annotated.mcap".into()]),
        CommandKind::Explain => {
            words.extend(at.iter().flat_map(|at| ["--at".to_owned(), at.clone()]));
        }
        CommandKind::Inspect => {}
    }
    words.extend(run.setting.words(&session.options.words));
    (session.options.command_line)(&words)
}
