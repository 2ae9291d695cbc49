//! Parameters that change nothing of a run, whatever their values.

use serde_json::{Map, Value, json};

use super::run::Run;
use divmerge_core::parameters::registry;

/// What acts whatever the method.
const OF_ALL: [&str; 2] = ["cluster.back_projection", "cluster.min_pixels"];
const CORRECTIONS_OF_CLASSES: [&str; 3] = ["smoothing", "bleed", "segment_vote"];

/// By path, why each parameter that changes nothing of the run does not.
pub(super) fn idle(run: &Run) -> Map<String, Value> {
    let all = registry().iter();
    all.filter_map(|parameter| {
        let path = parameter.path.as_str();
        Some((path.to_owned(), json!(why_idle(run, path)?)))
    })
    .collect()
}

fn why_idle(run: &Run, path: &str) -> Option<&'static str> {
    let mask = &run.stages.mask;
    let is_cut = run.stages.post_merge.tree.is_some();
    let is_other = run.config.pipeline.other_method.is_some();
    if !mask.has_classes() && is_of(path, &CORRECTIONS_OF_CLASSES) {
        return Some("this cloud has no classes, which these correct");
    }
    if !is_of(path, &["cluster"]) {
        return None;
    }
    if is_other && !mask.bleeds && !is_of(path, &OF_ALL) {
        return Some("another method clusters, which does not have these");
    }
    if is_cut && !is_of(path, &OF_ALL) && !is_of(path, &["cluster.tree"]) {
        return Some("this cloud has no classes: the tree of merges is cut in place of this");
    }
    if mask.has_classes() && is_of(path, &["cluster.tree"]) {
        return Some("this cloud has classes: the tree of merges is cut only without");
    }
    None
}

/// Whether a parameter is one of some parts or belongs to it.
fn is_of(path: &str, parts: &[&str]) -> bool {
    parts.iter().any(|part| {
        let rest = path.strip_prefix(part);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    })
}
