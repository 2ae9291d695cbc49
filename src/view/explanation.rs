//! The picture of an explanation: the neighbourhood of its points, and the pairs of pixels that voted.

use super::canvas::{Anchor, Area, Canvas, Colour, Stroke, opaque};
use super::figure::{Caption, GAP, LEGEND_ROW, MARGIN, TITLE_ROW, WIDTH, birds_eye, grouped};
use super::font::{self, Weight};
use super::plane::{Plane, Region};
use super::range_panel;
use super::scene::{Scene, Window};
use super::theme::{self, Key};
use crate::explain::{BorderPair, Explanation, Place, PointFacts};

/// Columns shown on either side of the points.
const BESIDE: usize = 25;
/// An image of no more rows than this is shown from top to bottom ...
const FEW_ROWS: usize = 40;
/// ... and of a higher one so many rows above and below the points.
const ABOVE: usize = 16;
const HEADLINE_LINES: usize = 3;

/// Draws an explanation under its `headline`: components with the pairs of pixels that voted, instances,
/// and the plane around the points, which are marked A and B.
pub fn explanation(scene: &Scene, found: &Explanation, headline: &str, dpi: f64) -> Canvas {
    let mut canvas = Canvas::new(WIDTH, 0.0, theme::PAGE);
    let top = title(&mut canvas, scene, headline);
    let pairs = found.pairs();
    let window = window(scene, &found.points);
    let width = (WIDTH - 2.0 * MARGIN - GAP) / 2.0;
    let height = width * window.rows.len() as f64 / window.columns.len() as f64;
    let height = height.clamp(130.0, 420.0).round();
    let slot = Area { x: MARGIN, y: top, width, height };
    let left = captioned(&mut canvas, slot, 0, &components_caption(&pairs));
    let panel = Panel { scene, window: &window, area: left };
    canvas.picture(left, range_panel::components(scene, &window));
    panel.votes(&mut canvas, &pairs);
    panel.marks(&mut canvas, &found.points);

    let slot = Area { x: MARGIN + width + GAP, ..slot };
    let right = captioned(&mut canvas, slot, 1, &plain_caption("instances"));
    let panel = Panel { area: right, ..panel };
    canvas.picture(right, range_panel::instances(scene, &window));
    panel.marks(&mut canvas, &found.points);

    let slot = Area {
        x: MARGIN,
        y: right.bottom() + GAP,
        width: WIDTH - 2.0 * MARGIN,
        height: 0.42 * WIDTH,
    };
    let below = captioned(&mut canvas, slot, 2, &plain_caption("bird's-eye view"));
    plane(&mut canvas, scene, &found.points, below, dpi);
    canvas.height = (below.bottom() + MARGIN).ceil();
    canvas
}

/// The headline, and below it which frame this is. Returns where they end.
fn title(canvas: &mut Canvas, scene: &Scene, headline: &str) -> f64 {
    let room = WIDTH - 2.0 * MARGIN;
    let mut baseline = MARGIN;
    for line in wrapped(headline, room) {
        baseline += theme::HEADING + 4.0;
        let ink = theme::text(theme::HEADING, Weight::Medium, theme::INK, Anchor::Start);
        canvas.text([MARGIN, baseline], line, ink);
    }
    baseline += theme::SMALL + 6.0;
    let words = format!("{}  ·  {}", scene.heading, scene.remark);
    let faint = theme::text(theme::SMALL, Weight::Regular, theme::FAINT_INK, Anchor::Start);
    let words = font::fitted(&words, theme::SMALL, Weight::Regular, room);
    canvas.text([MARGIN, baseline], words, faint);
    baseline + 10.0
}

/// The headline in lines that fit, the last with an ellipsis if they are too few.
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

fn plain_caption(title: &'static str) -> Caption {
    Caption { title, count: String::new(), keys: Vec::new() }
}

fn components_caption(pairs: &[BorderPair]) -> Caption {
    let in_favour = pairs.iter().filter(|pair| pair.holds).count();
    let key = |colour: Colour, words: &str, count: usize| {
        Key::Line(Stroke::solid(colour, 2.0), format!("{words} ({})", grouped(count)))
    };
    let keys = match pairs.is_empty() {
        true => Vec::new(),
        false => vec![
            key(theme::MERGED, "pairs in favour", in_favour),
            key(theme::APART, "against", pairs.len() - in_favour),
        ],
    };
    Caption { title: "local components", count: String::new(), keys }
}

/// Draws a caption and returns the area of the slot's height below it.
fn captioned(canvas: &mut Canvas, slot: Area, place: usize, caption: &Caption) -> Area {
    let second_row = !caption.fits(slot.width);
    caption.draw(canvas, slot, place, second_row);
    let row = TITLE_ROW + if second_row { LEGEND_ROW } else { 0.0 };
    Area { y: slot.y + row, ..slot }
}

/// The part of the range image around the points, as a panel shows it; all columns if they lie on both
/// sides of its seam.
fn window(scene: &Scene, points: &[PointFacts]) -> Window {
    let image = &scene.stages.image;
    let (rows, columns) = (image.rows(), image.columns());
    let pixels = || points.iter().filter_map(|point| point.pixel);
    let around = |values: &mut dyn Iterator<Item = usize>, more: usize, size: usize| {
        let ends = values.fold(None, |ends: Option<(usize, usize)>, value| {
            Some(ends.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
        });
        let (low, high) = ends.unwrap_or((0, size - 1));
        low.saturating_sub(more)..(high + more + 1).min(size)
    };
    let mut shown = around(&mut pixels().map(|[_, column]| column), BESIDE, columns);
    if shown.len() > columns / 2 {
        shown = 0..columns;
    }
    let more = if rows <= FEW_ROWS { rows } else { ABOVE };
    let row = |[row, _]: [usize; 2]| shown_row(scene, row);
    Window { columns: shown, rows: around(&mut pixels().map(row), more, rows) }
}

/// A row of the range image as panels count them: from the top.
fn shown_row(scene: &Scene, row: usize) -> usize {
    let image = &scene.stages.image;
    if image.top_row_first { row } else { image.rows() - 1 - row }
}

/// A part of the range image in an area of the page.
#[derive(Clone, Copy)]
struct Panel<'a> {
    scene: &'a Scene<'a>,
    window: &'a Window,
    area: Area,
}

impl Panel<'_> {
    /// The middle of a pixel on the page, if it is shown.
    fn middle(&self, row: usize, column: usize) -> Option<[f64; 2]> {
        let Window { columns, rows } = self.window;
        let row = shown_row(self.scene, row);
        let along = |at: usize, from: usize, count: usize, side: f64| {
            ((at - from) as f64 + 0.5) / count as f64 * side
        };
        (rows.contains(&row) && columns.contains(&column)).then(|| {
            let x = along(column, columns.start, columns.len(), self.area.width);
            [self.area.x + x, self.area.y + along(row, rows.start, rows.len(), self.area.height)]
        })
    }

    /// The pairs that voted, those against over the others; not those across the seam of the image.
    fn votes(&self, canvas: &mut Canvas, pairs: &[BorderPair]) {
        let place = |place: Place| self.middle(place.row, place.column);
        for (holds, colour) in [(true, theme::MERGED), (false, theme::APART)] {
            let is_drawn = |pair: &&BorderPair| {
                pair.holds == holds && pair.a.column.abs_diff(pair.b.column) <= pair.pixels_apart
            };
            for pair in pairs.iter().filter(is_drawn) {
                if let (Some(from), Some(to)) = (place(pair.a), place(pair.b)) {
                    canvas.line(from, to, Stroke::solid(opaque(theme::PANEL), 4.0));
                    canvas.line(from, to, Stroke::solid(colour, 2.0));
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
    canvas.circle([x, y], 6.5, None, Some(Stroke::solid(opaque(theme::PANEL), 4.5)));
    canvas.circle([x, y], 6.5, None, Some(Stroke::solid(theme::FOCUS, 2.0)));
    let is_left = x > area.right() - 24.0;
    let x = if is_left { x - 15.0 } else { x + 15.0 };
    let y = (y - 6.0).max(area.y + 13.0);
    canvas.text([x, y], name, theme::label(theme::HEADING, theme::FOCUS, Anchor::Middle));
}

/// The instances from above around the points.
fn plane(canvas: &mut Canvas, scene: &Scene, points: &[PointFacts], area: Area, dpi: f64) {
    let places: Vec<[f64; 2]> = points
        .iter()
        .map(|point| [0, 1].map(|axis| f64::from(point.position[axis])))
        .filter(|[x, y]| x.is_finite() && y.is_finite())
        .collect();
    let plane = Plane::new(area, &Region::whole(places.iter().copied(), 4.0, 12.0));
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
