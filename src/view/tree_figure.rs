//! The figure of an object that was cut from the tree of merges: the instances over the range
//! image, and beside them the part of the tree around the object.

use super::canvas::{Area, Canvas, Stroke, between, opaque};
use super::icicle::{BACKGROUND, Icicle, score_ramp, tops};
use super::layout::{self, Caption, GAP, HEADING_ROW, MARGIN, slot_width};
use super::legend::Key;
use super::numbers::extent;
use super::options::FigureOptions;
use super::scene::{FrameScene, Window, row_from_top};
use super::{axes, image_axes, range_panel};
use crate::error::Result;
use crate::text::counted;
use divmerge_core::cluster::{MergeTree, NodeFacts};
use divmerge_core::pipeline::Stages;

const HEIGHT: f64 = 320.0;
/// Room for the uppermost number of the axis.
const BELOW_CAPTION: f64 = 4.0;

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
    let mut canvas = layout::page(scene.theme);
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
        let columns = scene.stages.image.columns();
        let side = |&top: &u32| beside_seam(pixels(scene, tree, top).collect(), columns);
        let pixels = tops.iter().flat_map(side);
        let image = Area { x: MARGIN + axes::LEFT, y, width: width - axes::LEFT, height: HEIGHT };
        let window = scene.window_around(pixels, aspect, image.width / HEIGHT);
        let row = TreeRow { scene, tree, window, tops, corner: [MARGIN, y], image };
        let captions = Caption::height(&row.captions(None), width);
        TreeRow { image: Area { y: y + captions + BELOW_CAPTION, ..image }, ..row }
    }

    /// Draws both with their captions; `focus` is an object that is pointed out.
    pub fn draw(&self, canvas: &mut Canvas, focus: Option<u32>) {
        let [image, icicle] = self.captions(focus);
        let ([left, y], width) = (self.corner, slot_width(2));
        image.draw(canvas, [left, y], width);
        icicle.draw(canvas, [left + width + GAP, y], width);
        let icicle = self.icicle();
        self.draw_image(canvas, &icicle.colour_of_pixel());
        if let Some(object) = focus {
            self.frame(canvas, object);
        }
        icicle.draw(canvas, focus);
    }

    /// The part of the tree in its colours; what is not in it is dimmed.
    fn draw_image(&self, canvas: &mut Canvas, colours: &[Option<[u8; 3]>]) {
        let Stages { labels, mask, .. } = self.scene.stages;
        let raster = range_panel::raster(self.scene, &self.window, |pixel, point| {
            let backdrop = range_panel::backdrop(self.scene, point);
            let dimmed = |instance: u32| match instance {
                0 => backdrop,
                instance => between(self.scene.look().panel, self.scene.colour(instance), 0.35),
            };
            match colours[pixel] {
                Some(colour) => colour,
                None if mask.is_object[point] => dimmed(labels.instance[point]),
                None => backdrop,
            }
        });
        canvas.picture(self.image, raster);
        image_axes::draw(canvas, self.scene, &self.window, self.image);
    }

    /// A frame around the pixels of an object.
    fn frame(&self, canvas: &mut Canvas, object: u32) {
        let pixels = pixels(self.scene, self.tree, object);
        let seen: Vec<[usize; 2]> =
            pixels.filter(|&[row, column]| self.window.contains(row, column)).collect();
        let side = |axis: usize, from: usize, count: usize, side: f64| {
            let ends = extent(seen.iter().map(|pixel| (pixel[axis] - from) as f64));
            let [low, high] = ends.unwrap_or_default();
            let along = |at: f64| at / count as f64 * side;
            [along(low) - 2.0, along(high + 1.0) - along(low) + 4.0]
        };
        let Window { rows, columns } = &self.window;
        let [x, width] = side(1, columns.start, columns.len(), self.image.width);
        let [y, height] = side(0, rows.start, rows.len(), self.image.height);
        let frame = Area { x: self.image.x + x, y: self.image.y + y, width, height };
        let look = self.scene.look();
        canvas.clipped(self.image, |canvas| {
            canvas.rect(frame, None, Some(Stroke::solid(opaque(look.panel), 3.6)));
            canvas.rect(frame, None, Some(Stroke::solid(opaque(look.focus), 1.6)));
        });
    }

    /// The part of the tree.
    pub fn icicle(&self) -> Icicle<'_> {
        let area = Area { x: self.image.right() + GAP, width: slot_width(2), ..self.image };
        Icicle::new(self.scene, self.tree, &self.tops, area)
    }

    /// Where the row ends.
    pub fn bottom(&self) -> f64 {
        self.image.bottom() + Icicle::FOOT
    }

    fn captions(&self, focus: Option<u32>) -> [Caption; 2] {
        let icicle = self.icicle();
        let count = "(dimmed: not in b)".to_owned();
        let focus = focus.map(|_| Key::line(self.scene.look().focus, "this object".to_owned()));
        let keys = focus.into_iter().chain([Key::square(BACKGROUND, "background")]).collect();
        let image = Caption { letter: Some(0), title: "instances", count, keys };
        let [nodes, objects] = [(icicle.node_count(), "node"), (icicle.object_count(), "object")]
            .map(|(count, noun)| counted(count, noun));
        let keys = vec![
            Key::Ramp(["score 0".into(), "1".into()], score_ramp),
            Key::Words("in colour: objects and their parts".into()),
        ];
        let count = format!("({nodes}, {objects})");
        [image, Caption { letter: Some(1), title: "tree of merges", count, keys }]
    }
}

/// Pixels, each a row and a column, that lie on both sides of the seam of the image take half of it
/// or more: only those of the side with more of them are kept.
fn beside_seam(mut pixels: Vec<[usize; 2]>, columns: usize) -> Vec<[usize; 2]> {
    let is_left = |pixel: &[usize; 2]| pixel[1] < columns / 2;
    let Some([low, high]) = extent(pixels.iter().map(|pixel| pixel[1] as f64)) else {
        return pixels;
    };
    if high - low >= columns as f64 / 2.0 {
        let left = pixels.iter().filter(|pixel| is_left(pixel)).count();
        let keeps_left = 2 * left >= pixels.len();
        pixels.retain(|pixel| is_left(pixel) == keeps_left);
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_side_of_the_seam_is_shown() {
        let kept = |columns: &[usize]| {
            let pixels = columns.iter().map(|&column| [0, column]).collect();
            beside_seam(pixels, 100).iter().map(|pixel| pixel[1]).collect::<Vec<_>>()
        };
        assert_eq!(kept(&[1, 97, 98]), [97, 98]);
        assert_eq!(kept(&[0, 1, 99]), [0, 1]);
        assert_eq!(kept(&[30, 60]), [30, 60]);
        assert!(kept(&[]).is_empty());
    }
}
