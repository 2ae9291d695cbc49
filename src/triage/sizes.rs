//! Instances that do not look like one object of their class: too large, of two masses, with few pixels.

use super::facts::{Facts, Member};
use super::{Kind, Suspect, ramp};

/// Instances longer or wider than objects of their class come.
///
/// Fires from the slack on that preset `best` grants (1.2 times the usual length) and from a width on at which
/// two stand side by side (1.5 times the usual width); full at half as much again.
pub(super) fn too_large(facts: &Facts) -> Vec<Suspect> {
    facts.members.iter().filter_map(|member| is_too_large(facts, member)).collect()
}

fn is_too_large(facts: &Facts, member: &Member) -> Option<Suspect> {
    const FULL: f64 = 1.5;
    let usual = member.size?;
    let [length, width, _] = member.instance.bounds.size;
    let most = [facts.by_size.slack * usual.length, facts.by_size.widest(usual)];
    let excess = [length / most[0], width / most[1]];
    let side = usize::from(excess[1] > excess[0]);
    let evidence = ramp(excess[side], 1.0, FULL);
    let (measured, bound) = ([length, width][side], most[side]);
    (evidence > 0.0).then(|| Suspect {
        kind: Kind::TooLarge,
        evidence,
        score: 0.0,
        extra: vec![],
        instances: vec![member.instance.id],
        points: ends(facts, member),
        position: member.instance.bounds.centre,
        measured,
        bound,
        unit: "m",
        sentence: format!(
            "{} is {measured:.1} m {}, where objects of its class stay below {bound:.1} m",
            member.instance.title(),
            ["long", "wide"][side],
        ),
    })
}

/// A point at either end of an instance.
fn ends(facts: &Facts, member: &Member) -> Vec<usize> {
    let bounds = &member.instance.bounds;
    let (sin, cos) = bounds.yaw.sin_cos();
    let half = bounds.size[0] / 2.0;
    let [x, y, _] = bounds.centre;
    let end = |sign: f64| {
        facts.nearest_to(&member.objects, [x + sign * half * cos, y + sign * half * sin])
    };
    let found: Vec<usize> =
        [1.0, -1.0].into_iter().filter_map(end).map(|object| facts.point(object)).collect();
    if found.len() == 2 && found[0] == found[1] { vec![found[0]] } else { found }
}

/// Instances of two masses with a gap between them.
///
/// The local components of an instance are linked by the gaps between the boxes around them, the
/// shortest first (a minimum spanning tree); the link that parts the instance into the two most
/// equal halves for its length counts. Fires from a gap on at which pieces no longer count as
/// touching; full at the gap that is bridged at all, and between halves of which the smaller has a third.
pub(super) fn two_masses(facts: &Facts) -> Vec<Suspect> {
    let components = super::parts::components(facts);
    let found = facts.members.iter().zip(&components);
    found.filter_map(|(member, parts)| is_two_masses(facts, member, parts)).collect()
}

fn is_two_masses(
    facts: &Facts,
    member: &Member,
    parts: &[super::parts::Part],
) -> Option<Suspect> {
    let usual = member.size?;
    let (touching, bridged) =
        (facts.by_size.touching_gap(usual), facts.by_size.bridged_gap(usual));
    let cut = super::parts::widest_cut(parts, |gap, balance| {
        ramp(gap, touching, bridged) * ramp(balance, 0.0, 1.0 / 3.0)
    })?;
    let seen = super::between::between(facts, &cut.sides[0], &cut.sides[1]);
    let balance = cut.sides[1].len() as f64 / member.objects.len() as f64;
    (cut.weight > 0.0).then(|| Suspect {
        kind: Kind::TwoMasses,
        evidence: cut.weight,
        score: 0.0,
        extra: vec![cut.gap / usual.width, balance, seen.through, seen.hidden, seen.missing, member.instance.bounds.size[0]/usual.length, member.instance.bounds.size[1]/usual.width],
        instances: vec![member.instance.id],
        points: facts.facing(&cut.sides[0], &cut.sides[1]),
        position: member.instance.bounds.centre,
        measured: cut.gap,
        bound: touching,
        unit: "m",
        sentence: format!(
            "{} consists of two masses of {} and {} pixels, {:.2} m apart; pieces of its class touch up \
             to {touching:.2} m",
            member.instance.title(),
            cut.sides[0].len(),
            cut.sides[1].len(),
            cut.gap,
        ),
    })
}

/// Instances of few pixels: their outline says next to nothing, and as a rule they are splinters.
///
/// Fires below the pixels from which on evaluation counts a segment at all; full at one pixel.
pub(super) fn leftover(facts: &Facts) -> Vec<Suspect> {
    const ENOUGH: f64 = 10.0;
    let few = facts.members.iter().filter(|member| (member.objects.len() as f64) < ENOUGH);
    few.map(|member| {
        let pixels = member.objects.len();
        Suspect {
            kind: Kind::Leftover,
            evidence: ramp(pixels as f64, ENOUGH, 0.0),
            score: 0.0,
            extra: vec![],
            instances: vec![member.instance.id],
            points: member.objects.first().map(|&object| facts.point(object)).into_iter().collect(),
            position: member.instance.bounds.centre,
            measured: pixels as f64,
            bound: ENOUGH,
            unit: "pixels",
            sentence: format!(
                "{} is a leftover of {pixels} pixel{}",
                member.instance.title(),
                if pixels == 1 { "" } else { "s" }
            ),
        }
    })
    .collect()
}
