//! Scores of a run whose cloud has truth: panoptic quality, objects found whole, and failures.

use serde_json::{Value, json};

use super::compared::counts_by_name;
use super::run::Run;
use crate::diagnose::failures::{Failure, LabelledRun, failures};
use crate::diagnose::triage::ranking::recorded_positions;
use crate::evaluate::Panoptic;
use crate::evaluate::panoptic::MIN_POINTS;
use crate::evaluate::verdict::{JudgedObject, Labelling, MatchRules, Verdict, verdicts};
use divmerge_core::cloud::taxonomy::Taxonomy;

/// The scores of a run; `None` without truth, or if the truth has classes that its taxonomy does
/// not know.
pub(super) fn scores(run: &Run) -> Option<Value> {
    let truth = run.cloud.truth.as_ref()?;
    let taxonomy = run.cloud.taxonomy(&run.config);
    let true_class = taxonomy.known_class_numbers(&truth.class).ok()?;
    let labels = &run.stages.labels;
    let found_class = taxonomy.class_numbers(&labels.semantic);
    let by_class = run.stages.mask.has_classes();
    let found = verdicts(
        &run.cloud.cloud,
        Labelling { class: &true_class, id: &truth.id },
        Labelling { class: &found_class, id: &labels.instance },
        taxonomy,
        MatchRules { min_points: MIN_POINTS, by_class },
    );
    let counted = |all: &[JudgedObject]| {
        let whole = all.iter().filter(|one| one.verdict == Verdict::Correct).count();
        let failed = all.iter().filter(|one| one.is_failure()).count();
        (whole, failed)
    };
    let (whole, failed) = counted(&found.truth);
    let failures = found.truth.iter().filter(|one| one.is_failure());
    let kinds = counts_by_name(failures.map(|one| one.verdict.name()));
    let (_, spurious) = counted(&found.found);
    Some(json!({
        "found_whole": whole,
        "objects": whole + failed,
        "verdicts": kinds,
        "false_instances": spurious,
        "pq": by_class.then(|| panoptic(run, taxonomy, &true_class, &found_class)).flatten(),
    }))
}

/// Panoptic quality, the mean over the thing classes that truth or run has here.
fn panoptic(
    run: &Run,
    taxonomy: &Taxonomy,
    true_class: &[u16],
    found_class: &[u16],
) -> Option<f64> {
    let truth = run.cloud.truth.as_ref()?;
    let mut sums = Panoptic::of(taxonomy, MIN_POINTS);
    sums.add(found_class, &run.stages.labels.instance, true_class, &truth.id);
    let is_there = |class: usize| {
        let quality = sums.class(class);
        let segments = quality.true_positives + quality.false_positives + quality.false_negatives;
        taxonomy.classes()[class].is_thing && segments > 0
    };
    let any = (0..taxonomy.classes().len()).any(is_there);
    any.then(|| sums.mean(is_there).pq)
}

/// A failure with a sentence, and the positions of its points in the recording's frame.
pub(super) struct FoundFailure {
    pub failure: Failure,
    pub sentence: String,
    pub at: Vec<[f64; 3]>,
}

/// The failures of a run with their causes; none without truth or if the truth has unknown classes.
pub(super) fn found_failures(run: &Run) -> Vec<FoundFailure> {
    let Some(truth) = &run.cloud.truth else { return Vec::new() };
    let taxonomy = run.cloud.taxonomy(&run.config);
    if taxonomy.known_class_numbers(&truth.class).is_err() {
        return Vec::new();
    }
    let found = failures(&LabelledRun {
        frame: run.clustered(),
        detections: &run.cloud.detections,
        true_class: &truth.class,
        true_id: &truth.id,
        taxonomy,
        min_points: MIN_POINTS,
    });
    let of_one = |failure: Failure| FoundFailure {
        sentence: failure.cause.describe(),
        at: recorded_positions(&run.cloud.cloud, &failure.show),
        failure,
    };
    found.failures.into_iter().map(of_one).collect()
}
