//! How well and how fast a method segments clouds with truth.

use serde::{Deserialize, Serialize};

use crate::annotate::AnnotateConfig;
use crate::error::Result;
use crate::evaluate::entropy::{Entropies, entropies, true_parts};
use crate::evaluate::panoptic::{ClassQuality, MIN_POINTS, Panoptic, PanopticQuality};
use crate::frames::LabelledFrame;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::geometry::statistics::{mean_and_deviation, median};
use divmerge_core::pipeline::{self, Stages};

/// How well and how fast a method segments some clouds. Scores are from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodScores {
    /// Clouds.
    pub frames: usize,
    /// Means over the classes of which truth has [`MIN_POINTS`] points or more; `None` where the
    /// method is given no classes.
    pub all: Option<PanopticQuality>,
    /// Means over the things among them.
    pub things: Option<PanopticQuality>,
    /// Each thing class among them with its name.
    pub classes: Vec<(String, ClassQuality)>,
    /// Mean and standard deviation over the clouds of the over-segmentation entropy, nats.
    pub over: (f64, f64),
    /// Mean and standard deviation over the clouds of the under-segmentation entropy, nats.
    pub under: (f64, f64),
    /// Median time of a cloud from object mask to instances, milliseconds.
    pub cut_ms: f64,
    /// Median time of a cloud from cloud to labels, milliseconds.
    pub frame_ms: f64,
    /// Longest time of a cloud from cloud to labels, milliseconds.
    pub slowest_ms: f64,
}

/// Runs a method over clouds with truth and scores it.
///
/// Entropies are over the true things where the method is given classes, else over the true objects
/// of [`entropy`](crate::evaluate::entropy).
///
/// # Errors
/// Those of the clouds, of [`AnnotateConfig::prepare`], of [`AnnotateConfig::detections`] and of
/// [`LabelledFrame::true_class_numbers`].
pub fn measure(
    frames: impl IntoIterator<Item = Result<LabelledFrame>>,
    method: &AnnotateConfig,
    min_points: u64,
    mut on_frame: impl FnMut(),
) -> Result<MethodScores> {
    let taxonomy = &method.taxonomy;
    let mut sums = ScoreSums::new(taxonomy, min_points);
    for frame in frames {
        let mut frame = frame?;
        method.prepare(&mut frame)?;
        sums.add(&frame, method)?;
        on_frame();
    }
    Ok(sums.measured(taxonomy))
}

struct ScoreSums {
    panoptic: Panoptic,
    sees_classes: bool,
    over: Vec<f64>,
    under: Vec<f64>,
    cut_ms: Vec<f64>,
    frame_ms: Vec<f64>,
}

impl ScoreSums {
    fn new(taxonomy: &Taxonomy, min_points: u64) -> Self {
        ScoreSums {
            panoptic: Panoptic::of(taxonomy, min_points),
            sees_classes: true,
            over: Vec::new(),
            under: Vec::new(),
            cut_ms: Vec::new(),
            frame_ms: Vec::new(),
        }
    }

    fn add(&mut self, frame: &LabelledFrame, method: &AnnotateConfig) -> Result<()> {
        let taxonomy = &method.taxonomy;
        let true_class = frame.true_class_numbers(taxonomy)?;
        let (mask, detections) = (method.mask(&frame.cloud), method.detections(frame)?);
        let stages = pipeline::run_with(&frame.cloud, mask, &detections, &method.pipeline);
        let found = &stages.labels.instance;
        if stages.mask.has_classes() {
            let found_class = taxonomy.class_numbers(&stages.labels.semantic);
            self.panoptic.add(&found_class, found, &true_class, &frame.truth.id);
        } else {
            self.sees_classes = false;
        }
        let entropies = frame_entropies(frame, &true_class, taxonomy, &stages);
        self.over.push(entropies.over);
        self.under.push(entropies.under);
        self.cut_ms.push(stages.times.divide_ms + stages.times.merge_ms);
        self.frame_ms.push(stages.times.total_ms());
        Ok(())
    }

    fn measured(mut self, taxonomy: &Taxonomy) -> MethodScores {
        let scores = &self.panoptic;
        let all = taxonomy.classes();
        let is_there = |class: usize| scores.true_points(class) >= MIN_POINTS;
        let is_thing = |class: usize| scores.is_thing_present(taxonomy, class);
        let things = (0..all.len()).filter(|&class| self.sees_classes && is_thing(class));
        let named = things.map(|class| (all[class].name.clone(), scores.class(class)));
        MethodScores {
            frames: self.frame_ms.len(),
            all: self.sees_classes.then(|| scores.mean(is_there)),
            things: self.sees_classes.then(|| scores.mean(is_thing)),
            classes: named.collect(),
            over: mean_and_deviation(&self.over),
            under: mean_and_deviation(&self.under),
            cut_ms: median(&mut self.cut_ms).unwrap_or(0.0),
            frame_ms: median(&mut self.frame_ms).unwrap_or(0.0),
            slowest_ms: self.frame_ms.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// The entropies of a frame; where classes are seen, of the true things alone, points of no thing
/// left out.
fn frame_entropies(
    frame: &LabelledFrame,
    true_class: &[u16],
    taxonomy: &Taxonomy,
    stages: &Stages,
) -> Entropies {
    let found = &stages.labels.instance;
    if !stages.mask.has_classes() {
        let classes = (&frame.truth.class[..], true_class);
        return entropies(&true_parts(&frame.cloud, &frame.truth.id, classes, taxonomy), found);
    }
    let of_point = true_class.iter().zip(&frame.truth.id).zip(found);
    let things =
        of_point.filter(|((class, _), _)| taxonomy.classes()[usize::from(**class)].is_thing);
    // Ids count from 1 here: 0 is no part.
    let (things, found): (Vec<u32>, Vec<u32>) =
        things.map(|((_, &id), &found)| (id.saturating_add(1), found)).unzip();
    entropies(&things, &found)
}
