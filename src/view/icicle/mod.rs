//! The icicle of a part of the tree of merges (after Kruskal and Landwehr, "Icicle Plots: Better
//! Displays for Hierarchical Clustering", 1983).
//!
//! A node is a box: as wide as it has pixels, from the gap across which it became one group up to
//! the gap across which it joined another. Its children hang below it, side by side. Objects and
//! their parts have the colour of the instance, all other nodes are grey; the higher the score, the
//! stronger.

use super::axes;
use super::canvas::{Anchor, Area, Canvas, Stroke, between, opaque};
use super::font::{self, Weight};
use super::look::Look;
use super::scene::FrameScene;
use super::theme;
use crate::text::grouped;
use divmerge_core::cluster::{MergeTree, NodeFacts};

#[cfg(test)]
mod tests;

/// Left of the plot, for the numbers of the axis.
const AXIS: f64 = 40.0;
/// Between two parts of the tree.
const BESIDE: f64 = 14.0;
/// Their pixels that are in no object.
pub const BACKGROUND: [u8; 3] = [148, 152, 160];
/// Size of the names of objects.
const NAME: f64 = 10.0;

/// The tops of the part of the tree around some nodes: the smallest node with a score that holds
/// all of them and more than one object; without one, that of each node.
pub fn tops(tree: &MergeTree, nodes: &[u32]) -> Vec<u32> {
    let path = |node: u32| tree.tree.path(node).collect::<Vec<u32>>();
    let mut common = nodes.first().map_or_else(Vec::new, |&node| path(node));
    common.retain(|&above| nodes.iter().all(|&node| tree.tree.path(node).any(|n| n == above)));
    if let Some(top) = surroundings(tree, &common) {
        return vec![top];
    }
    let top = |&node: &u32| surroundings(tree, &path(node)).unwrap_or(node);
    let tops: Vec<u32> = nodes.iter().map(top).collect();
    let is_below = |top: u32| tree.tree.path(top).skip(1).any(|above| tops.contains(&above));
    let mut outer: Vec<u32> = tops.iter().copied().filter(|&top| !is_below(top)).collect();
    outer.dedup();
    outer
}

/// The smallest node of a path, from below, that has a score and is more than one object; if there
/// is none, the object.
fn surroundings(tree: &MergeTree, path: &[u32]) -> Option<u32> {
    let object = path.iter().position(|&node| tree.facts(node).is_chosen);
    let mut above = path[object.map_or(0, |object| object + 1)..].iter();
    let scored = above.find(|&&node| tree.scores[node as usize].is_some());
    scored.copied().or(object.map(|object| path[object]))
}

/// A part of the tree laid out in an area of a page.
pub struct Icicle<'a> {
    scene: &'a FrameScene<'a>,
    tree: &'a MergeTree,
    tops: &'a [u32],
    plot: Area,
    /// The least and the greatest gap of the tree, metres.
    gaps: [f64; 2],
    /// The nodes, each after the one that it is part of.
    boxes: Vec<NodeBox>,
}

/// A node on the page.
#[derive(Debug, Clone, Copy)]
struct NodeBox {
    facts: NodeFacts,
    area: Area,
    /// The object that it is or is part of.
    object: Option<u32>,
}

impl<'a> Icicle<'a> {
    /// Below the area, for the numbers of pixels.
    pub const FOOT: f64 = 20.0;

    /// What lies below the tops, in an area with room for the axis of gaps.
    pub fn new(
        scene: &'a FrameScene<'a>,
        tree: &'a MergeTree,
        tops: &'a [u32],
        area: Area,
    ) -> Self {
        let plot = Area { x: area.x + AXIS, width: area.width - AXIS, ..area };
        let nodes = || tree.tree.nodes.iter();
        let low = nodes().map(|node| f64::from(node.birth)).fold(f64::INFINITY, f64::min);
        let high = nodes().map(|node| f64::from(node.death)).fold(low, f64::max);
        // A logarithm needs a gap, and an axis two ends.
        let low = low.clamp(1e-3, 1e3);
        let gaps = [low, high.max(low * 1.01)];
        let mut icicle = Icicle { scene, tree, tops, plot, gaps, boxes: Vec::new() };
        icicle.boxes = icicle.laid_out();
        icicle
    }

    /// Number of its nodes.
    pub fn node_count(&self) -> usize {
        self.boxes.len()
    }

    /// Number of its nodes that are objects.
    pub fn object_count(&self) -> usize {
        self.objects().count()
    }

    /// Draws boxes, names of objects and axes.
    pub fn draw(&self, canvas: &mut Canvas, focus: Option<u32>) {
        let look = canvas.look();
        canvas.rect(self.plot, Some(opaque(look.panel)), None);
        self.gap_axis(canvas);
        self.pixel_axis(canvas);
        for node in &self.boxes {
            let rim = (node.area.width > 3.0).then(|| Stroke::solid(opaque(look.panel), 0.7));
            canvas.rect(node.area, Some(opaque(self.colour(node))), rim);
        }
        for node in self.objects() {
            let is_focus = focus == Some(node.facts.node);
            let colour = if is_focus { opaque(look.focus) } else { look.on_panel };
            canvas.rect(node.area, None, Some(Stroke::solid(colour, 1.6)));
            name(canvas, node);
        }
        axes::frame(canvas, self.plot);
    }

    /// The place of an object pixel, at the lower end of the smallest node that holds it.
    pub fn place(&self, object: u32) -> Option<[f64; 2]> {
        /// Above the end, so that a ring around the place lies within a box that is high enough.
        const RAISED: f64 = 9.0;
        let node = (*self.tree.node_of_pixel.get(object as usize)?)?;
        let found = self.boxes.iter().find(|found| found.facts.node == node)?;
        let pixels = self.tree.tree.pixels_of(&found.facts.place);
        let place = pixels.iter().position(|&pixel| pixel == object)? as f64 + 0.5;
        let Area { x, width, height, .. } = found.area;
        let y = found.area.bottom() - RAISED.min(height / 2.0);
        Some([x + place / pixels.len() as f64 * width, y])
    }

    /// The colour of each pixel of the range image that lies in the part of the tree: that of its
    /// object, or [`BACKGROUND`].
    pub fn colour_of_pixel(&self) -> Vec<Option<[u8; 3]>> {
        let image = &self.scene.stages.image;
        let mut colours = vec![None; image.rows() * image.columns()];
        for node in &self.boxes {
            let colour = node.object.map_or(BACKGROUND, |object| self.object_colour(object));
            for &object in self.tree.tree.own_pixels_of(&node.facts.place) {
                let pixel = self.scene.stages.objects.pixel[object as usize];
                colours[pixel as usize] = Some(colour);
            }
        }
        colours
    }

    fn objects(&self) -> impl Iterator<Item = &NodeBox> {
        self.boxes.iter().filter(|node| node.facts.is_chosen)
    }

    /// The nodes, each after the one that it is part of.
    fn laid_out(&self) -> Vec<NodeBox> {
        let mut boxes = Vec::new();
        for (top, area) in self.columns() {
            let mut above = self.tree.tree.path(top).skip(1);
            let object = above.find(|&node| self.tree.facts(node).is_chosen);
            let first = self.tree.facts(top).place;
            let mut open = vec![(top, object)];
            while let Some((node, object)) = open.pop() {
                let facts = self.tree.facts(node);
                let object = if facts.is_chosen { Some(node) } else { object };
                let along = |pixels: u32| f64::from(pixels) / f64::from(first.len) * area.width;
                let [top, bottom] = [facts.place.death, facts.place.birth].map(|gap| self.y(gap));
                let area = Area {
                    x: area.x + along(facts.place.start - first.start),
                    y: top,
                    width: along(facts.place.len),
                    height: bottom - top,
                };
                boxes.push(NodeBox { facts, area, object });
                open.extend(facts.place.children.iter().flatten().map(|&child| (child, object)));
            }
        }
        boxes
    }

    /// The part of the plot that each top has: all pixels are of one width.
    fn columns(&self) -> Vec<(u32, Area)> {
        let len = |top: u32| f64::from(self.tree.facts(top).place.len);
        let all: f64 = self.tops.iter().map(|&top| len(top)).sum();
        let room = self.plot.width - BESIDE * self.tops.len().saturating_sub(1) as f64;
        let mut x = self.plot.x;
        let column = |&top: &u32| {
            let area = Area { x, width: len(top) / all * room, ..self.plot };
            x = area.right() + BESIDE;
            (top, area)
        };
        self.tops.iter().map(column).collect()
    }

    /// The height on the page of a gap in metres.
    fn y(&self, gap: f32) -> f64 {
        let [low, high] = self.gaps;
        let part = (f64::from(gap).clamp(low, high) / low).ln() / (high / low).ln();
        self.plot.bottom() - part * self.plot.height
    }

    fn colour(&self, node: &NodeBox) -> [u8; 3] {
        let score = node.facts.score.map_or(0.0, |score| score.total);
        let look = self.scene.look();
        let own = node.object.map_or(look.node, |object| self.object_colour(object));
        between(look.panel, own, shade(score))
    }

    fn object_colour(&self, object: u32) -> [u8; 3] {
        self.scene.colour(self.instance(object))
    }

    /// The instance that an object became.
    fn instance(&self, object: u32) -> u32 {
        let stages = self.scene.stages;
        let pixels = self.tree.tree.pixels_of(&self.tree.tree.nodes[object as usize]).iter();
        let point =
            |&pixel: &u32| stages.image.point_at(stages.objects.pixel[pixel as usize] as usize);
        let point = pixels.filter_map(point).next();
        point.map_or(0, |point| stages.labels.instance[point])
    }

    fn gap_axis(&self, canvas: &mut Canvas) {
        /// Least distance of two numbers.
        const APART: f64 = 15.0;
        let [low, high] = self.gaps;
        let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let round = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(power)));
        let round = round.filter(|gap| (low * 0.999..=high * 1.001).contains(gap));
        let mut last = f64::INFINITY;
        for gap in std::iter::once(low).chain(round) {
            let y = self.y(gap as f32);
            if last - y < APART {
                continue;
            }
            last = y;
            let [left, right] = [self.plot.x, self.plot.right()];
            canvas.line([left - 4.0, y], [left, y], Stroke::solid(theme::FAINT_INK, 1.0));
            canvas.line([left, y], [right, y], Stroke::solid(canvas.look().guide, 0.6));
            let words = format!("{} m", (gap * 1000.0).round() / 1000.0);
            canvas.text([left - 7.0, y + 4.0], words, theme::faint(Anchor::End));
        }
    }

    /// Below each part its number of pixels, and a line as wide as the part.
    fn pixel_axis(&self, canvas: &mut Canvas) {
        for (top, area) in self.columns() {
            let y = area.bottom() + 4.0;
            let line = Stroke::solid(theme::FAINT_INK, 1.0);
            canvas.line([area.x, y], [area.right(), y], line);
            let pixels = u64::from(self.tree.facts(top).place.len);
            let words = format!("{} pixels", grouped(pixels));
            let words = [words, grouped(pixels)].into_iter().find(|words| {
                font::width(words, theme::SMALL, Weight::Regular) <= area.width + BESIDE
            });
            let middle = [area.x + area.width / 2.0, y + 13.0];
            canvas.text(middle, words.unwrap_or_default(), theme::faint(Anchor::Middle));
        }
    }
}

/// How much of its colour a node of a score has.
fn shade(score: f64) -> f64 {
    0.2 + 0.8 * score.clamp(0.0, 1.0)
}

/// The shades of scores from 0 to 1 for a legend.
pub fn score_ramp(look: &Look, score: f64) -> [u8; 3] {
    between(look.panel, look.node, shade(score))
}

/// Writes the body and the score of an object into its box, in one row or two, as far as they fit.
fn name(canvas: &mut Canvas, node: &NodeBox) {
    const ROW: f64 = 12.0;
    let Some(score) = node.facts.score else { return };
    let [body, total] = [score.body.name().to_owned(), format!("{:.2}", score.total)];
    let ways = [vec![format!("{body} {total}")], vec![body, total.clone()], vec![total]];
    let fits = |rows: &Vec<String>| {
        let is_narrow =
            |row: &String| font::width(row, NAME, Weight::Medium) + 3.0 <= node.area.width;
        // A single row may be higher than its box: no other name is above or below.
        rows.iter().all(is_narrow) && (rows.len() == 1 || node.area.height >= 2.0 * ROW + 3.0)
    };
    let Some(rows) = ways.into_iter().find(fits) else { return };
    let middle = node.area.y + node.area.height / 2.0;
    let look = canvas.look();
    let style = look.label(NAME, look.on_panel, Anchor::Middle);
    let mut baseline = middle - rows.len() as f64 * ROW / 2.0 + 9.5;
    for row in rows {
        let at = [node.area.x + node.area.width / 2.0, baseline];
        canvas.text(at, row, style);
        baseline += ROW;
    }
}
