//! Panoptic quality of things.

use divmerge::Taxonomy;
use divmerge::evaluate::panoptic::{MIN_POINTS, Panoptic};

use crate::frames::Frame;
use crate::methods::{Found, Method};

/// The columns of classes.
pub const CLASSES: [(&str, &[&str]); 6] = [
    ("car", &["car"]),
    ("truck", &["truck"]),
    ("other-vehicle", &["other-vehicle"]),
    ("bicycle, motorcycle", &["bicycle", "motorcycle"]),
    ("person", &["person"]),
    ("rider", &["bicyclist", "motorcyclist"]),
];

/// Empty sums.
pub fn scores() -> Panoptic {
    Panoptic::of(&Taxonomy::semantic_kitti(), MIN_POINTS)
}

/// Adds a frame to some sums.
pub fn add(frame: &Frame, found: &Found, scores: &mut Panoptic) {
    scores.add(&found.class, &found.instance, &frame.true_class, &frame.true_id);
}

/// Mean PQ in percent of a method over the frames.
pub fn quality<'a>(method: &Method, frames: impl IntoIterator<Item = &'a Frame>) -> f64 {
    let mut sums = scores();
    for frame in frames {
        add(frame, &method.run(frame), &mut sums);
    }
    things(&sums, &[]).unwrap_or(0.0)
}

/// Mean PQ in percent over the things that truth has with 50 points or more, or over those of some
/// names.
pub fn things(scores: &Panoptic, names: &[&str]) -> Option<f64> {
    let taxonomy = Taxonomy::semantic_kitti();
    let chosen = |class: usize| {
        scores.is_thing_present(&taxonomy, class)
            && (names.is_empty() || names.contains(&taxonomy.classes()[class].name.as_str()))
    };
    let occurs = (0..taxonomy.classes().len()).any(chosen);
    occurs.then(|| scores.mean(chosen).pq * 100.0)
}

/// A cell of a table.
pub fn cell(quality: Option<f64>) -> String {
    quality.map_or("-".into(), |quality| format!("{quality:.2}"))
}

/// The head of a table: a column of names, columns of numbers.
pub fn head(first: &str, columns: &[String]) {
    println!("| {first} | {} |", columns.join(" | "));
    println!("| --- |{}", " ---: |".repeat(columns.len()));
}
