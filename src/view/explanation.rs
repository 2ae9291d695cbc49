//! The figure of an explanation: the neighbourhood of its points, and the pairs that voted.

use super::canvas::{Anchor, Area, Canvas, Stroke, TextStyle, opaque};
use super::font::{self, Weight};
use super::layout::{self, Caption, GAP, INNER_WIDTH, MARGIN, WIDTH, slot_width};
use super::legend::Key;
use super::look::Look;
use super::options::FigureOptions;
use super::plane::{Plane, PlaneRegion};
use super::plane_panel::birds_eye;
use super::scene::{FrameScene, Window, row_from_top};
use super::tree_figure::TreeRow;
use super::{axes, icicle, image_axes, range_panel, theme};
use crate::diagnose::explain::{BorderPair, Explanation, Place, PointFacts};
use crate::text::grouped;

/// Columns shown on either side of the points.
const COLUMNS_BESIDE: usize = 25;
/// Up to so many rows an image is shown from top to bottom.
const FEW_ROWS: usize = 40;
/// Rows shown above and below the points of a higher image.
const ROWS_BESIDE: usize = 16;
const HEADLINE_LINES: usize = 3;

/// Draws an explanation under its headline: components with the pairs of pixels that voted, and
/// instances; or instances, and the part of the tree of merges around the points where there are no
/// classes. Below them is the plane. The points are marked A and B.
pub fn explanation(scene: &FrameScene, found: &Explanation, headline: &str, dpi: f64) -> Canvas {
    let mut canvas = layout::page(scene.theme);
    let top = title(&mut canvas, scene, headline);
    let bottom = match tree_row(scene, &found.points, top) {
        Some(row) => draw_tree(&mut canvas, &row, scene, &found.points),
        None => draw_votes(&mut canvas, scene, found, top),
    };
    let slot = Area { x: MARGIN, y: bottom + GAP, width: INNER_WIDTH, height: 0.42 * WIDTH };
    let caption = Caption { letter: Some(2), title: "bird's-eye view", ..Caption::default() };
    let area = captioned(&mut canvas, slot, caption);
    plane(&mut canvas, scene, &found.points, area, dpi);
    canvas.height = (area.bottom() + axes::BELOW + MARGIN).ceil();
    canvas
}

/// Draws components with the pairs that voted, and instances. Returns where they end.
fn draw_votes(canvas: &mut Canvas, scene: &FrameScene, found: &Explanation, top: f64) -> f64 {
    let pairs = found.pairs();
    let window = window(scene, &found.points);
    let width = slot_width(2);
    let height = (width - axes::LEFT) * window.rows.len() as f64 / window.columns.len() as f64;
    let height = height.clamp(130.0, 420.0).round() + axes::BELOW;
    let slot = Area { x: MARGIN, y: top, width, height };
    let area = captioned(canvas, slot, components_caption(scene, &pairs));
    let panel = Panel { scene, window: &window, area };
    canvas.picture(area, range_panel::components(scene, &window));
    image_axes::draw(canvas, scene, &window, area);
    panel.votes(canvas, &pairs);
    panel.marks(canvas, &found.points);

    let slot = Area { x: MARGIN + width + GAP, ..slot };
    let caption = Caption { letter: Some(1), title: "instances", ..Caption::default() };
    let area = captioned(canvas, slot, caption);
    let panel = Panel { area, ..panel };
    canvas.picture(area, range_panel::instances(scene, &window));
    image_axes::draw(canvas, scene, &window, area);
    panel.marks(canvas, &found.points);
    area.bottom() + axes::BELOW
}

/// Instances and the tree of merges around the points; `None` if one of them is not in a tree.
fn tree_row<'a>(scene: &'a FrameScene, points: &[PointFacts], y: f64) -> Option<TreeRow<'a>> {
    let tree = scene.stages.post_merge.tree.as_ref()?;
    let nodes = points.iter().map(|point| tree.node_of_pixel[point.object?]);
    let tops = icicle::tops(tree, &nodes.collect::<Option<Vec<u32>>>()?);
    Some(TreeRow::new(scene, tree, tops, FigureOptions::default().aspect, y))
}

/// Draws them with the places of the points. Returns where they end.
fn draw_tree(canvas: &mut Canvas, row: &TreeRow, scene: &FrameScene, points: &[PointFacts]) -> f64 {
    row.draw(canvas, None);
    Panel { scene, window: &row.window, area: row.image }.marks(canvas, points);
    let icicle = row.icicle();
    let place = |point: &PointFacts| icicle.place(point.object? as u32);
    let places: Vec<_> =
        named(points).filter_map(|(name, point)| Some((name, place(point)?))).collect();
    for (number, &(name, [x, y])) in places.iter().enumerate() {
        ring(canvas, [x, y]);
        let other = places.get(1 - number).map(|&(_, [other, _])| x - other);
        let beside = match other.filter(|other| other.abs() < 16.0) {
            Some(other) => 8.0_f64.copysign(other),
            None => 0.0,
        };
        canvas.text([x + beside, y - 11.0], name, letter(canvas.look()));
    }
    row.bottom()
}

/// Draws the headline and below it the frame. Returns where they end.
fn title(canvas: &mut Canvas, scene: &FrameScene, headline: &str) -> f64 {
    let mut baseline = MARGIN;
    for line in wrapped(headline, INNER_WIDTH) {
        baseline += theme::HEADING + 4.0;
        canvas.text([MARGIN, baseline], line, theme::heading());
    }
    baseline += theme::SMALL + 6.0;
    let words = format!("{}  ·  {}", scene.heading, scene.remark);
    let words = font::fitted(&words, theme::SMALL, Weight::Regular, INNER_WIDTH);
    canvas.text([MARGIN, baseline], words, theme::faint(Anchor::Start));
    baseline + 10.0
}

/// The headline in lines that fit; the last ends with an ellipsis if there is more.
fn wrapped(headline: &str, room: f64) -> Vec<String> {
    let fits = |line: &str| font::width(line, theme::HEADING, Weight::Medium) <= room;
    let mut lines = vec![String::new()];
    for word in headline.split_whitespace() {
        let count = lines.len();
        let last = &mut lines[count - 1];
        let longer = if last.is_empty() { word.to_owned() } else { format!("{last} {word}") };
        if fits(&longer) || last.is_empty() || count == HEADLINE_LINES {
            *last = longer;
        } else {
            lines.push(word.to_owned());
        }
    }
    let fitted = |line: String| font::fitted(&line, theme::HEADING, Weight::Medium, room);
    lines.into_iter().map(fitted).collect()
}

fn components_caption(scene: &FrameScene, pairs: &[BorderPair]) -> Caption {
    let in_favour = pairs.iter().filter(|pair| pair.holds).count();
    let key = |colour, words: &str, count: usize| {
        Key::line(colour, format!("{words} ({})", grouped(count as u64)))
    };
    let keys = match pairs.is_empty() {
        true => Vec::new(),
        false => vec![
            key(scene.look().merged, "pairs in favour", in_favour),
            key(scene.look().apart, "against", pairs.len() - in_favour),
        ],
    };
    Caption { letter: Some(0), title: "local components", count: String::new(), keys }
}

/// Draws a caption and returns the area below it that the axes leave of the slot's height.
fn captioned(canvas: &mut Canvas, slot: Area, caption: Caption) -> Area {
    caption.draw(canvas, [slot.x, slot.y], slot.width);
    axes::inside(Area { y: slot.y + Caption::height(&[caption], slot.width), ..slot })
}

/// The part of the range image around the points; all columns if the seam parts them.
fn window(scene: &FrameScene, points: &[PointFacts]) -> Window {
    let image = &scene.stages.image;
    let pixels = points.iter().filter_map(|point| point.pixel);
    let pixels = pixels.map(|[row, column]| (row_from_top(image, row), column));
    let (rows, columns): (Vec<usize>, Vec<usize>) = pixels.unzip();
    let around = |values: Vec<usize>, more: usize, size: usize| {
        let low = values.iter().min().copied().unwrap_or(0);
        let high = values.iter().max().copied().unwrap_or(size - 1);
        low.saturating_sub(more)..(high + more + 1).min(size)
    };
    let mut columns = around(columns, COLUMNS_BESIDE, image.columns());
    if columns.len() > image.columns() / 2 {
        columns = 0..image.columns();
    }
    let more = if image.rows() <= FEW_ROWS { image.rows() } else { ROWS_BESIDE };
    Window { columns, rows: around(rows, more, image.rows()) }
}

/// A part of the range image in an area of the page.
#[derive(Clone, Copy)]
struct Panel<'a> {
    scene: &'a FrameScene<'a>,
    window: &'a Window,
    area: Area,
}

impl Panel<'_> {
    /// The middle of a pixel on the page, if it is shown.
    fn middle(&self, row: usize, column: usize) -> Option<[f64; 2]> {
        let Window { columns, rows } = self.window;
        let row = row_from_top(&self.scene.stages.image, row);
        let along = |at: usize, from: usize, count: usize, side: f64| {
            ((at - from) as f64 + 0.5) / count as f64 * side
        };
        self.window.contains(row, column).then(|| {
            let x = along(column, columns.start, columns.len(), self.area.width);
            [self.area.x + x, self.area.y + along(row, rows.start, rows.len(), self.area.height)]
        })
    }

    /// The pairs that voted, those against over the others; without pairs across the image's seam.
    fn votes(&self, canvas: &mut Canvas, pairs: &[BorderPair]) {
        let place = |place: Place| self.middle(place.row, place.column);
        let look = self.scene.look();
        for (holds, colour) in [(true, look.merged), (false, look.apart)] {
            let is_drawn = |pair: &&BorderPair| {
                pair.holds == holds && pair.a.column.abs_diff(pair.b.column) <= pair.pixels_apart
            };
            for pair in pairs.iter().filter(is_drawn) {
                if let (Some(from), Some(to)) = (place(pair.a), place(pair.b)) {
                    canvas.line(from, to, Stroke::solid(opaque(look.panel), 4.0));
                    canvas.line(from, to, Stroke::solid(opaque(colour), 2.0));
                }
            }
        }
    }

    fn marks(&self, canvas: &mut Canvas, points: &[PointFacts]) {
        for (name, point) in named(points) {
            let middle = point.pixel.and_then(|[row, column]| self.middle(row, column));
            if let Some(middle) = middle {
                mark(canvas, self.area, middle, name);
            }
        }
    }
}

/// The points with their letters; one alone has none.
fn named(points: &[PointFacts]) -> impl Iterator<Item = (&'static str, &PointFacts)> {
    let names = if points.len() == 1 { [""; 2] } else { ["A", "B"] };
    names.into_iter().zip(points)
}

/// A ring around a place, and a letter beside it that stays within the area.
fn mark(canvas: &mut Canvas, area: Area, [x, y]: [f64; 2], name: &str) {
    ring(canvas, [x, y]);
    let is_left = x > area.right() - 24.0;
    let x = if is_left { x - 15.0 } else { x + 15.0 };
    let y = (y - 6.0).max(area.y + 13.0);
    canvas.text([x, y], name, letter(canvas.look()));
}

fn ring(canvas: &mut Canvas, place: [f64; 2]) {
    let look = canvas.look();
    for (colour, width) in [(look.panel, 4.5), (look.focus, 2.0)] {
        canvas.circle(place, 6.5, None, Some(Stroke::solid(opaque(colour), width)));
    }
}

fn letter(look: &Look) -> TextStyle {
    look.label(theme::HEADING, opaque(look.focus), Anchor::Middle)
}

/// The instances from above around the points.
fn plane(canvas: &mut Canvas, scene: &FrameScene, points: &[PointFacts], area: Area, dpi: f64) {
    let places: Vec<[f64; 2]> = points
        .iter()
        .map(|point| [0, 1].map(|axis| f64::from(point.position[axis])))
        .filter(|[x, y]| x.is_finite() && y.is_finite())
        .collect();
    let plane = Plane::new(area, &PlaneRegion::whole(&places, 4.0, 12.0));
    birds_eye(canvas, scene, &plane, dpi);
    for (name, point) in named(points) {
        let [x, y, _] = point.position.map(f64::from);
        if plane.shows([x, y]) {
            mark(canvas, area, plane.to_page([x, y]), name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headlines_are_wrapped_and_cut() {
        assert_eq!(wrapped("Yes, one.", 900.0), ["Yes, one."]);
        let lines = wrapped(&"word ".repeat(200), 300.0);
        assert_eq!(lines.len(), HEADLINE_LINES);
        assert!(lines[2].ends_with('…') && !lines[1].ends_with('…'), "{lines:?}");
    }
}
