//! A failure, where it is, and the commands that show it.

use std::path::Path;

use serde::Serialize;

use crate::cli::shell::{command_line, option_words, path_word};
use crate::diagnose::failures::{FailureInFrame, ObjectOrigin};
use crate::text::csv_line;

/// A failure and the commands that show it.
#[derive(Serialize)]
pub struct Row {
    #[serde(flatten)]
    pub found: FailureInFrame,
    /// The command that explains it; `None` for methods without an explanation.
    pub explain: Option<String>,
    /// The command that draws it.
    pub figure: Option<String>,
}

/// Makes commands that show something of an input.
pub struct Commands<'a> {
    pub input: &'a Path,
    pub topic: Option<&'a str>,
    /// Options of the method.
    pub method: &'a [String],
    /// Whether the method is one that `explain` explains.
    pub has_explanation: bool,
}

impl Commands<'_> {
    pub fn row(&self, found: FailureInFrame) -> Row {
        let explain = self.has_explanation.then(|| self.explain(&found));
        Row { explain, figure: self.figure(&found), found }
    }

    fn explain(&self, found: &FailureInFrame) -> String {
        let at = found.at.iter();
        let at = at.flat_map(|[x, y, z]| ["--at".into(), format!("{x:.3},{y:.3},{z:.3}")]);
        self.command("explain", found, at)
    }

    fn figure(&self, found: &FailureInFrame) -> Option<String> {
        let window = found.window()?;
        let window = format!("{}..{}", window.start, window.end);
        let words = ["--window", &window, "-o", "failure.png"].map(str::to_owned);
        Some(self.command("figure", found, words))
    }

    fn command(
        &self,
        name: &str,
        found: &FailureInFrame,
        options: impl IntoIterator<Item = String>,
    ) -> String {
        // Of a folder the recording that `convert` writes for a sequence.
        let input = match self.input.is_dir() {
            true => path_word(Path::new(&format!("{}.mcap", found.topic))),
            false => path_word(self.input),
        };
        let mut words = vec!["divmerge".to_owned(), name.into(), input];
        words.extend(["--frame".into(), found.frame.to_string()]);
        if let Some(topic) = self.topic {
            words.extend(option_words("--topic", topic));
        }
        words.extend_from_slice(self.method);
        words.extend(options);
        command_line(&words)
    }
}

/// The failures as CSV.
pub fn csv(rows: &[Row]) -> String {
    let head =
        "topic,frame,log_time_ns,side,class,id,points,x,y,z,verdict,iou,step,cause,explain,figure";
    let line = |row: &Row| {
        let FailureInFrame { failure, .. } = &row.found;
        let judged = &failure.judged;
        let [x, y, z] = judged.centre.map(|along| format!("{along:.3}"));
        csv_line(&[
            row.found.topic.clone(),
            row.found.frame.to_string(),
            row.found.log_time_ns.map_or(String::new(), |ns| ns.to_string()),
            side_name(failure.side).to_owned(),
            judged.class_name.clone(),
            judged.object.id.to_string(),
            judged.points.to_string(),
            x,
            y,
            z,
            judged.verdict.name().into(),
            format!("{:.4}", judged.iou),
            failure.cause.step().into(),
            row.found.cause_in_words.clone(),
            row.explain.clone().unwrap_or_default(),
            row.figure.clone().unwrap_or_default(),
        ])
    };
    std::iter::once(format!("{head}\n")).chain(rows.iter().map(line)).collect()
}

/// `true` or `found`.
pub fn side_name(side: ObjectOrigin) -> &'static str {
    match side {
        ObjectOrigin::True => "true",
        ObjectOrigin::Found => "found",
    }
}
