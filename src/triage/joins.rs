//! Joins of pieces by size or by gaps that only just came about (preset `best`).

use super::facts::Facts;
use super::{Kind, Suspect, ramp};
use crate::cluster::{Evidence, Join};
use crate::disjoint_sets::DisjointSets;

/// Joins that bridged a wide gap or filled the size of their class, between two substantial parts.
pub(super) fn thin_joins(facts: &Facts) -> Vec<Suspect> {
    let stages = facts.frame.stages;
    let pieces = stages.merge.count as usize;
    let mut objects: Vec<Vec<u32>> = vec![Vec::new(); pieces];
    for object in 0..stages.objects.len() {
        if let Some(piece) = (stages.merged_instance(object) as usize).checked_sub(1) {
            objects[piece].push(object as u32);
        }
    }
    let mut sets = DisjointSets::new(pieces);
    let mut thinnest: Vec<Option<Suspect>> = vec![None; facts.members.len()];
    for join in &stages.joins {
        let [a, b] = [join.target, join.query].map(|piece| sets.root(piece as usize - 1));
        if a == b {
            continue;
        }
        let id = facts.instance_of_piece[a];
        if let Some(suspect) = thin(facts, join, id, [&objects[a], &objects[b]]) {
            let place = &mut thinnest[id as usize - 1];
            if place.as_ref().is_none_or(|other| other.evidence < suspect.evidence) {
                *place = Some(suspect);
            }
        }
        let joined = std::mem::take(&mut objects[a.max(b)]);
        objects[a.min(b)].extend(joined);
        sets.join(a, b);
    }
    thinnest.into_iter().flatten().collect()
}

fn thin(facts: &Facts, join: &Join, id: u32, sides: [&Vec<u32>; 2]) -> Option<Suspect> {
    let member = facts.member(id)?;
    let Evidence::Fits { union, limit } = join.evidence else {
        return None;
    };
    let usual = member.size?;
    let share = sides[0].len().min(sides[1].len()) as f64 / member.objects.len() as f64;
    let fill = (union[0] / limit[0]).max(union[1] / limit[1]);
    let (touching, bridged) = (facts.by_size.touching_gap(usual), facts.by_size.bridged_gap(usual));
    let wide = ramp(join.gap, touching, bridged);
    let evidence = wide.max(ramp(fill, 0.8, 1.0)) * ramp(share, 0.0, 1.0 / 3.0);
    let seen = super::between::between(facts, sides[0], sides[1]);
    (evidence > 0.0).then(|| Suspect {
        kind: Kind::ThinJoin,
        evidence,
        score: 0.0,
        extra: vec![join.gap / usual.width, share, seen.through, seen.hidden, seen.missing, union[0]/usual.length, union[1]/usual.width],
        instances: vec![id],
        points: facts.facing(sides[0], sides[1]),
        position: member.instance.bounds.centre,
        measured: fill,
        bound: 1.0,
        unit: "of the accepted size",
        sentence: format!(
            "{} was put together across {:.2} m to {:.1} x {:.1} m, where {:.1} x {:.1} m were accepted",
            member.instance.title(),
            join.gap,
            union[0],
            union[1],
            limit[0],
            limit[1]
        ),
    })
}
