//! The figure of an object that was cut from the tree of merges: the instances over the range
//! image, and beside them the part of the tree around the object.

use super::canvas::{Area, Canvas};
use super::icicle::{Icicle, score_ramp, tops};
use super::layout::{self, Caption, GAP, HEADING_ROW, MARGIN, slot_width};
use super::legend::Key;
use super::options::FigureOptions;
use super::range_panel;
use super::scene::{FrameScene, Window, row_from_top};
use crate::error::Result;
use crate::text::counted;
use divmerge_core::cluster::{MergeTree, NodeFacts};

const HEIGHT: f64 = 320.0;

/// The objects that were cut from the tree of merges, those of a crop with a pixel in it; `None` if
/// the run had no tree.
///
/// # Errors
/// [`Error::Figure`](crate::error::Error::Figure) if the crop lies outside of the range image.
pub fn cut_objects(scene: &FrameScene, options: &FigureOptions) -> Result<Option<Vec<NodeFacts>>> {
    let image = &scene.stages.image;
    let window = options.crop.within(image.rows(), image.columns())?;
    let Some(tree) = &scene.stages.post_merge.tree else { return Ok(None) };
    let is_seen =
        |node: u32| pixels(scene, tree, node).any(|[row, column]| window.contains(row, column));
    let seen = tree.cut.chosen.iter().filter(|&&node| is_seen(node));
    Ok(Some(seen.map(|&node| tree.facts(node)).collect()))
}

/// Draws one object, the `number`th of `total`.
pub fn object_figure(
    scene: &FrameScene,
    options: &FigureOptions,
    object: &NodeFacts,
    number: usize,
    total: usize,
) -> Canvas {
    let mut canvas = layout::page();
    let score = object.score.map_or_else(String::new, |score| {
        format!("  ·  {} with a score of {:.2}", score.body.name(), score.total)
    });
    let headed = FrameScene {
        heading: format!("object {number} of {total}{score}"),
        remark: format!("{}  ·  {}", scene.heading, scene.remark),
        ..scene.clone()
    };
    layout::heading(&mut canvas, &headed);
    let mut bottom = MARGIN + HEADING_ROW;
    if let Some(tree) = &scene.stages.post_merge.tree {
        let row = TreeRow::new(scene, tree, tops(tree, &[object.node]), options.aspect, bottom);
        row.draw(&mut canvas, Some(object.node));
        bottom = row.bottom();
    }
    canvas.height = (bottom + MARGIN).ceil();
    canvas
}

/// Row from the top and column of the pixels of a node.
fn pixels<'a>(
    scene: &'a FrameScene,
    tree: &'a MergeTree,
    node: u32,
) -> impl Iterator<Item = [usize; 2]> {
    let image = &scene.stages.image;
    let objects = tree.tree.pixels_of(&tree.tree.nodes[node as usize]).iter();
    let pixels = objects.map(|&object| scene.stages.objects.pixel[object as usize] as usize);
    let columns = image.columns();
    pixels.map(move |pixel| [row_from_top(image, pixel / columns), pixel % columns])
}

/// A part of the range image, and beside it the icicle of the same part.
pub struct TreeRow<'a> {
    scene: &'a FrameScene<'a>,
    tree: &'a MergeTree,
    tops: Vec<u32>,
    /// The part of the range image.
    pub window: Window,
    /// Where the range image is.
    pub image: Area,
    /// Upper left corner.
    corner: [f64; 2],
}

impl<'a> TreeRow<'a> {
    /// What lies below the tops, from a height of the page on.
    pub fn new(
        scene: &'a FrameScene<'a>,
        tree: &'a MergeTree,
        tops: Vec<u32>,
        aspect: f64,
        y: f64,
    ) -> Self {
        let width = slot_width(2);
        let pixels = tops.iter().flat_map(|&top| pixels(scene, tree, top));
        let window = scene.window_around(pixels, aspect, width / HEIGHT);
        let row = TreeRow {
            scene,
            tree,
            window,
            tops,
            corner: [MARGIN, y],
            image: Area { x: MARGIN, y, width, height: HEIGHT },
        };
        let captions = Caption::height(&row.captions(), width);
        TreeRow { image: Area { y: y + captions, ..row.image }, ..row }
    }

    /// Draws both with their captions; `focus` is an object that is pointed out.
    pub fn draw(&self, canvas: &mut Canvas, focus: Option<u32>) {
        let [image, icicle] = self.captions();
        let [left, y] = self.corner;
        let width = self.image.width;
        image.draw(canvas, [left, y], width);
        icicle.draw(canvas, [left + width + GAP, y], width);
        canvas.picture(self.image, range_panel::instances(self.scene, &self.window));
        self.icicle().draw(canvas, focus);
    }

    /// The part of the tree.
    pub fn icicle(&self) -> Icicle<'_> {
        let x = self.image.right() + GAP;
        Icicle::new(self.scene, self.tree, &self.tops, Area { x, ..self.image })
    }

    /// Where the row ends.
    pub fn bottom(&self) -> f64 {
        self.image.bottom() + Icicle::FOOT
    }

    fn captions(&self) -> [Caption; 2] {
        let icicle = self.icicle();
        let image = Caption { letter: Some(0), title: "instances", ..Caption::default() };
        let count = format!(
            "({}, {})",
            counted(icicle.node_count(), "node"),
            counted(icicle.object_count(), "object")
        );
        let keys = vec![
            Key::Ramp(["score 0".into(), "1".into()], score_ramp),
            Key::Words("in colour: objects, as in (a)".into()),
        ];
        [image, Caption { letter: Some(1), title: "tree of merges", count, keys }]
    }
}
