//! What the stages after the votes did.

use super::cut;
use super::words::{NAMES, counted, pixel};
use crate::diagnose::explain::{GroupFacts, PostMergeStage, SizeTest};
use divmerge_core::cluster::params::Region;
use divmerge_core::cluster::{Evidence, Join};

/// A stage, on one or more lines.
pub(super) fn text(stage: &PostMergeStage) -> String {
    match stage {
        PostMergeStage::BirdsEye { region: None, .. } => "Bird's-eye merge: off.".to_owned(),
        PostMergeStage::BirdsEye { classes_differ: true, .. } => {
            "Bird's-eye merge: only within a class, and theirs differ.".to_owned()
        }
        PostMergeStage::BirdsEye { joined, region: Some(region), margin, groups, gaps, .. } => {
            let region = region_name(*region);
            let outcome = if *joined { "joined them" } else { "left them apart" };
            let chain = chain(groups, gaps, *joined);
            format!("Bird's-eye merge ({region}, margin {margin} m): {outcome}.{chain}")
        }
        PostMergeStage::Fragments { joined: true, joins, .. } => {
            format!("Merge of fragments by size: joined them.{}", join_lines(joins))
        }
        PostMergeStage::Fragments { classes_differ: true, .. } => {
            "Merge of fragments by size: only within a class, and theirs differ.".to_owned()
        }
        PostMergeStage::Fragments { test: None, .. } => {
            "Merge of fragments by size: left them apart, the size of their class is unknown."
                .to_owned()
        }
        PostMergeStage::Fragments { test: Some(test), .. } => {
            format!("Merge of fragments by size: left them apart, {}.", size_test(test))
        }
        PostMergeStage::Cut(cut) => cut::text(cut),
        PostMergeStage::MinimumSize { point, pixels, minimum } => format!(
            "Minimum size: the instance of {} had {}, and the minimum is {minimum}.",
            NAMES[*point],
            counted(*pixels, "pixel")
        ),
        PostMergeStage::BackProjection { point, from, distance } => format!(
            "Back-projection: {} is hidden in its pixel and took the label of {}, {distance:.2} m \
             away.",
            NAMES[*point],
            pixel(*from)
        ),
    }
}

fn region_name(region: Region) -> &'static str {
    match region {
        Region::Box => "boxes",
        Region::Rectangle => "rectangles",
        Region::Hull => "hulls",
    }
}

/// The groups between two points. If the merge left them apart, the nearest two of their instances.
fn chain(groups: &[GroupFacts], gaps: &[f64], joined: bool) -> String {
    let [of_a, of_b] = if joined { ["", ""] } else { ["of A's instance, ", "of B's instance, "] };
    let group = |group: &GroupFacts, of: &str| {
        format!("group {} ({of}{})", group.number, counted(group.pixels, "pixel"))
    };
    let lines = groups.windows(2).zip(gaps).map(|(pair, gap)| {
        let (one, other) = (group(&pair[0], of_a), group(&pair[1], of_b));
        format!("\n  {one} and {other}: {gap:.2} m apart")
    });
    lines.collect()
}

fn join_lines(joins: &[Join]) -> String {
    joins.iter().map(join_line).collect()
}

fn join_line(join: &Join) -> String {
    let why = match join.evidence {
        Evidence::Touching => "touching".to_owned(),
        Evidence::Fits { union, limit } => format!(
            "together {}, which fits an object of their class (limit {})",
            sides(union),
            sides(limit)
        ),
    };
    let Join { query, target, gap, .. } = join;
    format!("\n  group {query} joined group {target}: {gap:.2} m apart, {why}")
}

fn size_test(test: &SizeTest) -> String {
    let (gap, union) = (test.gap, sides(test.union));
    if gap >= test.too_far {
        return format!(
            "{gap:.2} m apart; their class bridges gaps of less than {:.2} m",
            test.too_far
        );
    }
    if gap <= test.touching {
        return format!(
            "{gap:.2} m apart, which is touching, but the rectangle around both, {union}, is wider \
             than the {:.2} m of one object of their class: they lie side by side",
            test.widest
        );
    }
    format!(
        "{gap:.2} m apart (touching is up to {:.2} m), and the rectangle around both, {union}, is \
         larger than {} for their class",
        test.touching,
        sides(test.limit)
    )
}

fn sides([length, width]: [f64; 2]) -> String {
    format!("{length:.1} x {width:.1} m")
}
