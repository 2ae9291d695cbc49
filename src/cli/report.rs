//! What an annotation did, in words.

use std::collections::BTreeMap;

use crate::annotate::{AnnotationReport, FrameTimes, MotionReport, TopicReport};
use crate::cloud::Reason;

use crate::cli::text::{counted, fitted, grouped};

/// Each topic with the reasons of its points, then the output.
pub fn text(report: &AnnotationReport) -> String {
    let mut text = String::new();
    for (topic, report) in &report.topics {
        text += &format!("{topic}: {}\n", summary(report));
        if report.frames > 0 {
            text += &format!("    {}\n    points: {}\n", sources(report), reasons(report));
            text += &motion(report);
        }
    }
    text += &format!(
        "wrote {} ({}, {} and {})\n",
        report.output.display(),
        counted(report.output_bytes, "byte"),
        counted(report.messages, "message"),
        counted(report.annotations, "annotation"),
    );
    fitted(&text)
}

fn summary(report: &TopicReport) -> String {
    if report.frames + report.unreadable == 0 {
        return "no clouds".into();
    }
    let mut line = format!(
        "{}, {}, {:.1} instances per frame",
        counted(report.frames, "frame"),
        counted(report.points, "point"),
        report.instances as f64 / report.frames.max(1) as f64,
    );
    if report.frames > report.resumed {
        line += &times(&report.times);
    }
    if report.unreadable > 0 {
        line += &format!("; {} could not be read", counted(report.unreadable, "cloud"));
    }
    line
}

fn times(times: &FrameTimes) -> String {
    let FrameTimes { decode_ms, semantics_ms, stages, encode_ms } = times;
    let classes = match semantics_ms {
        0.0 => String::new(),
        ms => format!(", classes {ms:.1}"),
    };
    format!(
        ", {:.1} ms per frame (decode {decode_ms:.1}{classes}, project {:.1}, mask {:.1}, divide \
         {:.1}, merge {:.1}, label {:.1}, encode {encode_ms:.1})",
        times.total_ms(),
        stages.projection_ms,
        stages.mask_ms,
        stages.divide_ms,
        stages.merge_ms,
        stages.labels_ms,
    )
}

/// Where the motion of the sensor came from, where objects were followed.
fn motion(report: &TopicReport) -> String {
    let MotionReport { sources, comparisons, .. } = &report.ego_motion;
    if sources.is_empty() {
        return String::new();
    }
    let compared: String = comparisons.iter().map(|found| format!("    {found}\n")).collect();
    let moving = report.tracks.iter().filter(|track| track.moving).count();
    format!(
        "    {} over time, of which {} moved; motion of the sensor from {}\n{compared}",
        counted(report.tracks.len() as u64, "object"),
        grouped(moving as u64),
        join(sources, report.frames)
    )
}

/// Names with their counts, where they are not all.
fn join(counts: &BTreeMap<String, u64>, all: u64) -> String {
    let each = counts.iter().map(|(source, &count)| match count == all {
        true => source.clone(),
        false => format!("{source} ({})", counted(count, "frame")),
    });
    each.collect::<Vec<_>>().join("; ")
}

/// Where objects and rows came from.
fn sources(report: &TopicReport) -> String {
    let join = |counts| join(counts, report.frames);
    let images = match report.projection.len() {
        0..=3 => join(&report.projection),
        sizes => format!("range images of {sizes} sizes"),
    };
    format!("objects from {}; rows from {images}", join(&report.semantics))
}

fn reasons(report: &TopicReport) -> String {
    let share = |count: u64| 100.0 * count as f64 / report.points.max(1) as f64;
    let each = Reason::ALL.iter().filter_map(|reason| {
        let count = *report.reasons.get(reason.describe()).filter(|&&count| count > 0)?;
        Some(format!("{} {} ({:.1} %)", grouped(count), reason.describe(), share(count)))
    });
    each.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_broken_at_spaces() {
        let words = vec!["word"; 40].join(" ");
        let text = fitted(&format!("short\n    {words}\n\nend\n"));
        assert!(text.lines().all(|line| line.len() <= crate::text::WIDTH), "{text}");
        assert!(text.starts_with("short\n    word") && text.ends_with("word\n\nend\n"), "{text}");
        assert!(text.contains("\n        word"), "{text}");
    }
}
