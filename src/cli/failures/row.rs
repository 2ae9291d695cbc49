//! A failure, where it is, and the commands that show it.

use std::path::Path;

use serde::Serialize;

use crate::cli::shell::{command_line, option_words, path_word};
use crate::cli::table::csv_line;
use crate::diagnose::failures::{Failure, ObjectOrigin, PixelBounds};

/// A failure and where it is.
#[derive(Serialize)]
pub struct Row {
    /// Topic or sequence.
    pub topic: String,
    pub frame: u64,
    /// Log time in nanoseconds; `None` in a folder.
    pub log_time_ns: Option<u64>,
    #[serde(flatten)]
    pub failure: Failure,
    /// The cause in words.
    pub cause_in_words: String,
    /// Positions of the points to look at, metres.
    pub at: Vec<[f32; 3]>,
    /// The command that explains it; `None` for methods without an explanation.
    pub explain: Option<String>,
    /// The command that draws it.
    pub figure: Option<String>,
}

/// A frame, for commands that show something in it.
pub struct Commands<'a> {
    pub input: &'a Path,
    pub topic: Option<&'a str>,
    /// Topic or sequence.
    pub source: &'a str,
    pub number: u64,
    /// Options of the method.
    pub method: &'a [String],
}

impl Commands<'_> {
    pub fn explain(&self, at: &[[f32; 3]]) -> String {
        let at = at.iter().flat_map(|[x, y, z]| ["--at".into(), format!("{x:.3},{y:.3},{z:.3}")]);
        self.command("explain", at)
    }

    /// Draws the object's part of the image and as much again around it. `None` for an object on
    /// both sides of the first column.
    pub fn figure(&self, pixels: &PixelBounds, image_columns: usize) -> Option<String> {
        let columns = pixels.columns.len();
        let around = columns.max(20);
        let first = pixels.columns.start.saturating_sub(around);
        let end = (pixels.columns.end + around).min(image_columns);
        let crop = format!("{first}..{end}");
        let words = ["--window", &crop, "-o", "failure.png"].map(str::to_owned);
        (2 * columns < image_columns).then(|| self.command("figure", words))
    }

    fn command(&self, name: &str, options: impl IntoIterator<Item = String>) -> String {
        // Of a folder the recording that `convert` writes for a sequence.
        let input = match self.input.is_dir() {
            true => path_word(Path::new(&format!("{}.mcap", self.source))),
            false => path_word(self.input),
        };
        let mut words = vec!["divmerge".to_owned(), name.into(), input];
        words.extend(["--frame".into(), self.number.to_string()]);
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
        let judged = &row.failure.judged;
        let [x, y, z] = judged.centre.map(|along| format!("{along:.3}"));
        csv_line(&[
            row.topic.clone(),
            row.frame.to_string(),
            row.log_time_ns.map_or(String::new(), |ns| ns.to_string()),
            side_name(row.failure.side).to_owned(),
            judged.class_name.clone(),
            judged.object.id.to_string(),
            judged.points.to_string(),
            x,
            y,
            z,
            judged.verdict.name().into(),
            format!("{:.4}", judged.iou),
            row.failure.cause.step().into(),
            row.cause_in_words.clone(),
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
