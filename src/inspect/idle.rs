//! Parameters that change nothing of a run, whatever their values.

use serde_json::{Map, Value, json};

use super::run::Run;
use crate::diagnose::explain::in_force::why_idle;
use divmerge_core::parameters::registry;

/// By path, why each parameter that changes nothing of the run does not.
pub(super) fn idle(run: &Run) -> Map<String, Value> {
    let frame = run.clustered();
    let reason = |path: &str| Some((path.to_owned(), json!(why_idle(&frame, path)?)));
    registry().iter().filter_map(|parameter| reason(&parameter.path)).collect()
}
