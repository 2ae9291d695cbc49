//! Which cloud a thread works on, for the report of a panic.

use std::cell::RefCell;
use std::sync::Arc;

use divmerge_recording::Position;

use super::walk::describe_position;

thread_local! {
    static LAST: RefCell<Option<(Arc<str>, u64, Position)>> = const { RefCell::new(None) };
}

/// Notes the cloud that this thread decodes.
pub(super) fn note(topic: &Arc<str>, number: u64, position: Position) {
    LAST.set(Some((Arc::clone(topic), number, position)));
}

/// The cloud of a recording that this thread decoded last, in words: its topic, number and place.
/// `None` if it decoded none.
pub fn last_decoded_cloud() -> Option<String> {
    let (topic, number, position) = LAST.try_with(|last| last.borrow().clone()).ok()??;
    Some(format!("frame {number} of {topic}, {}", describe_position(position)))
}
