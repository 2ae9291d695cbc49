//! A line chart: how a figure changes with another, for several things side by side.

use super::canvas::{Anchor, Area, Canvas, Colour, Stroke, TextStyle};
use super::font::{Weight, width};
use super::numbers::{extent, round_steps, steps};
use super::plane::LabelSpots;
use super::theme::{self, FAINT_INK, PAGE, SMALL, TITLE};

/// What is drawn. Numbers that are not finite are left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LineChart {
    /// Above the chart.
    pub title: String,
    /// Below the horizontal axis.
    pub x_name: String,
    /// Above the vertical axis.
    pub y_name: String,
    /// Places on the horizontal axis with a number; none: round ones.
    pub x_ticks: Vec<f64>,
    /// Whether the horizontal axis is logarithmic; numbers not above 0 are then left out.
    pub is_log: bool,
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
const CHART_HEIGHT: f64 = 420.0;
/// Height of a title over several charts.
const TITLE_HEIGHT: f64 = 30.0;
const NAME_STEP: f64 = 15.0;
const RULE: Colour = [226, 228, 232, 255];

/// Draws a chart on a page of its own.
pub fn line_chart(chart: &LineChart) -> Canvas {
    let mut canvas = Canvas::new(chart_width(chart), CHART_HEIGHT, PAGE);
    draw(&mut canvas, chart, [0.0, 0.0]);
    canvas
}

/// Draws charts side by side under a title.
pub fn line_charts(title: &str, charts: &[LineChart]) -> Canvas {
    let width = charts.iter().map(chart_width).sum::<f64>().max(200.0);
    let mut canvas = Canvas::new(width, TITLE_HEIGHT + CHART_HEIGHT, PAGE);
    canvas.text([16.0, 26.0], title, theme::heading());
    let mut left = 0.0;
    for chart in charts {
        draw(&mut canvas, chart, [left, TITLE_HEIGHT]);
        left += chart_width(chart);
    }
    canvas
}

/// A line's name as it is written: with its number where points have numbers.
fn names(chart: &LineChart) -> Vec<String> {
    let numbered = has_numbers(chart);
    let name = |(number, line): (usize, &Line)| match numbered {
        true => format!("{}  {}", number + 1, line.name),
        false => line.name.clone(),
    };
    chart.lines.iter().enumerate().map(name).collect()
}

/// Lines of one point are told apart by numbers: colour alone says too little of a dot.
fn has_numbers(chart: &LineChart) -> bool {
    chart.lines.iter().any(|line| line.points.len() == 1)
}

/// How the lines are drawn: a colour for each method, and dashes where an earlier line has its
/// colour.
fn looks(chart: &LineChart) -> Vec<Stroke> {
    const DASHES: [Option<[f64; 2]>; 3] = [None, Some([6.0, 4.0]), Some([2.0, 3.0])];
    let names: Vec<&str> = chart.lines.iter().map(|line| line.name.as_str()).collect();
    let colours = theme::line_colours(&names);
    let look = |(place, &colour): (usize, &Colour)| {
        let before = colours[..place].iter().filter(|&&other| other == colour).count();
        Stroke { colour, width: 2.0, dash: DASHES[before.min(DASHES.len() - 1)] }
    };
    colours.iter().enumerate().map(look).collect()
}

fn chart_width(chart: &LineChart) -> f64 {
    let names = names(chart);
    let widths = names.iter().map(|name| width(name, SMALL, Weight::Medium));
    PLOT.right() + 14.0 + widths.fold(40.0, f64::max) + 16.0
}

fn draw(canvas: &mut Canvas, chart: &LineChart, [x, y]: [f64; 2]) {
    let plot = Area { x: PLOT.x + x, y: PLOT.y + y, ..PLOT };
    canvas.text([x + 16.0, y + 26.0], &chart.title, theme::heading());
    let scale = Scale::of(chart, plot);
    axes(canvas, chart, &scale);
    let looks = looks(chart);
    for (line, look) in chart.lines.iter().zip(&looks).rev() {
        draw_line(canvas, line, &scale, *look);
    }
    if has_numbers(chart) {
        draw_numbers(canvas, chart, &scale);
    }
    draw_names(canvas, chart, &scale);
}

/// From figures to places on the page.
struct Scale {
    plot: Area,
    is_log: bool,
    /// Of the logarithm where the axis is logarithmic.
    x: [f64; 2],
    y: [f64; 2],
    y_step: f64,
}

impl Scale {
    fn of(chart: &LineChart, plot: Area) -> Self {
        let is_log = chart.is_log;
        let points = || chart.lines.iter().flat_map(|line| shown(line, is_log));
        let along = |x: f64| if is_log { x.log10() } else { x };
        let ends = points().map(|p| p[0]).chain(chart.x_ticks.iter().copied()).map(along);
        let mut x = range(ends, 0.1);
        if chart.x_ticks.is_empty() {
            // A little room, so that no dot sits on the frame.
            let room = (x[1] - x[0]) * 0.06;
            x = [x[0] - room, x[1] + room];
        }
        let [low, high] = range(points().map(|p| p[1]), 1.0);
        let y_step = tick_step(high - low);
        let y = [(low / y_step).floor() * y_step, (high / y_step).ceil() * y_step];
        Scale { plot, is_log, x, y, y_step }
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let x = if self.is_log { x.log10() } else { x };
        let part = |value: f64, [low, high]: [f64; 2]| (value - low) / (high - low);
        let down = 1.0 - part(y, self.y);
        [self.plot.x + part(x, self.x) * self.plot.width, self.plot.y + down * self.plot.height]
    }

    fn places(&self, line: &Line) -> impl Iterator<Item = [f64; 2]> {
        shown(line, self.is_log).map(|point| self.place(point))
    }

    fn y_ticks(&self) -> impl Iterator<Item = f64> {
        steps(self.y, self.y_step)
    }

    /// Round places on the horizontal axis.
    fn x_ticks(&self) -> Vec<f64> {
        let [low, high] = self.x;
        if !self.is_log {
            return steps([low, high], tick_step(high - low)).collect();
        }
        let powers = low.floor() as i32..=high.ceil() as i32;
        let ticks = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(power)));
        ticks.filter(|tick| (low..=high).contains(&tick.log10())).collect()
    }
}

/// The points of a line that can be shown.
fn shown(line: &Line, is_log: bool) -> impl Iterator<Item = [f64; 2]> {
    let is_finite = |point: &[f64; 2]| point.iter().all(|value| value.is_finite());
    line.points.iter().copied().filter(move |point| is_finite(point) && (!is_log || point[0] > 0.0))
}

/// The extent of values, no narrower than `least`.
fn range(values: impl Iterator<Item = f64>, least: f64) -> [f64; 2] {
    extent(values).map_or([0.0, 1.0], |[low, high]| [low, high.max(low + least)])
}

/// 1, 2 or 5 times a power of ten, so that at most eight steps make the span.
fn tick_step(span: f64) -> f64 {
    let steps = round_steps(span / 8.0);
    steps.into_iter().find(|step| span / step <= 8.0).unwrap_or(steps[3])
}

/// Names and numbers of lines.
fn name_style(colour: Colour) -> TextStyle {
    theme::text(SMALL, Weight::Medium, colour, Anchor::Start)
}

fn axes(canvas: &mut Canvas, chart: &LineChart, scale: &Scale) {
    let plot = scale.plot;
    let number = |value: f64| format!("{}", (value * 100.0).round() / 100.0);
    for tick in scale.y_ticks() {
        let y = scale.place([scale.x[0], tick])[1];
        canvas.line([plot.x, y], [plot.right(), y], Stroke::solid(RULE, 1.0));
        canvas.text([plot.x - 8.0, y + 4.0], number(tick), theme::faint(Anchor::End));
    }
    let round = if chart.x_ticks.is_empty() { scale.x_ticks() } else { Vec::new() };
    for &tick in chart.x_ticks.iter().chain(&round) {
        let x = scale.place([tick, scale.y[0]])[0];
        let bottom = plot.bottom();
        canvas.line([x, bottom], [x, bottom + 4.0], Stroke::solid(FAINT_INK, 1.0));
        canvas.text([x, bottom + 18.0], number(tick), theme::faint(Anchor::Middle));
    }
    let style = |anchor| theme::text(TITLE, Weight::Regular, FAINT_INK, anchor);
    let y_name = [plot.x - PLOT.x + 16.0, plot.y - 16.0];
    canvas.text(y_name, &chart.y_name, style(Anchor::Start));
    let x_name = [plot.x + plot.width / 2.0, plot.bottom() + 40.0];
    canvas.text(x_name, &chart.x_name, style(Anchor::Middle));
}

fn draw_line(canvas: &mut Canvas, line: &Line, scale: &Scale, look: Stroke) {
    let points: Vec<[f64; 2]> = scale.places(line).collect();
    for &centre in &points {
        canvas.circle(centre, 2.8, Some(look.colour), None);
    }
    canvas.polyline(points, look);
}

/// Numbers beside the last points, clear of each other where there is room.
fn draw_numbers(canvas: &mut Canvas, chart: &LineChart, scale: &Scale) {
    /// Right and left of the point, above and below; the first is taken where none is free.
    const PLACES: [[f64; 2]; 4] = [[1.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [-1.0, 1.0]];
    const HEIGHT: f64 = 9.0;
    let plot = scale.plot;
    // The number of the uppermost point may stand above the plot.
    let page = Area { y: plot.y - 14.0, height: plot.height + 28.0, ..plot };
    let mut spots = LabelSpots::new(page, Vec::new());
    for (number, (line, look)) in (1..).zip(chart.lines.iter().zip(looks(chart))) {
        let Some([x, y]) = scale.places(line).last() else { continue };
        let words = f64::from(number).to_string();
        let width = width(&words, SMALL, Weight::Medium);
        let spot = |[right, down]: [f64; 2]| Area {
            x: x + right * (4.5 + width / 2.0) - width / 2.0,
            y: y + down * (1.5 + HEIGHT / 2.0) - HEIGHT / 2.0 - 1.5,
            width,
            height: HEIGHT,
        };
        let free = PLACES.map(spot).into_iter().find(|&spot| spots.take(spot));
        let spot = free.unwrap_or_else(|| spot(PLACES[0]));
        canvas.text([spot.x, spot.bottom()], words, name_style(look.colour));
    }
}

/// Names at the right ends, in the order of the ends and not over each other.
fn draw_names(canvas: &mut Canvas, chart: &LineChart, scale: &Scale) {
    let plot = scale.plot;
    let ends = chart.lines.iter().zip(names(chart)).zip(looks(chart));
    let ends = ends.filter_map(|((line, name), look)| {
        Some((scale.places(line).last()?[1], name, look.colour))
    });
    let mut ends: Vec<_> = ends.collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let room = plot.bottom() - NAME_STEP * ends.len().saturating_sub(1) as f64;
    let mut lowest = f64::NEG_INFINITY;
    for (place, (y, name, colour)) in ends.into_iter().enumerate() {
        let y = y.min(room + NAME_STEP * place as f64).max(lowest + NAME_STEP);
        let style = name_style(colour);
        canvas.text([plot.right() + 12.0, y + 4.0], name, style);
        lowest = y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::canvas::Drawing;

    fn chart(lines: &[(&str, &[[f64; 2]])]) -> LineChart {
        let lines =
            lines.iter().map(|&(name, points)| Line { name: name.into(), points: points.into() });
        LineChart { x_ticks: vec![0.0, 10.0], lines: lines.collect(), ..LineChart::default() }
    }

    #[test]
    fn corners_of_the_plot_are_the_extremes() {
        let scale = Scale::of(&chart(&[("a", &[[0.0, 80.0], [10.0, 100.0]])]), PLOT);
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
                Drawing::Text { at, text, .. } if ["one", "two", "three"].contains(&&text[..]) => {
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
    fn a_logarithmic_axis_has_round_ticks_and_leaves_out_zero() {
        let lines =
            vec![Line { name: "a".into(), points: vec![[0.0, 1.0], [0.3, 1.0], [20.0, 2.0]] }];
        let chart = LineChart { lines, is_log: true, ..LineChart::default() };
        let scale = Scale::of(&chart, PLOT);
        assert_eq!(scale.x_ticks(), [0.5, 1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(scale.places(&chart.lines[0]).count(), 2);
        let middle = scale.place([(0.3_f64 * 20.0).sqrt(), 1.0])[0];
        assert!((middle - (PLOT.x + PLOT.width / 2.0)).abs() < 1e-9);
    }

    #[test]
    fn dots_are_numbered() {
        let page = line_chart(&chart(&[("one", &[[1.0, 2.0]]), ("two", &[[5.0, 6.0]])]));
        let said = |wanted: &str| {
            page.shapes.iter().any(|s| matches!(s, Drawing::Text { text, .. } if text == wanted))
        };
        assert!(said("1") && said("2") && said("1  one") && said("2  two"));
    }

    #[test]
    fn numbers_of_dots_in_one_place_are_apart() {
        let dot: &[[f64; 2]] = &[[5.0, 6.0]];
        let page = line_chart(&chart(&[("one", dot), ("two", dot), ("three", dot)]));
        let is_number = |text: &str| ["1", "2", "3"].contains(&text);
        let places: Vec<[f64; 2]> = page
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                Drawing::Text { at, text, .. } if is_number(text) => Some(*at),
                _ => None,
            })
            .collect();
        assert_eq!(places.len(), 3);
        for (place, [x, y]) in places.iter().enumerate() {
            let beside = &places[place + 1..];
            assert!(beside.iter().all(|[a, b]| (a - x).abs() > 6.0 || (b - y).abs() >= 9.0));
        }
    }

    #[test]
    fn two_lines_of_a_method_have_one_colour_and_differ_in_their_dashes() {
        let ends: &[[f64; 2]] = &[[0.0, 90.0], [10.0, 80.0]];
        let looks = looks(&chart(&[("paper", ends), ("best", ends), ("paper, by voxel", ends)]));
        assert_eq!(looks[0].colour, looks[2].colour);
        assert!(looks[0].colour != looks[1].colour);
        assert!(looks[0].dash.is_none() && looks[2].dash.is_some());
    }

    #[test]
    fn nothing_to_draw_is_a_page_with_axes() {
        let nothing = chart(&[("empty", &[]), ("odd", &[[f64::NAN, 1.0]])]);
        let page = line_chart(&nothing);
        assert!(page.shapes.iter().all(|shape| !matches!(shape, Drawing::Circle { .. })));
    }
}
