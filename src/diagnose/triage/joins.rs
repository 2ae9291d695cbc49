//! Joins of pieces by size that only just came about (preset `best`).

use super::between::between;
use super::facts::{FrameFacts, InstanceFacts};
use super::sizes::gap_evidence;
use super::suspect::{Suspect, SuspectKind};
use divmerge_core::cluster::{Evidence, Join};
use divmerge_core::geometry::disjoint_sets::DisjointSets;

/// Joins of two substantial parts across a gap, by their [`gap_evidence`].
pub(super) fn thin_joins(facts: &FrameFacts) -> Vec<Suspect> {
    let stages = facts.frame.stages;
    let pieces = stages.merge.count as usize;
    let mut objects: Vec<Vec<u32>> = vec![Vec::new(); pieces];
    for object in 0..stages.objects.len() {
        if let Some(piece) = (stages.merged_instance(object) as usize).checked_sub(1) {
            objects[piece].push(object as u32);
        }
    }
    let mut sets = DisjointSets::new(pieces);
    let mut suspects = Vec::new();
    for join in &stages.post_merge.joins {
        let [a, b] = [join.target, join.query].map(|piece| sets.root(piece as usize - 1));
        if a == b {
            continue;
        }
        if let Some(member) = facts.member(facts.instance_of_piece[a]) {
            suspects.extend(thin_join(facts, join, member, [&objects[a], &objects[b]]));
        }
        let joined = std::mem::take(&mut objects[a.max(b)]);
        objects[a.min(b)].extend(joined);
        sets.join(a, b);
    }
    suspects
}

fn thin_join(
    facts: &FrameFacts,
    join: &Join,
    member: &InstanceFacts,
    sides: [&Vec<u32>; 2],
) -> Option<Suspect> {
    let share = sides[0].len().min(sides[1].len()) as f64 / member.objects.len() as f64;
    let (evidence, bound, how) = match (join.evidence, member.size) {
        (Evidence::Fits { union, limit }, Some(usual)) => {
            let touching = facts.by_size.touching_gap(usual);
            let how = format!(
                "to {:.1} x {:.1} m, where up to {:.1} x {:.1} m were accepted",
                union[0], union[1], limit[0], limit[1]
            );
            (gap_evidence(touching, usual, join.gap, share, union[1]), touching, how)
        }
        _ => return None,
    };
    if evidence == 0.0 {
        return None;
    }
    let unexplained = between(facts, sides[0], sides[1]).unexplained();
    Some(Suspect {
        points: facts.facing(sides[0], sides[1]),
        measured: join.gap,
        bound,
        unit: "m",
        sentence: format!(
            "{} was put together across {:.2} m {how}",
            member.instance.title(),
            join.gap
        ),
        ..facts.suspect(SuspectKind::ThinJoin, evidence * unexplained, member)
    })
}
