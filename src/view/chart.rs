//! A line chart: how a figure changes with another, for several things side by side.

use super::canvas::{Anchor, Area, Canvas, Colour, Shape, Stroke, opaque};
use super::font::{Weight, width};
use super::theme::{FAINT_INK, HEADING, INK, PAGE, SMALL, TITLE, text};

/// What is drawn. Numbers that are not finite are left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LineChart {
    /// Above the chart.
    pub title: String,
    /// Below the horizontal axis.
    pub x_name: String,
    /// Above the vertical axis.
    pub y_name: String,
    /// Places on the horizontal axis with a number.
    pub x_ticks: Vec<f64>,
    /// The lines, the one that matters first.
    pub lines: Vec<Line>,
}

/// A line with its name at its right end.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Line {
    /// Name.
    pub name: String,
    /// From left to right.
    pub points: Vec<[f64; 2]>,
}

const PLOT: Area = Area { x: 56.0, y: 64.0, width: 460.0, height: 300.0 };
const PAGE_HEIGHT: f64 = 420.0;
const NAME_STEP: f64 = 15.0;
const RULE: Colour = [226, 228, 232, 255];

/// Okabe and Ito's colours that are dark enough for a white page.
const COLOURS: [[u8; 3]; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [110, 110, 110],
    [176, 131, 0],
    [45, 45, 45],
    [150, 110, 220],
];

fn colour(line: usize) -> Colour {
    opaque(COLOURS[line % COLOURS.len()])
}

/// Draws a chart on a page of its own.
pub fn line_chart(chart: &LineChart) -> Canvas {
    let names = chart.lines.iter().map(|line| width(&line.name, SMALL, Weight::Medium));
    // A fifth more: a viewer without our font takes another.
    let room = 1.2 * names.fold(40.0, f64::max);
    let mut canvas = Canvas::new(PLOT.right() + 14.0 + room + 16.0, PAGE_HEIGHT, PAGE);
    let heading = text(HEADING, Weight::Medium, INK, Anchor::Start);
    canvas.text([16.0, 26.0], &chart.title, heading);
    let scale = Scale::of(chart);
    axes(&mut canvas, chart, &scale);
    for (number, line) in chart.lines.iter().enumerate().rev() {
        draw_line(&mut canvas, line, &scale, colour(number));
    }
    draw_names(&mut canvas, chart, &scale);
    canvas
}

/// From figures to places on the page.
struct Scale {
    x: [f64; 2],
    y: [f64; 2],
    y_step: f64,
}

impl Scale {
    fn of(chart: &LineChart) -> Self {
        let points = || chart.lines.iter().flat_map(finite);
        let x = range(points().map(|p| p[0]).chain(chart.x_ticks.iter().copied()));
        let [low, high] = range(points().map(|p| p[1]));
        let y_step = tick_step(high - low);
        let y = [(low / y_step).floor() * y_step, (high / y_step).ceil() * y_step];
        Scale { x, y, y_step }
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let part = |value: f64, [low, high]: [f64; 2]| (value - low) / (high - low);
        let down = 1.0 - part(y, self.y);
        [PLOT.x + part(x, self.x) * PLOT.width, PLOT.y + down * PLOT.height]
    }

    fn y_ticks(&self) -> impl Iterator<Item = f64> {
        let count = ((self.y[1] - self.y[0]) / self.y_step).round() as usize;
        let [low, step] = [self.y[0], self.y_step];
        (0..=count).map(move |tick| low + tick as f64 * step)
    }
}

fn finite(line: &Line) -> impl Iterator<Item = [f64; 2]> {
    line.points.iter().copied().filter(|point| point.iter().all(|value| value.is_finite()))
}

/// Least and greatest, at least 1 apart.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high { [0.0, 1.0] } else { [low, high.max(low + 1.0)] }
}

/// 1, 2 or 5 times a power of ten, so that at most eight steps make the span.
fn tick_step(span: f64) -> f64 {
    let power = 10_f64.powf((span / 8.0).log10().floor());
    [1.0, 2.0, 5.0]
        .map(|m| m * power)
        .into_iter()
        .find(|step| span / step <= 8.0)
        .unwrap_or(10.0 * power)
}

fn axes(canvas: &mut Canvas, chart: &LineChart, scale: &Scale) {
    let number = |value: f64| format!("{}", (value * 100.0).round() / 100.0);
    for tick in scale.y_ticks() {
        let y = scale.place([scale.x[0], tick])[1];
        canvas.line([PLOT.x, y], [PLOT.right(), y], Stroke::solid(RULE, 1.0));
        let style = text(SMALL, Weight::Regular, FAINT_INK, Anchor::End);
        canvas.text([PLOT.x - 8.0, y + 4.0], number(tick), style);
    }
    for &tick in &chart.x_ticks {
        let x = scale.place([tick, scale.y[0]])[0];
        let bottom = PLOT.bottom();
        canvas.line([x, bottom], [x, bottom + 4.0], Stroke::solid(FAINT_INK, 1.0));
        let style = text(SMALL, Weight::Regular, FAINT_INK, Anchor::Middle);
        canvas.text([x, bottom + 18.0], number(tick), style);
    }
    let style = text(TITLE, Weight::Regular, FAINT_INK, Anchor::Start);
    canvas.text([16.0, PLOT.y - 16.0], &chart.y_name, style);
    let style = text(TITLE, Weight::Regular, FAINT_INK, Anchor::Middle);
    canvas.text([PLOT.x + PLOT.width / 2.0, PLOT.bottom() + 40.0], &chart.x_name, style);
}

fn draw_line(canvas: &mut Canvas, line: &Line, scale: &Scale, colour: Colour) {
    let points: Vec<[f64; 2]> = finite(line).map(|point| scale.place(point)).collect();
    for &centre in &points {
        canvas.circle(centre, 2.8, Some(colour), None);
    }
    let stroke = Some(Stroke::solid(colour, 2.0));
    canvas.shapes.push(Shape::Path { points, closed: false, fill: None, stroke });
}

/// Names at the right ends, in the order of the ends and not over each other.
fn draw_names(canvas: &mut Canvas, chart: &LineChart, scale: &Scale) {
    let ends = chart.lines.iter().enumerate().filter_map(|(number, line)| {
        Some((scale.place(finite(line).last()?)[1], &line.name, colour(number)))
    });
    let mut ends: Vec<_> = ends.collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let room = PLOT.bottom() - NAME_STEP * ends.len().saturating_sub(1) as f64;
    let mut lowest = f64::NEG_INFINITY;
    for (place, (y, name, colour)) in ends.into_iter().enumerate() {
        let y = y.min(room + NAME_STEP * place as f64).max(lowest + NAME_STEP);
        let style = text(SMALL, Weight::Medium, colour, Anchor::Start);
        canvas.text([PLOT.right() + 12.0, y + 4.0], name, style);
        lowest = y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(lines: &[(&str, &[[f64; 2]])]) -> LineChart {
        let lines =
            lines.iter().map(|&(name, points)| Line { name: name.into(), points: points.into() });
        LineChart { x_ticks: vec![0.0, 10.0], lines: lines.collect(), ..LineChart::default() }
    }

    #[test]
    fn corners_of_the_plot_are_the_extremes() {
        let scale = Scale::of(&chart(&[("a", &[[0.0, 80.0], [10.0, 100.0]])]));
        assert_eq!(scale.place([0.0, 80.0]), [PLOT.x, PLOT.bottom()]);
        assert_eq!(scale.place([10.0, 100.0]), [PLOT.right(), PLOT.y]);
        assert_eq!(scale.y_ticks().collect::<Vec<_>>(), [80.0, 85.0, 90.0, 95.0, 100.0]);
    }

    #[test]
    fn steps_are_round() {
        assert_eq!([7.0, 9.0, 30.0, 100.0, 0.6].map(tick_step), [1.0, 2.0, 5.0, 20.0, 0.1]);
    }

    #[test]
    fn names_of_lines_that_end_together_are_apart() {
        let ends: &[[f64; 2]] = &[[0.0, 90.0], [10.0, 80.0]];
        let page = line_chart(&chart(&[("one", ends), ("two", ends), ("three", ends)]));
        let heights: Vec<f64> = page
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Text { at, text, .. } if ["one", "two", "three"].contains(&&text[..]) => {
                    Some(at[1])
                }
                _ => None,
            })
            .collect();
        assert_eq!(heights.len(), 3);
        assert!(heights.windows(2).all(|pair| pair[1] - pair[0] >= NAME_STEP), "{heights:?}");
        assert!(heights[2] <= PLOT.bottom() + 4.0);
    }

    #[test]
    fn nothing_to_draw_is_a_page_with_axes() {
        let nothing = chart(&[("empty", &[]), ("odd", &[[f64::NAN, 1.0]])]);
        let page = line_chart(&nothing);
        assert!(page.shapes.iter().all(|shape| !matches!(shape, Shape::Circle { .. })));
    }
}
