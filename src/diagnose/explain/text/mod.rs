//! An explanation in words, for the terminal and for the pages of triage.
//!
//! | what | file |
//! | --- | --- |
//! | the answer in one sentence | `headline` |
//! | what the votes decided | `votes` |
//! | what the later stages did | `stages` |
//! | what the cut of the tree of merges did | `cut` |
//! | which change gives the other answer | `what_if` |

mod cut;
mod headline;
mod stages;
mod votes;
mod what_if;
mod words;

use std::fmt::{self, Display, Formatter, Write};
use std::path::PathBuf;

use serde::Serialize;

use crate::diagnose::explain::{Explanation, PointFacts, WhatIf};
use crate::text::fitted;
use divmerge_core::cloud::Reason;
use words::{condition, counted, instance, pixel, position};

/// An explanation and where it is from; as JSON, everything that is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExplanationReport {
    /// The recording.
    pub file: PathBuf,
    /// Cloud topic.
    pub topic: String,
    /// Number of the cloud on its topic, from 0.
    pub frame: u64,
    /// The first of the messages that are put together in the cloud, if `frame` is the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_frame: Option<u64>,
    /// Log time of the cloud in nanoseconds.
    pub log_time_ns: u64,
    /// Preset of the run.
    pub preset: &'static str,
    /// Where the objects came from.
    pub semantics: String,
    /// Number of instances in the frame.
    pub instances: usize,
    /// Distance of each point from the requested position, metres.
    pub away: Vec<f64>,
    /// The explanation.
    #[serde(flatten)]
    pub explanation: Explanation,
    /// How often each pair of border pixels counts in V+ and V-.
    pub votes_per_border_pair: u8,
    /// Changes of single parameters that give the other answer, if they were searched for.
    pub what_if: Option<Vec<WhatIf>>,
}

/// A report line by line.
#[derive(Debug, Clone, Copy)]
pub struct ExplanationText<'a> {
    /// The report.
    pub report: &'a ExplanationReport,
    /// Maximum number of pixel pairs to list for a border.
    pub max_pairs: usize,
}

impl Display for ExplanationText<'_> {
    fn fmt(&self, out: &mut Formatter) -> fmt::Result {
        let mut text = String::new();
        self.write(&mut text)?;
        out.write_str(&fitted(&text))
    }
}

impl ExplanationText<'_> {
    fn write(&self, out: &mut String) -> fmt::Result {
        let ExplanationReport { explanation, frame, topic, .. } = self.report;
        let which = match self.report.first_frame {
            Some(first) => format!("Frames {first} to {frame}"),
            None => format!("Frame {frame}"),
        };
        writeln!(out, "{}\n", explanation.headline())?;
        writeln!(
            out,
            "{which} of {topic}, {}, preset {}, objects from {}; positions in metres in the \
             cloud's own frame.",
            counted(self.report.instances, "instance"),
            self.report.preset,
            self.report.semantics
        )?;
        let names = if explanation.points.len() == 1 { [" "; 2] } else { words::NAMES };
        for (number, (name, point)) in names.iter().zip(&explanation.points).enumerate() {
            let away = self.report.away.get(number).copied().unwrap_or(0.0);
            point_lines(out, name, point, away, explanation.is_cut())?;
        }
        if let Some(evidence) = &explanation.votes {
            writeln!(out)?;
            votes::write(out, evidence, explanation, self.max_pairs)?;
        }
        for stage in &explanation.post_merge {
            writeln!(out, "\n{}", stages::text(stage))?;
        }
        if let Some(what_if) = &self.report.what_if {
            writeln!(out)?;
            what_if::write(out, what_if)?;
        }
        Ok(())
    }
}

fn point_lines(
    out: &mut String,
    name: &str,
    point: &PointFacts,
    away: f64,
    is_cut: bool,
) -> fmt::Result {
    let away = match away >= 0.0005 {
        true => format!(", {away:.3} m from the requested position"),
        false => String::new(),
    };
    let class = match point.class_name.as_str() {
        "" => String::new(),
        name => format!(", class {name}"),
    };
    let (at, index, range) = (position(point.position), point.index, point.range);
    writeln!(out, "  {name}  {at} (point {index}{away}), range {range:.2} m{class}")?;
    writeln!(out, "     {}", pixel_of(point))?;
    if let Some(component) = component_of(point, is_cut) {
        writeln!(out, "     {component}")?;
    }
    writeln!(out, "     {}", instance_or_reason(point))?;
    let is_unseeded = point.component.is_some_and(|component| component.seed.is_none());
    if !is_cut && (point.reason == Reason::Unreached || is_unseeded) {
        for pair in &point.neighbours {
            writeln!(out, "       neighbour {}: {}", pixel(pair.b), condition(pair))?;
        }
    }
    Ok(())
}

fn pixel_of(point: &PointFacts) -> String {
    let Some([row, column]) = point.pixel else {
        return "no pixel".into();
    };
    let hidden = point.hidden_behind.map_or(String::new(), |front| {
        format!(", hidden behind a nearer point at {}", position(front.position))
    });
    format!("pixel row {row} column {column}{hidden}")
}

/// Its component; without classes a leaf of the tree of merges, which has neither seed nor group.
fn component_of(point: &PointFacts, is_cut: bool) -> Option<String> {
    let component = point.component?;
    if is_cut {
        let pixels = counted(component.pixels, "pixel");
        return Some(format!("component {} ({pixels})", component.label));
    }
    let seed = match component.seed {
        Some(seed) => format!("seeded at {}", pixel(seed)),
        None => "not reached by any seed".into(),
    };
    let group = point.group.map_or(String::new(), |group| {
        format!(
            "; group {} of the vote merge: {}, {}",
            group.number,
            counted(group.components, "component"),
            counted(group.pixels, "pixel")
        )
    });
    let pixels = counted(component.pixels, "pixel");
    Some(format!("component {} ({pixels}, {seed}){group}", component.label))
}

/// A point's instance, or why it has none.
fn instance_or_reason(point: &PointFacts) -> String {
    let class = &point.class_name;
    match point.reason {
        Reason::None => instance(point),
        Reason::NoReturn => "no return: the beam hit nothing".into(),
        Reason::NotAnObject => {
            format!("not an object: class {class} (id {}) is not a thing", point.semantic)
        }
        Reason::Ground => "not an object: ground, by its geometry".into(),
        Reason::Shadowed => {
            "no instance: hidden, and no pixel of its class is near enough to take a label from"
                .into()
        }
        Reason::Unreached => {
            "no instance: no seed reached its pixel; conditions towards its neighbours:".into()
        }
        Reason::TooSmall => "no instance: its instance was below the minimum size".into(),
        Reason::Scattered => {
            "no instance: of a group of too few pixels to be one (scattered)".into()
        }
        Reason::Cropped => "left out: by --min-range, --max-range, --crop or --ego".into(),
    }
}
