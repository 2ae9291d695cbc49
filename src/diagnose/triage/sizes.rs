//! Instances that do not look like one object of their class: too large, of two masses, of hardly a
//! pixel.

use super::between::between;
use super::facts::{FrameFacts, InstanceFacts};
use super::hint::{Hint, ramp};
use super::parts::{ComponentBox, best_split, components};
use super::suspect::SuspectKind;
use crate::taxonomy::ClassSize;
use crate::text::counted;

/// Instances longer or wider than objects of their class come.
///
/// Fires from the slack on that preset `best` grants (1.2 times the usual length) and from a width
/// on at which two stand side by side (1.5 times the usual width); full at half as much again.
pub(super) fn too_large(facts: &FrameFacts) -> Vec<Hint> {
    facts.members.iter().filter_map(|member| is_too_large(facts, member)).collect()
}

fn is_too_large(facts: &FrameFacts, member: &InstanceFacts) -> Option<Hint> {
    const FULL: f64 = 1.5;
    let usual = member.size?;
    let [length, width, _] = member.instance.bounds.size;
    let most = [facts.by_size.slack * usual.length, facts.by_size.widest(usual)];
    let side = usize::from(width / most[1] > length / most[0]);
    let (measured, bound) = ([length, width][side], most[side]);
    let evidence = ramp(measured / bound, 1.0, FULL);
    (evidence > 0.0).then(|| Hint {
        points: ends(facts, member),
        measured,
        bound,
        unit: "m",
        sentence: format!(
            "{} is {measured:.1} m {}; objects of its class stay below {bound:.1} m",
            member.instance.title(),
            ["long", "wide"][side],
        ),
        ..Hint::at(SuspectKind::TooLarge, evidence, member)
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
/// shortest first (a minimum spanning tree); the link counts that [`gap_evidence`] says most of.
pub(super) fn two_masses(facts: &FrameFacts) -> Vec<Hint> {
    let of_two_masses =
        |(member, parts): (_, &Vec<ComponentBox>)| is_two_masses(facts, member, parts);
    facts.members.iter().zip(&components(facts)).filter_map(of_two_masses).collect()
}

fn is_two_masses(
    facts: &FrameFacts,
    member: &InstanceFacts,
    parts: &[ComponentBox],
) -> Option<Hint> {
    let usual = member.size?;
    let touching = facts.by_size.touching_gap(usual);
    let [_, width, _] = member.instance.bounds.size;
    let split = best_split(parts, |gap, share| gap_evidence(touching, usual, gap, share, width))?;
    if split.weight == 0.0 {
        return None;
    }
    let evidence = split.weight * between(facts, &split.sides[0], &split.sides[1]).unexplained();
    Some(Hint {
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
        ..Hint::at(SuspectKind::TwoMasses, evidence, member)
    })
}

/// How much a gap within an instance says, given the share of the pixels on its smaller side and
/// the width of the whole in metres.
///
/// The gap: from that of touching to half the class's width, about what lies between two parked
/// cars. The share: up to one half, since evaluation takes the larger mass for the object as long
/// as it outweighs the other. The width: a third of it counts whatever the width, all where the
/// whole is a fifth wider than usual; vehicles of a class differ in length, hardly in width.
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

/// Instances of few pixels: their outline says next to nothing, and many are splinters.
///
/// Fires below the ten pixels that preset `best` takes for a leftover where there are no classes;
/// full without any.
pub(super) fn leftovers(facts: &FrameFacts) -> Vec<Hint> {
    const ENOUGH: f64 = 10.0;
    let few = facts.members.iter().filter(|member| (member.objects.len() as f64) < ENOUGH);
    let hint = |member: &InstanceFacts| {
        let pixels = member.objects.len();
        Hint {
            points: member.objects.iter().take(1).map(|&object| facts.point(object)).collect(),
            measured: pixels as f64,
            bound: ENOUGH,
            unit: "pixels",
            sentence: format!(
                "{} is a leftover of {}",
                member.instance.title(),
                counted(pixels, "pixel")
            ),
            ..Hint::at(SuspectKind::Leftover, ramp(pixels as f64, ENOUGH, 0.0), member)
        }
    };
    few.map(hint).collect()
}
