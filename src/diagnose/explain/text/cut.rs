//! What the cut of the tree of merges did.

use super::words::{NAMES, counted};
use crate::diagnose::explain::cut::CutEvidence;
use divmerge_core::cluster::NodeFacts;

/// The stage on several lines.
pub(super) fn text(cut: &CutEvidence) -> String {
    let mut lines = vec![format!("Cut of the tree of merges: {}.", outcome(cut))];
    let is_pair = cut.apart.len() == 2;
    for (name, path) in NAMES.iter().zip(&cut.apart) {
        let title = if is_pair { format!("{name} alone") } else { "it".to_owned() };
        lines.extend(shown(path).map(|node| format!("  {title}: {}", node_line(node))));
    }
    let title = if is_pair { "both" } else { "it" };
    lines.extend(shown(&cut.common).map(|node| format!("  {title}: {}", node_line(node))));
    if let Some(flip) = cut.flip {
        let change = match cut.joined {
            true => format!("would be cut in parts if its score were below {:.2}", flip.needed),
            false => format!("would be one object with a score of {:.2} or more", flip.needed),
        };
        let score = flip.score;
        lines.push(format!("  Smallest change: node {} (score {score:.2}) {change}.", flip.node));
    }
    lines.join("\n")
}

/// What became of the points, in a few words.
pub(super) fn outcome(cut: &CutEvidence) -> String {
    let object = |node: &NodeFacts| {
        let body = node.score.map_or("object", |score| score.body.name());
        format!("a {body} with a score of {:.2}", node.score.map_or(0.0, |score| score.total))
    };
    let background = cut.background;
    if cut.apart.len() != 2 {
        return match cut.chosen(0) {
            Some(node) => format!("made it part of {}", object(node)),
            None => "left it to the background: no node that holds it looks like an object".into(),
        };
    }
    match (cut.joined, cut.chosen(0), cut.chosen(1)) {
        (true, Some(node), _) => format!("made them one, {}", object(node)),
        (true, None, _) => format!(
            "made neither an object, and gaps of up to {background:.2} m link them in the \
             background"
        ),
        (false, Some(a), Some(b)) => format!("A is of {}, B of {}", object(a), object(b)),
        (false, Some(a), None) => format!("A is of {}, B of the background", object(a)),
        (false, None, Some(b)) => format!("A is of the background, B of {}", object(b)),
        (false, None, None) => format!(
            "made neither an object, and no gaps of up to {background:.2} m link them in the \
             background"
        ),
    }
}

/// The nodes of a path that say most: where it begins, what was chosen and what scored best.
fn shown(path: &[NodeFacts]) -> impl Iterator<Item = &NodeFacts> {
    let score = |node: &NodeFacts| node.score.map_or(0.0, |score| score.total);
    let best = path.iter().max_by(|a, b| score(a).total_cmp(&score(b))).map(|node| node.node);
    let first = path.first().map(|node| node.node);
    path.iter()
        .filter(move |node| node.is_chosen || Some(node.node) == first || Some(node.node) == best)
}

fn node_line(node: &NodeFacts) -> String {
    let [length, width, height] = node.measures.size;
    let chosen = if node.is_chosen { ", chosen" } else { "" };
    let score = match node.score {
        None => "no score: too few pixels, or too large".to_owned(),
        Some(score) => format!(
            "{} {:.2} (size {:.2}, isolation {:.2}, wholeness {:.2}, standing {:.2}, filled \
             {:.2}), worth {:.2}, its parts {:.2}",
            score.body.name(),
            score.total,
            score.size,
            score.isolation,
            score.wholeness,
            score.standing,
            score.filled,
            node.gain,
            node.of_parts
        ),
    };
    format!(
        "node {}{chosen}, {}, {length:.1} x {width:.1} x {height:.1} m, one from {:.2} to {:.2} m: \
         {score}",
        node.node,
        counted(node.place.len as usize, "pixel"),
        node.place.birth,
        node.place.death
    )
}
