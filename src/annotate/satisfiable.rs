//! Options that no cloud of a recording can satisfy. They are refused before a run begins: else
//! each cloud would fail on its own, or nothing would be annotated in silence.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::config::{AnnotateConfig, Semantics};
use crate::error::{Error, NoCloud, Result};
use crate::frames::walk::Walk;
use crate::frames::{CloudTopic, EncodedCloud, Selection};
use divmerge_recording::Overview;

/// Refuses a selection without a cloud, and a field of classes that no selected cloud has.
///
/// Reads up to the first cloud that has what is asked for, so the whole recording only if there is
/// none. What cannot be read is left to the run itself.
///
/// # Errors
/// [`Error::NoCloud`] with what there is.
pub(super) fn refuse_unsatisfiable(
    overview: &Overview,
    clouds: &BTreeMap<u16, CloudTopic>,
    selection: &Selection,
    config: &AnnotateConfig,
) -> Result<()> {
    let field = match &config.semantics {
        Semantics::Field(name) => Some(name.as_str()),
        _ => None,
    };
    let has_window = selection.from_ns.is_some() || selection.to_ns.is_some();
    if field.is_none() && !has_window {
        return Ok(());
    }
    let topics = clouds.iter().map(|(&id, cloud)| (id, Arc::clone(&cloud.topic))).collect();
    let Ok(mut walk) = Walk::open(overview, topics, selection) else { return Ok(()) };
    let (mut is_empty, mut present) = (true, None);
    loop {
        let cloud = match walk.next() {
            Ok(Some(step)) => EncodedCloud::of_step(step, clouds),
            Ok(None) => break,
            Err(_) => return Ok(()),
        };
        let Some(cloud) = cloud else { continue };
        let Some(field) = field else { return Ok(()) };
        is_empty = false;
        if let Ok(wire) = cloud.decode() {
            if wire.field(field).is_some() {
                return Ok(());
            }
            let names = || wire.fields.iter().map(|field| field.name.clone()).collect();
            present.get_or_insert_with(names);
        }
    }
    let problem = match (field, present) {
        (Some(field), Some(present)) => NoCloud::NoSuchField { field: field.to_owned(), present },
        _ if is_empty && has_window => {
            NoCloud::NothingSelected { times_ns: overview.start_ns.zip(overview.end_ns) }
        }
        _ => return Ok(()),
    };
    Err(Error::NoCloud { path: overview.path.clone(), problem })
}
