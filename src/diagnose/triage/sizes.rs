//! Instances that do not look like one object of their class: too large, of two masses, or of very
//! few pixels.

use super::between::between;
use super::facts::{FrameFacts, InstanceFacts};
use super::parts::{ComponentBox, best_split, components};
use super::suspect::{Suspect, SuspectKind, ramp};
use crate::text::counted;
use divmerge_core::cloud::taxonomy::ClassSize;

/// Instances longer or wider than objects of their class.
///
/// Fires above the slack of preset `best` (1.2 times the usual length) and above the width of two
/// objects side by side (1.5 times the usual width); full at 1.5 times these bounds.
pub(super) fn too_large(facts: &FrameFacts) -> Vec<Suspect> {
    facts.members.iter().filter_map(|member| too_large_at(facts, member)).collect()
}

fn too_large_at(facts: &FrameFacts, member: &InstanceFacts) -> Option<Suspect> {
    const FULL: f64 = 1.5;
    let usual = member.size?;
    let [length, width, _] = member.instance.bounds.size;
    let most = [facts.by_size.slack * usual.length, facts.by_size.widest(usual)];
    let side = usize::from(width / most[1] > length / most[0]);
    let (measured, bound) = ([length, width][side], most[side]);
    let evidence = ramp(measured / bound, 1.0, FULL);
    (evidence > 0.0).then(|| Suspect {
        points: ends(facts, member),
        measured,
        bound,
        unit: "m",
        sentence: format!(
            "{} is {measured:.1} m {}; objects of its class stay below {bound:.1} m",
            member.instance.title(),
            ["long", "wide"][side],
        ),
        ..facts.suspect(SuspectKind::TooLarge, evidence, member)
    })
}

/// A point at either end of an instance.
fn ends(facts: &FrameFacts, member: &InstanceFacts) -> Vec<usize> {
    let bounds = &member.instance.bounds;
    let (sin, cos) = bounds.yaw.sin_cos();
    let half = bounds.size[0] / 2.0;
    let [x, y, _] = bounds.centre;
    let end = |sign: f64| [x + sign * half * cos, y + sign * half * sin];
    let nearest = |sign: f64| facts.nearest_to(&member.objects, end(sign));
    let ends = [1.0, -1.0].into_iter().filter_map(nearest);
    let mut points: Vec<usize> = ends.map(|object| facts.point(object)).collect();
    points.dedup();
    points
}

/// Instances of two masses with a gap between them.
///
/// The local components of an instance are linked by the gaps between the boxes around them, the
/// shortest first (a minimum spanning tree). The link with the most [`gap_evidence`] counts.
pub(super) fn two_masses(facts: &FrameFacts) -> Vec<Suspect> {
    let suspect = |(member, parts): (_, &Vec<ComponentBox>)| two_masses_at(facts, member, parts);
    facts.members.iter().zip(&components(facts)).filter_map(suspect).collect()
}

fn two_masses_at(
    facts: &FrameFacts,
    member: &InstanceFacts,
    parts: &[ComponentBox],
) -> Option<Suspect> {
    let usual = member.size?;
    let touching = facts.by_size.touching_gap(usual);
    let [_, width, _] = member.instance.bounds.size;
    let split = best_split(parts, |gap, share| gap_evidence(touching, usual, gap, share, width))?;
    if split.weight == 0.0 {
        return None;
    }
    let evidence = split.weight * between(facts, &split.sides[0], &split.sides[1]).unexplained();
    Some(Suspect {
        points: facts.facing(&split.sides[0], &split.sides[1]),
        measured: split.gap,
        bound: touching,
        unit: "m",
        sentence: format!(
            "{} consists of two masses of {} and {}, {:.2} m apart; pieces of its class touch up \
             to {touching:.2} m",
            member.instance.title(),
            split.sides[0].len(),
            counted(split.sides[1].len(), "pixel"),
            split.gap,
        ),
        ..facts.suspect(SuspectKind::TwoMasses, evidence, member)
    })
}

/// The evidence of a gap within an instance, given the share of the pixels on its smaller side and
/// the width of the whole, metres.
///
/// It grows with the gap, from the distance of touching to half the width of the class, about the
/// space between two parked cars. It grows with the share, up to one half, because evaluation takes
/// the larger mass for the object as long as it outweighs the other. It grows with the width, from
/// a third to all of it for a whole that is a fifth wider than usual: vehicles of a class differ in
/// length, hardly in width.
pub(super) fn gap_evidence(
    touching: f64,
    usual: ClassSize,
    gap: f64,
    share: f64,
    width: f64,
) -> f64 {
    let by_width = (1.0 + 2.0 * ramp(width / usual.width, 0.9, 1.2)) / 3.0;
    ramp(gap, touching, usual.width / 2.0) * ramp(share, 0.0, 0.5) * by_width
}

/// Instances of few pixels: their outline says little, and many are splinters.
///
/// Fires below ten pixels, the limit of a leftover in preset `best` without classes; full at none.
pub(super) fn leftovers(facts: &FrameFacts) -> Vec<Suspect> {
    const ENOUGH: f64 = 10.0;
    let few = facts.members.iter().filter(|member| (member.objects.len() as f64) < ENOUGH);
    let suspect = |member: &InstanceFacts| {
        let pixels = member.objects.len();
        Suspect {
            points: member.objects.iter().take(1).map(|&object| facts.point(object)).collect(),
            measured: pixels as f64,
            bound: ENOUGH,
            unit: "pixels",
            sentence: format!(
                "{} is a leftover of {}",
                member.instance.title(),
                counted(pixels, "pixel")
            ),
            ..facts.suspect(SuspectKind::Leftover, ramp(pixels as f64, ENOUGH, 0.0), member)
        }
    };
    few.map(suspect).collect()
}
