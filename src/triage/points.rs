//! Points that say that something is wrong: of other classes, without an instance, or missing.

use super::facts::{Facts, Member};
use super::{Kind, Suspect, ramp};
use crate::disjoint_sets::DisjointSets;
use crate::instances::Reason;

/// Instances of pixels of several classes, those included whose class was corrected.
///
/// Full where the others are as many as its own class's.
pub(super) fn mixed_classes(facts: &Facts) -> Vec<Suspect> {
    let mask = &facts.frame.stages.mask;
    let is_corrected = |point: usize| {
        mask.corrected.binary_search_by_key(&(point as u32), |&(point, _)| point).is_ok()
    };
    let classes = &facts.frame.stages.objects.class;
    let found = facts.members.iter().filter_map(|member| {
        let is_other = |&&object: &&u32| {
            classes[object as usize] != member.class || is_corrected(facts.point(object))
        };
        let others: Vec<u32> = member.objects.iter().filter(is_other).copied().collect();
        let share = others.len() as f64 / member.objects.len().max(1) as f64;
        let first = others.first()?;
        Some(Suspect {
            kind: Kind::MixedClasses,
            evidence: ramp(share, 0.0, 0.5),
            score: 0.0,
            extra: vec![],
            instances: vec![member.instance.id],
            points: vec![facts.point(*first)],
            position: member.instance.bounds.centre,
            measured: share,
            bound: 0.5,
            unit: "of its pixels",
            sentence: format!(
                "{:.0} % of the pixels of {} were given another class, or had theirs corrected",
                100.0 * share,
                member.instance.title()
            ),
        })
    });
    found.collect()
}

/// Object points without an instance that lie together: unreached, shadowed without a match, or too small.
pub(super) fn unlabelled(facts: &Facts) -> Vec<Suspect> {
    let (cloud, stages) = (facts.frame.cloud, facts.frame.stages);
    let is_lost = |reason| matches!(reason, Reason::Unreached | Reason::Shadowed | Reason::TooSmall);
    let lost = stages.objects.points.iter().copied();
    let lost: Vec<u32> = lost.filter(|&p| is_lost(stages.labels.reason[p as usize])).collect();
    clumps(&lost, |point| cloud.position(point as usize)).iter().map(|clump| lost_clump(facts, clump)).collect()
}

/// A metre: points in one cell of a grid of that side, or in neighbouring ones, lie together.
const CLUMP: f32 = 1.0;

/// Points that lie together.
fn clumps(points: &[u32], position: impl Fn(u32) -> [f32; 3]) -> Vec<Vec<u32>> {
    let cell = |point: u32| {
        let [x, y, _] = position(point);
        [(x / CLUMP).floor() as i32, (y / CLUMP).floor() as i32]
    };
    let mut cells: Vec<([i32; 2], u32)> = points.iter().map(|&point| (cell(point), point)).collect();
    cells.sort_unstable();
    let first = |place: [i32; 2]| {
        let at = cells.partition_point(|other| other.0 < place);
        cells.get(at).filter(|other| other.0 == place).map(|_| at)
    };
    let mut sets = DisjointSets::new(cells.len());
    for (number, (place, _)) in cells.iter().enumerate() {
        for (x, y) in [(0, 0), (0, 1), (1, -1), (1, 0), (1, 1)] {
            if let Some(other) = first([place[0] + x, place[1] + y]) {
                sets.join(number, other);
            }
        }
    }
    let number = sets.numbered();
    let count = number.iter().copied().max().unwrap_or(0) as usize;
    let mut clumps = vec![Vec::new(); count];
    for (number, (_, point)) in number.iter().zip(&cells) {
        clumps[*number as usize - 1].push(*point);
    }
    clumps
}

fn lost_clump(facts: &Facts, clump: &[u32]) -> Suspect {
    let (cloud, stages) = (facts.frame.cloud, facts.frame.stages);
    let sum = clump.iter().fold([0.0; 3], |sum, &point| {
        let place = cloud.position(point as usize).map(f64::from);
        [sum[0] + place[0], sum[1] + place[1], sum[2] + place[2]]
    });
    let position = sum.map(|sum| sum / clump.len() as f64);
    let reason = stages.labels.reason[clump[0] as usize];
    let beside = nearest_member(facts, clump[0], position);
    let measured = clump.len() as f64;
    Suspect {
        kind: Kind::Unlabelled,
        evidence: ramp(measured, 0.0, 50.0),
        score: 0.0,
        extra: vec![],
        instances: beside.map(|member| member.instance.id).into_iter().collect(),
        points: vec![clump[0] as usize],
        position,
        measured,
        bound: 0.0,
        unit: "points",
        sentence: format!(
            "{} object points lie here without an instance ({})",
            clump.len(),
            reason.describe()
        ),
    }
}

/// The nearest instance of a point's family, if it is no farther away than its class is long.
fn nearest_member<'a>(facts: &'a Facts, point: u32, [x, y, _]: [f64; 3]) -> Option<&'a Member<'a>> {
    let mask = &facts.frame.stages.mask;
    let family = mask.families[usize::from(mask.class[point as usize])];
    let away = |member: &Member| crate::footprint::distance(&member.hull, &[[x, y]]);
    let near = facts.members.iter().filter(|member| member.family == family);
    let near = near.filter(|member| member.size.is_some_and(|size| away(member) <= size.length));
    near.min_by(|a, b| away(a).total_cmp(&away(b)))
}

/// Instances among whose pixels many beams came back with nothing, as on black cars.
///
/// In each row between its first and its last pixel; the share of such beams among its own and those, less
/// what the whole image has. Full at a half.
pub(super) fn missing_returns(facts: &Facts) -> Vec<Suspect> {
    let image = &facts.frame.stages.image;
    let columns = image.columns();
    let pixel = &facts.frame.stages.objects.pixel;
    let usual = usual_missing(facts);
    let found = facts.members.iter().filter_map(|member| {
        let (mut empty, mut own) = (0_usize, 0_usize);
        let row = |object: &u32| pixel[*object as usize] as usize / columns;
        for in_row in member.objects.chunk_by(|a, b| row(a) == row(b)) {
            own += in_row.len();
            let ends = [in_row[0], in_row[in_row.len() - 1]].map(|o| pixel[o as usize] as usize);
            if ends[1] - ends[0] < columns / 2 {
                empty += (ends[0]..ends[1]).filter(|&p| image.point_at(p).is_none()).count();
            }
        }
        let share = empty as f64 / (empty + own).max(1) as f64;
        let evidence = ramp(share, usual, usual + 0.5) * ramp((empty + own) as f64, 0.0, 50.0);
        (evidence > 0.0).then(|| Suspect {
            kind: Kind::MissingReturns,
            evidence,
            score: 0.0,
            extra: vec![],
            instances: vec![member.instance.id],
            points: vec![facts.point(member.objects[0])],
            position: member.instance.bounds.centre,
            measured: share,
            bound: usual,
            unit: "of the beams",
            sentence: format!(
                "{:.0} % of the beams between the pixels of {} came back with nothing ({:.0} % elsewhere)",
                100.0 * share,
                member.instance.title(),
                100.0 * usual
            ),
        })
    });
    found.collect()
}

/// Share of pixels without a return among those between two returns of their row no more than 10 columns
/// apart.
fn usual_missing(facts: &Facts) -> f64 {
    const NEAR: usize = 10;
    let image = &facts.frame.stages.image;
    let (mut empty, mut seen, mut open) = (0_usize, 0_usize, 0_usize);
    for row in 0..image.rows() {
        for column in 0..image.columns() {
            if image.point_at(row * image.columns() + column).is_none() {
                open += 1;
                continue;
            }
            seen += 1;
            empty += if open < NEAR { open } else { 0 };
            open = 0;
        }
        open = 0;
    }
    empty as f64 / (empty + seen).max(1) as f64
}
