//! Points that are signs of failure: of other classes, without an instance, or missing.

use super::facts::{FrameFacts, InstanceFacts};
use super::suspect::{Concern, Suspect, SuspectKind, ramp};
use crate::text::counted;
use divmerge_core::cloud::Reason;
use divmerge_core::geometry::disjoint_sets::DisjointSets;
use divmerge_core::geometry::footprint::distance;

/// Instances with pixels of other classes than their own, or of corrected classes; full if these
/// are half of the pixels.
pub(super) fn mixed_classes(facts: &FrameFacts) -> Vec<Suspect> {
    facts.members.iter().filter_map(|member| mixed_classes_at(facts, member)).collect()
}

fn mixed_classes_at(facts: &FrameFacts, member: &InstanceFacts) -> Option<Suspect> {
    let corrected = &facts.frame.stages.mask.corrected;
    let is_corrected =
        |point: usize| corrected.binary_search_by_key(&(point as u32), |fix| fix.0).is_ok();
    let classes = &facts.frame.stages.objects.class;
    let is_other = |&&object: &&u32| {
        classes[object as usize] != member.class || is_corrected(facts.point(object))
    };
    let others: Vec<u32> = member.objects.iter().filter(is_other).copied().collect();
    let measured = others.len() as f64 / member.objects.len().max(1) as f64;
    let first = *others.first()?;
    Some(Suspect {
        points: vec![facts.point(first)],
        measured,
        bound: 0.5,
        unit: "of its pixels",
        sentence: format!(
            "{:.0} % of the pixels of {} were of another class",
            100.0 * measured,
            member.instance.title()
        ),
        ..facts.suspect(SuspectKind::MixedClasses, ramp(measured, 0.0, 0.5), member)
    })
}

/// Object points without an instance that lie together: unreached, shadowed without a match, or too
/// small. They put the nearest instance of their class in doubt; full if they are as many as its
/// points.
pub(super) fn unlabelled(facts: &FrameFacts) -> Vec<Suspect> {
    let (cloud, stages) = (facts.frame.cloud, facts.frame.stages);
    let is_lost =
        |reason| matches!(reason, Reason::Unreached | Reason::Shadowed | Reason::TooSmall);
    let lost = stages.objects.points.iter().copied();
    let lost: Vec<u32> = lost.filter(|&p| is_lost(stages.labels.reason[p as usize])).collect();
    let clumps = clumps(&lost, |point| cloud.position(point as usize));
    clumps.iter().map(|clump| unlabelled_at(facts, clump)).collect()
}

/// Points lie together if they are in one cell of a grid of this side, metres, or in cells that
/// touch.
const CELL: f32 = 1.0;

/// Points that lie together on the bird's-eye plane, each list ascending. All points beyond the
/// last cell of a direction are in that cell.
fn clumps(points: &[u32], position: impl Fn(u32) -> [f32; 3]) -> Vec<Vec<u32>> {
    let cell = |point: u32| {
        let [x, y, _] = position(point);
        [(x / CELL).floor() as i32, (y / CELL).floor() as i32]
    };
    let mut sites: Vec<([i32; 2], u32)> = points.iter().map(|&p| (cell(p), p)).collect();
    sites.sort_unstable();
    let first_in = |place: [i32; 2]| {
        let at = sites.partition_point(|site| site.0 < place);
        sites.get(at).filter(|site| site.0 == place).map(|_| at)
    };
    let mut sets = DisjointSets::new(sites.len());
    for (number, ([x, y], _)) in sites.iter().enumerate() {
        for (right, up) in [(0, 0), (0, 1), (1, -1), (1, 0), (1, 1)] {
            if let Some(other) = first_in([x.saturating_add(right), y.saturating_add(up)]) {
                sets.join(number, other);
            }
        }
    }
    let number = sets.numbered();
    let mut clumps = vec![Vec::new(); number.iter().copied().max().unwrap_or(0) as usize];
    for (number, (_, point)) in number.iter().zip(&sites) {
        clumps[*number as usize - 1].push(*point);
    }
    clumps
}

fn unlabelled_at(facts: &FrameFacts, clump: &[u32]) -> Suspect {
    let (cloud, stages) = (facts.frame.cloud, facts.frame.stages);
    let places = clump.iter().map(|&point| cloud.position(point as usize).map(f64::from));
    let sum = places.fold([0.0; 3], |sum, place| [0, 1, 2].map(|axis| sum[axis] + place[axis]));
    let position = sum.map(|sum| sum / clump.len() as f64);
    let beside = nearest_member(facts, clump[0], position);
    let all = |member: &InstanceFacts| clump.len() as f64 + f64::from(member.instance.points);
    let measured = beside.map_or(1.0, |member| clump.len() as f64 / all(member));
    let evidence = ramp(measured, 0.0, 0.5);
    let reason = stages.labels.reason[clump[0] as usize];
    Suspect {
        kind: SuspectKind::Unlabelled,
        score: facts.score(SuspectKind::Unlabelled, evidence, clump.len() as f64),
        evidence,
        concerns: beside.iter().map(|member| Concern::whole(member.instance.id)).collect(),
        points: vec![clump[0] as usize],
        position,
        measured,
        bound: 0.5,
        unit: "of the points here",
        sentence: format!(
            "{} of objects without an instance ({}){}",
            counted(clump.len(), "point"),
            reason.describe(),
            beside.map_or(String::new(), |member| format!(" beside {}", member.instance.title()))
        ),
    }
}

/// The nearest instance of a point's family, if it is no farther away than the width of its class.
fn nearest_member<'a>(
    facts: &'a FrameFacts,
    point: u32,
    [x, y, _]: [f64; 3],
) -> Option<&'a InstanceFacts<'a>> {
    let mask = &facts.frame.stages.mask;
    let family = mask.families[usize::from(mask.class[point as usize])];
    let away = |member: &InstanceFacts| distance(&member.hull, &[[x, y]]);
    let near = facts.members.iter().filter(|member| member.family == family);
    let near = near.filter(|member| member.size.is_some_and(|size| away(member) <= size.width));
    near.min_by(|a, b| away(a).total_cmp(&away(b)))
}

/// Instances among whose pixels many beams came back with nothing, as on black cars.
///
/// The figure is the share of such beams between the first and the last pixel of the instance in
/// each row. Fires above the share of the whole image; full at that share plus a half.
pub(super) fn missing_returns(facts: &FrameFacts) -> Vec<Suspect> {
    let usual = usual_missing(facts);
    facts.members.iter().filter_map(|member| missing_returns_at(facts, member, usual)).collect()
}

fn missing_returns_at(facts: &FrameFacts, member: &InstanceFacts, usual: f64) -> Option<Suspect> {
    let image = &facts.frame.stages.image;
    let columns = image.columns();
    let pixel = |object: u32| facts.frame.stages.objects.pixel[object as usize] as usize;
    let in_rows = member.objects.chunk_by(|&a, &b| pixel(a) / columns == pixel(b) / columns);
    let empty: usize = in_rows
        .map(|row| pixel(row[0])..pixel(row[row.len() - 1]))
        // A row on both sides of the image's seam would span all columns.
        .filter(|span| span.len() < columns / 2)
        .map(|mut span| span.by_ref().filter(|&pixel| image.point_at(pixel).is_none()).count())
        .sum();
    let measured = empty as f64 / (empty + member.objects.len()) as f64;
    let evidence = ramp(measured, usual, usual + 0.5);
    (evidence > 0.0).then(|| Suspect {
        points: vec![facts.point(member.objects[0])],
        measured,
        bound: usual,
        unit: "of the beams",
        sentence: format!(
            "{:.0} % of the beams between the pixels of {} came back with nothing; \
             {:.0} % of all beams did",
            100.0 * measured,
            member.instance.title(),
            100.0 * usual
        ),
        ..facts.suspect(SuspectKind::MissingReturns, evidence, member)
    })
}

/// Share of the pixels without a return among all pixels between returns of one row at most ten
/// columns apart: the sky is not missing.
fn usual_missing(facts: &FrameFacts) -> f64 {
    const NEAR: usize = 10;
    let image = &facts.frame.stages.image;
    let (mut empty, mut seen) = (0_usize, 0_usize);
    for row in 0..image.rows() {
        let pixels = row * image.columns()..(row + 1) * image.columns();
        let mut last = None;
        for pixel in pixels.filter(|&pixel| image.point_at(pixel).is_some()) {
            let open = last.map_or(0, |last| pixel - last - 1);
            empty += if open < NEAR { open } else { 0 };
            seen += 1;
            last = Some(pixel);
        }
    }
    empty as f64 / (empty + seen).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_beyond_the_last_cell_lie_together() {
        let places = [[3e38, 3e38, 0.0], [-3e38, -3e38, 0.0], [0.5, 0.5, 0.0], [1e38, 2e38, 0.0]];
        let mut found = clumps(&[0, 1, 2, 3], |point| places[point as usize]);
        found.sort();
        assert_eq!(found, [vec![0, 3], vec![1], vec![2]]);
    }
}
