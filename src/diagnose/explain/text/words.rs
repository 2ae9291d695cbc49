//! Phrases that several parts of the text use.

use crate::diagnose::explain::{BorderPair, Place, PointFacts, Rule};
pub(super) use crate::text::counted;
use divmerge_core::cloud::Reason;

/// What the two points are called.
pub(super) const NAMES: [&str; 2] = ["A", "B"];

pub(super) fn pixel(place: Place) -> String {
    format!("row {} column {}", place.row, place.column)
}

pub(super) fn position([x, y, z]: [f32; 3]) -> String {
    format!("{x:.3},{y:.3},{z:.3}")
}

/// A point's instance.
pub(super) fn instance(point: &PointFacts) -> String {
    match (point.instance, point.instance_class.as_str()) {
        (0, _) => format!("no instance ({})", point.reason.describe()),
        (id, "") => format!("instance {id}"),
        (id, class) => format!("instance {id} ({class})"),
    }
}

/// Why points have no instance.
pub(super) fn without_instance(points: &[PointFacts]) -> String {
    let without = points.iter().zip(NAMES).filter(|(point, _)| point.reason != Reason::None);
    let each = without
        .map(|(point, name)| format!("{name} has no instance ({})", point.reason.describe()));
    each.collect::<Vec<_>>().join(" and ")
}

/// How the condition of a pair of pixels was decided.
pub(super) fn condition(pair: &BorderPair) -> String {
    let vote = if pair.holds { "in favour" } else { "against" };
    let (beta, apart) = (pair.beta_degrees, pair.distance);
    match pair.rule {
        Rule::Angle => format!("{apart:.2} m apart, beta {beta:.1} degrees: {vote}"),
        Rule::Gate => {
            format!("{apart:.2} m apart, beta {beta:.1} degrees, decided by distance: {vote}")
        }
        Rule::Nearness { distance, reach } => format!(
            "{distance:.2} m apart on the bird's-eye plane, limit {reach:.2} m: {vote} (beta \
             {beta:.1} degrees, not used)"
        ),
    }
}
