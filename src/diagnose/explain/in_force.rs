//! Which parameters change anything of a run.

use super::subject::ClusteredCloud;

/// Parameters over time, which change nothing of a single frame.
pub(crate) const OVER_TIME: [&str; 3] = ["tracks", "registration", "ego_motion"];
/// What acts whatever the method.
const OF_ALL: [&str; 2] = ["cluster.back_projection", "cluster.min_pixels"];
pub(super) const CORRECTIONS_OF_CLASSES: [&str; 4] =
    ["smoothing", "bleed", "segment_vote", "vehicle_strips"];

/// Why a parameter changes nothing of a run, whatever its value; `None` if it may.
pub(crate) fn why_idle(frame: &ClusteredCloud, path: &str) -> Option<&'static str> {
    let mask = &frame.stages.mask;
    let is_cut = frame.stages.post_merge.tree.is_some();
    let is_other = frame.config.other_method.is_some();
    if !mask.has_classes() && is_part_of(path, &CORRECTIONS_OF_CLASSES) {
        return Some("this cloud has no classes, which these correct");
    }
    if !is_part_of(path, &["cluster"]) {
        return None;
    }
    if is_other && !mask.bleeds && !is_part_of(path, &OF_ALL) {
        return Some("another method clusters, which does not have these");
    }
    if is_cut && !is_part_of(path, &OF_ALL) && !is_part_of(path, &["cluster.tree"]) {
        return Some("this cloud has no classes: the tree of merges is cut in place of this");
    }
    if mask.has_classes() && is_part_of(path, &["cluster.tree"]) {
        return Some("this cloud has classes: the tree of merges is cut only without");
    }
    None
}

/// Whether a parameter decides which points are objects.
pub(super) fn is_of_mask(path: &str) -> bool {
    is_part_of(path, &["ground"]) || is_part_of(path, &CORRECTIONS_OF_CLASSES)
}

/// Whether a parameter is one of some parts or belongs to it.
pub(crate) fn is_part_of(path: &str, parts: &[&str]) -> bool {
    parts.iter().any(|part| {
        let rest = path.strip_prefix(part);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    })
}
