//! An explanation and its figure, for `explain` and the pages of `triage`.

use std::path::Path;

use divmerge::explain::{ExplanationReport, Frame, Subject, explain};
use divmerge::io::CloudMessage;
use divmerge::view::{self, Canvas, ColourTracker, Scene};

/// Explains one or two points of a cloud of `input`, without a search for parameter changes.
pub fn report(
    input: &Path,
    message: &CloudMessage,
    semantics: &str,
    frame: &Frame,
    subject: Subject,
) -> ExplanationReport {
    ExplanationReport {
        file: input.to_owned(),
        topic: message.topic.clone(),
        frame: message.number,
        log_time_ns: message.log_time,
        preset: frame.config.preset,
        semantics: semantics.to_owned(),
        instances: frame.stages.instances.len(),
        away: Vec::new(),
        explanation: explain(frame, subject),
        votes_per_border_pair: 2,
        what_if: None,
    }
}

/// Draws an explanation.
pub fn figure(report: &ExplanationReport, frame: &Frame, dpi: f64) -> Canvas {
    let scene = Scene {
        cloud: frame.cloud,
        stages: frame.stages,
        classes: Vec::new(),
        intensity: None,
        merge_ratio: frame.config.cluster.merge_ratio,
        colour_numbers: ColourTracker::default().colour_numbers(&frame.stages.instances),
        heading: format!("frame {} of {}", report.frame, report.topic),
        remark: format!("objects: {}  ·  preset {}", report.semantics, report.preset),
    };
    let explanation = &report.explanation;
    view::explanation(&scene, explanation, &explanation.headline(), dpi)
}
