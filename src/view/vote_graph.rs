//! The vote graph: components on the bird's-eye plane, an edge for each pair that touches.

use super::canvas::{Canvas, Stroke, opaque};
use super::plane::Plane;
use super::scene::Scene;
use super::theme;
use crate::cluster::Vote;

/// Share of votes about the threshold within which a decision counts as thin.
pub const THIN: f64 = 0.1;

/// What became of a pair of components that touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// One instance by the votes.
    Merged,
    /// Kept apart by the votes, one instance in the end.
    Rejoined,
    /// Two instances.
    Apart,
}

/// Decisions of a frame, counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Decisions {
    /// Pairs that the votes merged.
    pub merged: usize,
    /// Pairs that were rejoined after the votes.
    pub rejoined: usize,
    /// Pairs that stayed apart.
    pub apart: usize,
    /// Pairs of any kind whose votes were close to the threshold.
    pub thin: usize,
}

/// What became of a pair, given the final instance of each component.
pub fn decision(scene: &Scene, last: &[u32], vote: &Vote) -> Decision {
    let same = |instance: &[u32]| instance[vote.a as usize - 1] == instance[vote.b as usize - 1];
    if same(&scene.stages.merge.instance_of_component) {
        Decision::Merged
    } else if same(last) && last[vote.a as usize - 1] != 0 {
        Decision::Rejoined
    } else {
        Decision::Apart
    }
}

/// Whether the pair's own votes were close to the threshold.
pub fn is_thin(scene: &Scene, vote: &Vote) -> bool {
    let total = f64::from(vote.positive) + f64::from(vote.negative);
    (f64::from(vote.positive) - scene.merge_ratio * total).abs() <= THIN * total
}

/// Counts all decisions.
pub fn decisions(scene: &Scene) -> Decisions {
    let last = scene.instance_of_component();
    let mut decisions = Decisions::default();
    for vote in &scene.stages.votes.pairs {
        match decision(scene, &last, vote) {
            Decision::Merged => decisions.merged += 1,
            Decision::Rejoined => decisions.rejoined += 1,
            Decision::Apart => decisions.apart += 1,
        }
        decisions.thin += usize::from(is_thin(scene, vote));
    }
    decisions
}

/// Centre and size of each component on the plane, component k at k - 1: the mean of its pixels, and how
/// many they are.
pub fn centres(scene: &Scene) -> Vec<([f64; 2], usize)> {
    let stages = scene.stages;
    let mut centres = vec![([0.0; 2], 0); stages.components.count as usize];
    for (&label, &[x, y, _]) in stages.components.label.iter().zip(&stages.objects.position) {
        if label != 0 {
            let (sum, count) = &mut centres[label as usize - 1];
            *sum = [sum[0] + f64::from(x), sum[1] + f64::from(y)];
            *count += 1;
        }
    }
    for (centre, count) in &mut centres {
        *centre = centre.map(|sum| sum / (*count).max(1) as f64);
    }
    centres
}

/// Width of an edge with so many votes; `scale` 1 for a plane of some 50 m.
pub fn edge_width(votes: u32, scale: f64) -> f64 {
    (0.45 + 0.25 * f64::from(votes).sqrt()).min(4.0) * scale
}

/// The edge of a pair.
pub fn edge(scene: &Scene, vote: &Vote, decision: Decision, scale: f64) -> Stroke {
    let width = edge_width(vote.positive + vote.negative, scale);
    let colour = match decision {
        Decision::Merged => theme::MERGED,
        Decision::Rejoined => theme::REJOINED,
        Decision::Apart => theme::APART,
    };
    let dash = is_thin(scene, vote).then_some([2.5 + width, 1.5 + width]);
    Stroke { colour, width, dash }
}

/// Draws edges and nodes, pairs that stayed apart over the others.
pub fn draw(canvas: &mut Canvas, plane: &Plane, scene: &Scene) {
    let centres = centres(scene);
    let instance = scene.instance_of_component();
    let is_seen = |label: u32| plane.shows(centres[label as usize - 1].0);
    // Thinner where there are many.
    let seen = scene.stages.votes.pairs.iter().filter(|vote| is_seen(vote.a) || is_seen(vote.b));
    let crowd = (500.0 / seen.count().max(1) as f64).sqrt().clamp(0.5, 1.0);
    let scale = (plane.scale / 12.0).clamp(0.6, 1.6) * crowd;
    canvas.clipped(plane.area, |canvas| {
        for wanted in [Decision::Rejoined, Decision::Merged, Decision::Apart] {
            for vote in &scene.stages.votes.pairs {
                let decision = decision(scene, &instance, vote);
                if decision == wanted && (is_seen(vote.a) || is_seen(vote.b)) {
                    let [from, to] =
                        [vote.a, vote.b].map(|k| plane.to_page(centres[k as usize - 1].0));
                    let mut stroke = edge(scene, vote, decision, scale);
                    if decision == Decision::Apart {
                        stroke.colour[3] = (255.0 * crowd.max(0.7)) as u8;
                    }
                    canvas.line(from, to, stroke);
                }
            }
        }
        for (&(centre, count), &instance) in centres.iter().zip(&instance) {
            if count == 0 || !plane.shows(centre) {
                continue;
            }
            let radius = (1.0 + (count as f64).sqrt() * 0.12).min(3.5) * scale;
            let rim = Stroke::solid(opaque(theme::PANEL), 0.6 * scale);
            let colour = opaque(scene.colour(instance));
            canvas.circle(plane.to_page(centre), radius, Some(colour), Some(rim));
        }
    });
}
