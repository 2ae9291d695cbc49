//! The vote graph: components on the bird's-eye plane, and an edge for each pair that touches.

use super::canvas::{Canvas, Stroke, opaque};
use super::plane::Plane;
use super::scene::{FrameScene, component_centroids, instance_of_component};
use divmerge_core::cluster::Vote;
use serde::Serialize;

/// Share of votes about the threshold within which a decision counts as thin.
const THIN: f64 = 0.1;
/// Most edges that are drawn: more cover each other.
pub const MOST_EDGES: usize = 800;

/// The outcome for a pair of components that touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// One instance by the votes.
    Merged,
    /// Kept apart by the votes, one instance in the end.
    Rejoined,
    /// Two instances.
    Apart,
}

/// The outcome for a pair, given the final instance of each component.
fn decision(scene: &FrameScene, last: &[u32], vote: &Vote) -> Decision {
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
pub fn is_thin(scene: &FrameScene, vote: &Vote) -> bool {
    let total = f64::from(vote.positive) + f64::from(vote.negative);
    (f64::from(vote.positive) - scene.merge_ratio * total).abs() <= THIN * total
}

/// The outcome of each pair.
pub fn decisions<'a>(scene: &FrameScene<'a>) -> Vec<(&'a Vote, Decision)> {
    let last = instance_of_component(scene.stages);
    let pairs = scene.stages.votes.pairs.iter();
    pairs.map(|vote| (vote, decision(scene, &last, vote))).collect()
}

/// A pair of components that touch, as an edge between their centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoteEdge {
    /// The components, the lower label first.
    pub components: [u32; 2],
    /// Their centres, metres.
    pub ends: [[f64; 3]; 2],
    /// V+ on their border.
    pub positive: u32,
    /// V- on their border.
    pub negative: u32,
    /// What became of the pair.
    pub decision: Decision,
    /// Whether the pair's own votes were close to the threshold.
    pub is_thin: bool,
}

/// The edges of the vote graph.
pub fn vote_edges(scene: &FrameScene) -> Vec<VoteEdge> {
    let centres = component_centroids(scene.stages);
    let of_pair = |(vote, decision): (&Vote, Decision)| VoteEdge {
        components: [vote.a, vote.b],
        ends: [vote.a, vote.b].map(|label| centres[label as usize - 1].0),
        positive: vote.positive,
        negative: vote.negative,
        decision,
        is_thin: is_thin(scene, vote),
    };
    decisions(scene).into_iter().map(of_pair).collect()
}

/// Centre on the plane of each component, component k at k - 1, and the number of its pixels.
pub fn centres(scene: &FrameScene) -> Vec<([f64; 2], usize)> {
    let centroids = component_centroids(scene.stages).into_iter();
    centroids.map(|([x, y, _], count)| ([x, y], count)).collect()
}

/// The edge of a pair, wider with more votes; `scale` is 1 for a plane of some 50 m.
pub fn edge(scene: &FrameScene, vote: &Vote, decision: Decision, scale: f64) -> Stroke {
    let look = scene.look();
    let votes = f64::from(vote.positive + vote.negative);
    let width = (0.6 + 0.25 * votes.sqrt()).min(4.0) * scale;
    let ([r, g, b], opacity) = match decision {
        Decision::Merged => (look.merged, 255),
        Decision::Rejoined => (look.rejoined, 150),
        Decision::Apart => (look.apart, 255),
    };
    let dash = is_thin(scene, vote).then_some([2.5 + width, 1.5 + width]);
    Stroke { colour: [r, g, b, opacity], width, dash }
}

/// Draws edges and nodes; pairs that stayed apart lie over the others. Of many pairs those with
/// most votes are drawn. Returns how many are drawn, and of how many.
pub fn draw(canvas: &mut Canvas, plane: &Plane, scene: &FrameScene) -> [usize; 2] {
    let centres = centres(scene);
    let instance = instance_of_component(scene.stages);
    let is_seen = |label: u32| plane.shows(centres[label as usize - 1].0);
    let mut seen = decisions(scene);
    seen.retain(|(vote, _)| is_seen(vote.a) || is_seen(vote.b));
    let all = seen.len();
    seen.sort_by_key(|(vote, _)| std::cmp::Reverse(vote.positive + vote.negative));
    seen.truncate(MOST_EDGES);
    let drawn = seen.len();
    // Thinner and paler where there are many.
    let crowd = (400.0 / drawn.max(1) as f64).sqrt().clamp(0.7, 1.0);
    let scale = (plane.scale / 12.0).clamp(0.6, 1.6) * crowd;
    canvas.clipped(plane.area, |canvas| {
        for level in [Decision::Rejoined, Decision::Merged, Decision::Apart] {
            for &(vote, decision) in seen.iter().filter(|(_, decision)| *decision == level) {
                let mut stroke = edge(scene, vote, decision, scale);
                stroke.colour[3] = (f64::from(stroke.colour[3]) * crowd.max(0.85)) as u8;
                let [from, to] = [vote.a, vote.b].map(|k| plane.to_page(centres[k as usize - 1].0));
                canvas.line(from, to, stroke);
            }
        }
        for (&(centre, count), &instance) in centres.iter().zip(&instance) {
            if count == 0 || !plane.shows(centre) {
                continue;
            }
            let radius = (1.0 + (count as f64).sqrt() * 0.12).min(3.5) * scale;
            let rim = Stroke::solid(opaque(scene.look().panel), 0.6 * scale);
            let colour = opaque(scene.colour(instance));
            canvas.circle(plane.to_page(centre), radius, Some(colour), Some(rim));
        }
    });
    [drawn, all]
}
