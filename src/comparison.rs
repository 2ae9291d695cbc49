//! Methods side by side: how good and how fast each cuts the same clouds into instances.

use serde::{Deserialize, Serialize};

use crate::annotate::Method;
use crate::error::{Error, Result};
use crate::evaluate::entropy::{LEFT_OUT, TOLERANCE, entropies, mean_and_deviation, true_objects};
use crate::evaluate::{ClassQuality, Panoptic, PanopticQuality, entropy};
use crate::io::{LabelledFrame, Truth};
use crate::pipeline;
use crate::taxonomy::Taxonomy;

/// How good and how fast a method is on some clouds. Figures of quality from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Clouds.
    pub frames: usize,
    /// Means over the classes that truth has with [`panoptic::MIN_POINTS`](crate::evaluate::panoptic::MIN_POINTS)
    /// points or more; `None` where the method sees no classes.
    pub all: Option<PanopticQuality>,
    /// Means over the things among them.
    pub things: Option<PanopticQuality>,
    /// Each thing among them with its name.
    pub classes: Vec<(String, ClassQuality)>,
    /// Mean and standard deviation over the clouds of the over-segmentation entropy, nats.
    pub over: (f64, f64),
    /// The same of the under-segmentation entropy.
    pub under: (f64, f64),
    /// Median over the clouds of the milliseconds from object mask to instances.
    pub cut_ms: f64,
    /// Median over the clouds of the milliseconds from cloud to labels.
    pub frame_ms: f64,
    /// The same of the slowest cloud.
    pub slowest_ms: f64,
}

/// Runs a method over clouds with truth.
///
/// Entropies are over the true things where the method sees classes, else over the true objects of
/// [`entropy`].
///
/// # Errors
/// Those of the clouds, of [`Method::prepare`] and of [`Method::detections`]; [`Error::Truth`] for classes that the taxonomy does not know.
pub fn measure(
    frames: impl IntoIterator<Item = Result<LabelledFrame>>,
    method: &Method,
    min_points: u64,
    mut on_frame: impl FnMut(),
) -> Result<Measured> {
    let taxonomy = &method.taxonomy;
    let mut sums = Sums::new(taxonomy, min_points);
    for frame in frames {
        let mut frame = frame?;
        method.prepare(&mut frame)?;
        sums.add(&frame, method)?;
        on_frame();
    }
    Ok(sums.measured(taxonomy))
}

struct Sums {
    panoptic: Panoptic,
    sees_classes: bool,
    over: Vec<f64>,
    under: Vec<f64>,
    cut_ms: Vec<f64>,
    frame_ms: Vec<f64>,
}

impl Sums {
    fn new(taxonomy: &Taxonomy, min_points: u64) -> Self {
        Sums {
            panoptic: Panoptic::of(taxonomy, min_points),
            sees_classes: true,
            over: Vec::new(),
            under: Vec::new(),
            cut_ms: Vec::new(),
            frame_ms: Vec::new(),
        }
    }

    fn add(&mut self, frame: &LabelledFrame, method: &Method) -> Result<()> {
        let taxonomy = &method.taxonomy;
        let true_class = class_numbers(&frame.truth, taxonomy, frame)?;
        let (mask, detections) = (method.mask(&frame.cloud), method.detections(frame)?);
        let stages = pipeline::run_with(&frame.cloud, mask, &detections, &method.config);
        let found = &stages.labels.instance;
        if stages.mask.has_classes() {
            let of_raw = |raw: &u16| taxonomy.class_of(*raw).unwrap_or(0);
            let found_class: Vec<u16> = stages.labels.semantic.iter().map(of_raw).collect();
            self.panoptic.add(&found_class, found, &true_class, &frame.truth.id);
        } else {
            self.sees_classes = false;
        }
        let objects = objects(frame, &true_class, taxonomy, stages.mask.has_classes());
        let entropies = entropies(&objects, found);
        self.over.push(entropies.over);
        self.under.push(entropies.under);
        self.cut_ms.push(stages.times.divide_ms + stages.times.merge_ms);
        self.frame_ms.push(stages.times.total_ms());
        Ok(())
    }

    fn measured(self, taxonomy: &Taxonomy) -> Measured {
        let scores = &self.panoptic;
        let all = taxonomy.classes();
        let is_there =
            |class: usize| scores.true_points(class) >= crate::evaluate::panoptic::MIN_POINTS;
        let is_thing = |class: usize| scores.is_thing_present(taxonomy, class);
        let things = (0..all.len()).filter(|&class| self.sees_classes && is_thing(class));
        let named = things.map(|class| (all[class].name.clone(), scores.class(class)));
        Measured {
            frames: self.frame_ms.len(),
            all: self.sees_classes.then(|| scores.mean(is_there)),
            things: self.sees_classes.then(|| scores.mean(is_thing)),
            classes: named.collect(),
            over: mean_and_deviation(&self.over),
            under: mean_and_deviation(&self.under),
            cut_ms: median(&self.cut_ms),
            frame_ms: median(&self.frame_ms),
            slowest_ms: self.frame_ms.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// True class numbers.
fn class_numbers(truth: &Truth, taxonomy: &Taxonomy, frame: &LabelledFrame) -> Result<Vec<u16>> {
    let number = |&raw: &u16| taxonomy.class_of(raw).ok_or(raw);
    let numbers: std::result::Result<Vec<u16>, u16> = truth.class.iter().map(number).collect();
    numbers.map_err(|raw| Error::Truth {
        at: format!("cloud {} of {}", frame.number, frame.source),
        problem: format!("true class {raw} is not in taxonomy {}", taxonomy.name),
    })
}

/// The true objects over which entropies are summed.
fn objects(
    frame: &LabelledFrame,
    true_class: &[u16],
    taxonomy: &Taxonomy,
    sees_classes: bool,
) -> Vec<u32> {
    if sees_classes {
        // The ids of things count from 1 so that none is taken for what is left out.
        let thing = |(&class, &id): (&u16, &u32)| {
            let is_thing = taxonomy.classes()[usize::from(class)].is_thing;
            if is_thing { id.saturating_add(1) } else { LEFT_OUT }
        };
        return true_class.iter().zip(&frame.truth.id).map(thing).collect();
    }
    let kinds = entropy::kinds(&frame.cloud, &frame.truth.class, true_class, taxonomy);
    true_objects(&frame.cloud, &kinds, TOLERANCE, entropy::MIN_POINTS)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
