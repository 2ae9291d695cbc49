//! Azimuth and elevation of the range image, as its returns show them: organised clouds have no
//! other measure of what their rows and columns are.

use std::f64::consts::{PI, TAU};

use super::axes::{self, Tick, are_apart, number};
use super::canvas::{Area, Canvas};
use super::numbers::quantile;
use super::scene::{FrameScene, Window, row_from_top};
use divmerge_core::range_image::RangeImage;

/// Steps of ticks, degrees.
const STEPS: [f64; 11] = [0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0];
/// Least distance of ticks with numbers below a panel and beside it, page units.
const APART: [f64; 2] = [48.0, 14.0];

/// The directions of rows and columns as seen from the sensor, about its upright axis; azimuth
/// counter-clockwise from its x axis.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageAxes {
    /// Azimuth of the middle of column 0, and from one column to the next, degrees.
    azimuth: [f64; 2],
    /// Elevation of the middle of each row from the top, degrees, falling; `None` without returns.
    elevation: Vec<Option<f64>>,
}

impl ImageAxes {
    /// `None` where rows are not of falling elevation, columns not of even steps of azimuth, or
    /// several sensors made the image.
    pub fn of(scene: &FrameScene) -> Option<Self> {
        let image = &scene.stages.image;
        let [_] = &image.bands[..] else { return None };
        let direction = |row: usize, column: usize| {
            let point = image.point_at(row * image.columns() + column)?;
            Some(image.bands[0].in_sensor(scene.cloud.position(point)))
        };
        let azimuth = fitted(&azimuths(image, &direction))?;
        let rows = (0..image.rows()).map(|row| row_from_top(image, row));
        let elevation = falling(rows.map(|row| elevation(image, row, &direction)).collect())?;
        Some(ImageAxes { azimuth, elevation })
    }

    /// Draws them around a panel with a part of the image.
    pub fn draw(&self, canvas: &mut Canvas, window: &Window, area: Area, has_azimuths: bool) {
        axes::below(canvas, area, &self.along(window, area.width), has_azimuths);
        axes::beside(canvas, area, &self.down(window, area.height));
    }

    /// Ticks of azimuth along a panel of a width.
    pub fn along(&self, window: &Window, width: f64) -> Vec<Tick> {
        let [first, step] = self.azimuth;
        let per_column = width / window.columns.len() as f64;
        // The middle of column 0 on the panel.
        let start = (0.5 - window.columns.start as f64) * per_column;
        let place = |degrees: f64| start + (degrees - first) / step * per_column;
        let at_end = |at: f64| first + (at - start) / per_column * step;
        let ends = [at_end(0.0), at_end(width)];
        let words = |degrees: f64| {
            let turned = if degrees.abs() <= 180.0 {
                degrees
            } else {
                (degrees + 180.0).rem_euclid(360.0) - 180.0
            };
            format!("{}°", number(turned))
        };
        chosen(ends, APART[0], |degrees| Some(Tick { at: place(degrees), words: words(degrees) }))
    }

    /// Ticks of elevation down a panel of a height.
    pub fn down(&self, window: &Window, height: f64) -> Vec<Tick> {
        let per_row = height / window.rows.len() as f64;
        let known: Vec<[f64; 2]> = window
            .rows
            .clone()
            .filter_map(|row| Some([(row - window.rows.start) as f64 + 0.5, self.elevation[row]?]))
            .collect();
        let ([Some(first), Some(last)], true) = ([known.first(), known.last()], known.len() > 1)
        else {
            return Vec::new();
        };
        let place = |degrees: f64| {
            let pair = known.windows(2).find(|two| two[0][1] >= degrees && degrees >= two[1][1])?;
            let [[upper, above], [lower, below]] = [pair[0], pair[1]];
            let part = if above > below { (above - degrees) / (above - below) } else { 0.0 };
            Some((upper + (lower - upper) * part) * per_row)
        };
        chosen([first[1], last[1]], APART[1], |degrees| {
            Some(Tick { at: place(degrees)?, words: format!("{}°", number(degrees)) })
        })
    }
}

/// Draws the axes of a panel with a part of the image, if it has some, and its frame.
pub fn draw(canvas: &mut Canvas, scene: &FrameScene, window: &Window, area: Area) {
    axes::frame(canvas, area);
    if let Some(axes) = ImageAxes::of(scene) {
        axes.draw(canvas, window, area, true);
    }
}

/// The ticks of the smallest step at which they are `least` page units apart.
fn chosen(ends: [f64; 2], least: f64, tick: impl Fn(f64) -> Option<Tick>) -> Vec<Tick> {
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let of_step = |step: f64| {
        let numbers = (low / step).ceil() as i64..=(high / step).floor() as i64;
        let mut ticks: Vec<Tick> = numbers.filter_map(|k| tick(k as f64 * step)).collect();
        ticks.sort_by(|a, b| a.at.total_cmp(&b.at));
        ticks
    };
    let fits = |ticks: &Vec<Tick>| are_apart(ticks, least);
    STEPS
        .into_iter()
        .filter(|step| (high - low) / step < 1000.0)
        .map(of_step)
        .find(fits)
        .unwrap_or_default()
}

/// Mean azimuth of each column with returns, degrees, from one to the next without a jump.
fn azimuths(
    image: &RangeImage,
    direction: &impl Fn(usize, usize) -> Option<[f64; 3]>,
) -> Vec<[f64; 2]> {
    let mut found: Vec<[f64; 2]> = Vec::new();
    let mut last = 0.0;
    for column in 0..image.columns() {
        let mut sum = [0.0; 2];
        for [x, y, _] in (0..image.rows()).filter_map(|row| direction(row, column)) {
            let across = x.hypot(y);
            if across > 0.0 && across.is_finite() {
                sum = [sum[0] + x / across, sum[1] + y / across];
            }
        }
        if sum != [0.0; 2] {
            let angle = sum[1].atan2(sum[0]);
            // The first is that of the left end, of half a turn or less.
            let turns = if found.is_empty() { 0.0 } else { ((last - angle) / TAU).round() };
            last = angle + turns * TAU;
            found.push([column as f64, last.to_degrees()]);
        }
    }
    // A left end that looks backwards begins at 180, whichever side its first return is of.
    let is_reversed = found
        .first()
        .zip(found.last())
        .is_some_and(|(a, b)| a[1] < -PI.to_degrees() * 0.9 && b[1] < a[1]);
    if is_reversed {
        found.iter_mut().for_each(|[_, degrees]| *degrees += 360.0);
    }
    found
}

/// The line through azimuths by the least squares; `None` if they are not on one.
fn fitted(azimuths: &[[f64; 2]]) -> Option<[f64; 2]> {
    /// How far an azimuth may be off the line, degrees, and how many may be farther.
    const OFF: f64 = 1.5;
    const FARTHER: f64 = 0.05;
    let count = azimuths.len() as f64;
    let mean = [0, 1].map(|axis| azimuths.iter().map(|one| one[axis]).sum::<f64>() / count);
    let about = |one: &[f64; 2]| [one[0] - mean[0], one[1] - mean[1]];
    let [mut both, mut square] = [0.0; 2];
    for [column, degrees] in azimuths.iter().map(about) {
        both += column * degrees;
        square += column * column;
    }
    let step = both / square;
    let is_off = |one: &&[f64; 2]| {
        let [column, degrees] = about(one);
        (degrees - step * column).abs() > OFF
    };
    let off = azimuths.iter().filter(is_off).count() as f64;
    let is_line = step.is_finite() && step != 0.0 && count >= 8.0 && off <= FARTHER * count;
    is_line.then_some([mean[1] - step * mean[0], step])
}

/// Median elevation of a row, degrees.
fn elevation(
    image: &RangeImage,
    row: usize,
    direction: &impl Fn(usize, usize) -> Option<[f64; 3]>,
) -> Option<f64> {
    let seen = (0..image.columns()).filter_map(|column| direction(row, column));
    let angles: Vec<f64> = seen.map(|[x, y, z]| z.atan2(x.hypot(y)).to_degrees()).collect();
    (!angles.is_empty()).then(|| quantile(angles.into_iter(), 0.5))
}

/// Elevations without the few that are above the row before; `None` if more are.
fn falling(mut elevations: Vec<Option<f64>>) -> Option<Vec<Option<f64>>> {
    /// Share of the rows that may be out of order.
    const RISING: f64 = 0.15;
    let mut rising = 0;
    let mut last = f64::INFINITY;
    for found in elevations.iter_mut().flatten() {
        rising += usize::from(*found > last);
        *found = found.min(last);
        last = *found;
    }
    let known = elevations.iter().flatten().count();
    (known > 1 && rising as f64 <= RISING * known as f64).then_some(elevations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Theme;

    fn axes() -> ImageAxes {
        // A turn of 360 columns from behind over the left, and four rows.
        ImageAxes {
            azimuth: [179.5, -1.0],
            elevation: [2.0, -2.0, -10.0, -20.0].map(Some).to_vec(),
        }
    }

    fn read(ticks: &[Tick]) -> Vec<(i64, &str)> {
        ticks.iter().map(|tick| (tick.at.round() as i64, tick.words.as_str())).collect()
    }

    #[test]
    fn left_is_positive_and_ahead_is_the_middle() {
        let all = Window { rows: 0..4, columns: 0..360 };
        let ticks = axes().along(&all, 360.0);
        let expected = [
            (0, "180°"),
            (60, "120°"),
            (120, "60°"),
            (180, "0°"),
            (240, "−60°"),
            (300, "−120°"),
            (360, "−180°"),
        ];
        assert_eq!(read(&ticks), expected);
        let part = Window { rows: 0..4, columns: 170..190 };
        assert_eq!(
            read(&axes().along(&part, 200.0)),
            [(0, "10°"), (50, "5°"), (100, "0°"), (150, "−5°"), (200, "−10°")]
        );
    }

    #[test]
    fn elevation_lies_between_rows() {
        let all = Window { rows: 0..4, columns: 0..360 };
        // Rows are 100 high: their middles are at 50, 150, 250 and 350.
        let ticks = axes().down(&all, 400.0);
        let expected = [(50, "2°"), (100, "0°"), (150, "−2°"), (175, "−4°"), (200, "−6°")];
        assert_eq!(read(&ticks)[..5], expected);
        assert_eq!(read(&ticks).last(), Some(&(350, "−20°")));
        let expected = [(25, "0°"), (63, "−10°"), (88, "−20°")];
        assert_eq!(read(&axes().down(&all, 100.0)), expected);
        let one = Window { rows: 1..2, columns: 0..360 };
        assert_eq!(axes().down(&one, 400.0), []);
    }

    #[test]
    fn what_is_no_line_or_does_not_fall_has_no_axis() {
        let even: Vec<[f64; 2]> =
            (0..90).map(|k| [f64::from(k), 180.0 - 4.0 * f64::from(k)]).collect();
        let [first, step] = fitted(&even).unwrap();
        assert!((first - 180.0).abs() < 1e-9 && (step + 4.0).abs() < 1e-9);
        let there_and_back =
            even.iter().map(|&[k, degrees]| [k, degrees.abs()]).collect::<Vec<_>>();
        assert_eq!(fitted(&there_and_back), None);
        assert_eq!(falling([3.0, 1.0, 2.0, 0.0].map(Some).to_vec()), None);
        assert_eq!(falling(vec![None, Some(1.0)]), None);
    }

    #[test]
    fn a_simulated_turn_has_the_directions_of_its_sensor() {
        use divmerge_core::pipeline::{Config, run};
        use divmerge_core::semantics::MaskSource;
        use divmerge_simulate::{Drive, Scene, Sensor};
        let frame = Drive::new(Sensor::Vlp16, Scene::Street, 1).frame(0);
        let stages = run(&frame.cloud, MaskSource::All, &Config::best());
        let scene = FrameScene {
            cloud: &frame.cloud,
            stages: &stages,
            classes: &[],
            intensity: None,
            merge_ratio: 0.5,
            colour_numbers: Vec::new(),
            heading: String::new(),
            remark: String::new(),
            theme: Theme::default(),
        };
        let axes = ImageAxes::of(&scene).unwrap();
        let columns = stages.image.columns() as f64;
        assert!((axes.azimuth[1] * columns + 360.0).abs() < 1.0, "{axes:?}");
        assert!((axes.azimuth[0] - 180.0).abs() < 1.0, "{axes:?}");
        let ends = [axes.elevation[0], axes.elevation[15]].map(Option::unwrap);
        assert!((ends[0] - 15.0).abs() < 0.5 && (ends[1] + 15.0).abs() < 0.5, "{ends:?}");
    }
}
