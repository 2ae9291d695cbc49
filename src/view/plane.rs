//! The bird's-eye plane on a page: x to the right, y up, the same scale along both.

use super::axes::Tick;
use super::canvas::{Anchor, Area, Canvas, Raster, Stroke, between, opaque};
use super::numbers::{extent, quantile, round_steps, steps};
use super::range_panel::backdrop;
use super::scene::{FrameScene, Window};
use super::{axes, theme};
use divmerge_core::geometry::footprint::Rectangle;

/// A part of the plane in metres, sensor frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneRegion {
    /// Least and greatest x.
    pub x: [f64; 2],
    /// Least and greatest y.
    pub y: [f64; 2],
}

impl PlaneRegion {
    /// Around all but the most remote of some points, to whole multiples of `step` metres and no
    /// smaller than `least` metres.
    pub fn around(points: &[[f64; 2]], step: f64, least: f64) -> Self {
        PlaneRegion::by_axis(points, |values| {
            let low = quantile(values.iter().copied(), 0.01);
            let high = quantile(values.iter().copied(), 0.99);
            let least = least.max(resolution([low, high]));
            let short = (least - (high - low)).max(0.0) / 2.0;
            [((low - short) / step).floor() * step, ((high + short) / step).ceil() * step]
        })
    }

    /// Around all of some points with a margin, and no smaller than `least` metres.
    pub fn whole(points: &[[f64; 2]], margin: f64, least: f64) -> Self {
        PlaneRegion::by_axis(points, |values| {
            let [low, high] = extent(values.iter().copied()).unwrap_or([0.0; 2]);
            let least = least.max(resolution([low, high]));
            let more = margin.max((least - (high - low)) / 2.0);
            [low - more, high + more]
        })
    }

    fn by_axis(points: &[[f64; 2]], span: impl Fn(&[f64]) -> [f64; 2]) -> Self {
        let [x, y] = [0, 1].map(|axis| points.iter().map(|point| point[axis]).collect::<Vec<_>>());
        PlaneRegion { x: span(&x), y: span(&y) }
    }

    /// Width over height.
    pub fn aspect(&self) -> f64 {
        (self.x[1] - self.x[0]) / (self.y[1] - self.y[0])
    }

    /// The part of the plane with the objects of a window; with the sensor too if the window is the
    /// whole image.
    pub fn of_objects(scene: &FrameScene, window: &Window, is_all: bool) -> Self {
        let inside = scene.object_pixels().zip(&scene.stages.objects.position);
        let mut points: Vec<[f64; 2]> = inside
            .filter(|&((row, column, _), _)| window.contains(row, column))
            .map(|(_, &[x, y, _])| [f64::from(x), f64::from(y)])
            .collect();
        if is_all {
            // As many as the quantiles would otherwise pass over.
            points.extend(std::iter::repeat_n([0.0; 2], points.len() / 50 + 1));
        }
        let [step, least] = if is_all { [2.0, 10.0] } else { [1.0, 6.0] };
        PlaneRegion::around(&points, step, least)
    }
}

/// The width in metres below which a region between two coordinates shows nothing: eight steps of
/// single precision, in which clouds are stored. Far enough from the origin it is more than any
/// fixed width, which rounding would reduce to none.
fn resolution(ends: [f64; 2]) -> f64 {
    const STEPS: f64 = 8.0;
    STEPS * f64::from(f32::EPSILON) * ends.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// A region laid out in an area of a page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Where on the page.
    pub area: Area,
    /// Page units to the metre.
    pub scale: f64,
    centre: [f64; 2],
}

impl Plane {
    /// The region in the middle of the area, as large as fits.
    pub fn new(area: Area, region: &PlaneRegion) -> Self {
        let sides = [region.x[1] - region.x[0], region.y[1] - region.y[0]];
        let scale = (area.width / sides[0]).min(area.height / sides[1]);
        let centre = [region.x[0] + sides[0] / 2.0, region.y[0] + sides[1] / 2.0];
        Plane { area, scale, centre }
    }

    /// The place on the page of a place in metres.
    pub fn to_page(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let middle = [self.area.x + self.area.width / 2.0, self.area.y + self.area.height / 2.0];
        [
            middle[0] + (x - self.centre[0]) * self.scale,
            middle[1] - (y - self.centre[1]) * self.scale,
        ]
    }

    /// Whether a place in metres is in view.
    pub fn shows(&self, place: [f64; 2]) -> bool {
        let [x, y] = self.to_page(place);
        self.area.holds(&Area { x, y, width: 0.0, height: 0.0 })
    }

    /// The cloud from above, `density` pixels to the page unit: objects over the other returns.
    pub fn points(
        &self,
        canvas: &mut Canvas,
        scene: &FrameScene,
        density: f64,
        colour: impl Fn(usize) -> [u8; 3],
    ) {
        let [width, height] = [self.area.width, self.area.height]
            .map(|side| ((side * density).round() as usize).max(1));
        let panel = scene.look().panel;
        let mut raster = Raster::filled(width, height, panel);
        let mut dot = |point: usize, side: usize, colour: [u8; 3]| {
            let [x, y, _] = scene.cloud.position(point).map(f64::from);
            let page = self.to_page([x, y]);
            let corner = [page[0] - self.area.x, page[1] - self.area.y]
                .map(|c| (c * density - (side - 1) as f64 / 2.0).floor());
            if corner[0] >= 0.0 && corner[1] >= 0.0 {
                raster.fill_square(corner.map(|c| c as usize), side, colour);
            }
        };
        // Larger dots where there are few to the page unit.
        let size = (self.scale * 0.02).clamp(0.8, 2.2);
        let side = (density * size).round().max(1.0) as usize;
        let is_object = |point: usize| scene.stages.mask.is_object[point];
        let is_other = |&point: &usize| scene.cloud.is_return(point) && !is_object(point);
        for point in (0..scene.cloud.len()).filter(is_other) {
            dot(point, side, between(panel, backdrop(scene, point), 0.55));
        }
        let side = (density * size * 1.35).round().max(1.0) as usize;
        for point in (0..scene.cloud.len()).filter(|&point| is_object(point)) {
            dot(point, side, colour(point));
        }
        canvas.picture(self.area, raster);
    }

    /// The sensor, circles around it at the distances of the axes, and the axes.
    pub fn furniture(&self, canvas: &mut Canvas) {
        let spacing = self.step();
        let corners = [
            [self.area.x, self.area.y],
            [self.area.right(), self.area.y],
            [self.area.right(), self.area.bottom()],
            [self.area.x, self.area.bottom()],
        ];
        let sensor = self.to_page([0.0, 0.0]);
        let reach = corners.map(|[x, y]| (x - sensor[0]).hypot(y - sensor[1]));
        let reach = reach.into_iter().fold(0.0, f64::max) / self.scale;
        let look = canvas.look();
        canvas.clipped(self.area, |canvas| {
            for ring in 1..=(reach / spacing).min(40.0) as usize {
                let radius = ring as f64 * spacing * self.scale;
                canvas.circle(sensor, radius, None, Some(Stroke::solid(look.guide, 0.6)));
            }
            // An arrow head that points forward.
            let tip = [[7.0, 0.0], [-4.0, 4.5], [-2.0, 0.0], [-4.0, -4.5]];
            let tip = tip.map(|[x, y]| [sensor[0] + x, sensor[1] + y]);
            let rim = Stroke::solid(opaque(look.panel), 1.0);
            canvas.polygon(tip.to_vec(), Some(look.on_panel), Some(rim));
        });
        self.axes(canvas);
    }

    /// Metres below the panel and beside it.
    pub fn axes(&self, canvas: &mut Canvas) {
        axes::frame(canvas, self.area);
        let [left, top] = [self.area.x, self.area.y];
        let [right, bottom] = [self.area.right(), self.area.bottom()];
        let ticks = |axis: usize, ends: [f64; 2], place: &dyn Fn(f64) -> f64| {
            let half = (ends[1] - ends[0]) / 2.0 / self.scale;
            let ends = [self.centre[axis] - half, self.centre[axis] + half];
            let tick = |metres: f64| Tick { at: place(metres), words: axes::number(metres) };
            steps(ends, self.step()).map(tick).collect::<Vec<Tick>>()
        };
        let [x, y] = self.centre;
        let along = ticks(0, [left, right], &|metres| self.to_page([metres, y])[0] - left);
        let down = ticks(1, [top, bottom], &|metres| self.to_page([x, metres])[1] - top);
        axes::below(canvas, self.area, &along, true);
        axes::beside(canvas, self.area, &down);
        axes::unit(canvas, self.area, "m");
    }

    /// From one tick to the next, metres.
    fn step(&self) -> f64 {
        /// Least distance of two ticks on the page.
        const APART: f64 = 40.0;
        round_up(APART / self.scale)
    }

    /// A remark in the lower left corner.
    pub fn note(&self, canvas: &mut Canvas, words: &str) {
        let look = canvas.look();
        let style = look.label(theme::SMALL, look.on_panel, Anchor::Start);
        canvas.text([self.area.x + 6.0, self.area.bottom() - 7.0], words, style);
    }

    /// A box from above.
    pub fn rectangle(&self, canvas: &mut Canvas, rectangle: &Rectangle, stroke: Stroke) {
        let corners = rectangle.corners().map(|corner| self.to_page(corner));
        canvas.polygon(corners.to_vec(), None, Some(stroke));
    }
}

/// The least of 1, 2, 5, 10, 20 ... and their tenths, hundredths ... from a length on.
fn round_up(length: f64) -> f64 {
    if !(length.is_finite() && length > 0.0) {
        return 1.0;
    }
    let steps = round_steps(length);
    steps.into_iter().find(|&step| step >= length).unwrap_or(steps[3])
}

/// Places for labels on a panel, so that none covers another.
#[derive(Debug, Clone)]
pub struct LabelSpots {
    area: Area,
    taken: Vec<Area>,
}

impl LabelSpots {
    /// A panel on which the areas of `taken` are to stay free of labels.
    pub fn new(area: Area, taken: Vec<Area>) -> Self {
        LabelSpots { area, taken }
    }

    /// Takes a spot if it lies on the panel and is free.
    pub fn take(&mut self, spot: Area) -> bool {
        let is_free = self.area.holds(&spot) && !self.taken.iter().any(|other| other.meets(&spot));
        if is_free {
            self.taken.push(spot);
        }
        is_free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_axes_are_round() {
        assert_eq!(
            [0.07, 0.7, 1.0, 3.9, 9.9, 12.0, 64.0].map(round_up),
            [0.1, 1.0, 1.0, 5.0, 10.0, 20.0, 100.0]
        );
        assert_eq!([0.0, -1.0, f64::NAN].map(round_up), [1.0; 3]);
    }

    #[test]
    fn forward_is_right_and_left_is_up() {
        let area = Area { x: 10.0, y: 20.0, width: 200.0, height: 100.0 };
        let plane = Plane::new(area, &PlaneRegion { x: [-10.0, 10.0], y: [-10.0, 10.0] });
        assert_eq!(plane.scale, 5.0);
        assert_eq!(plane.to_page([0.0, 0.0]), [110.0, 70.0]);
        assert_eq!(plane.to_page([10.0, 10.0]), [160.0, 20.0]);
        assert!(plane.shows([19.9, 0.0]) && !plane.shows([0.0, 10.1]));
    }

    #[test]
    fn regions_have_a_size_even_around_nothing() {
        let region = PlaneRegion::around(&[], 5.0, 20.0);
        assert_eq!(region, PlaneRegion { x: [-10.0, 10.0], y: [-10.0, 10.0] });
    }

    #[test]
    fn regions_have_a_size_however_far_off_they_lie() {
        for far in [1e7, 1e19, -1e30, f64::from(f32::MAX)] {
            for points in [vec![[far, far]], vec![[0.0, far]], vec![[-far, far], [far, far]]] {
                let regions =
                    [PlaneRegion::around(&points, 1.0, 6.0), PlaneRegion::whole(&points, 1.0, 6.0)];
                for region in regions {
                    let is_wide = [region.x, region.y].iter().all(|[low, high]| high > low);
                    assert!(is_wide && region.aspect().is_normal(), "{points:?}: {region:?}");
                    let area = Area { x: 0.0, y: 0.0, width: 100.0, height: 100.0 };
                    let plane = Plane::new(area, &region);
                    // Those at the ends of a region lie on the border, up to rounding.
                    let is_in_view = |&point: &[f64; 2]| {
                        plane.to_page(point).iter().all(|at| (-1.0..=101.0).contains(at))
                    };
                    assert!(points.iter().all(is_in_view), "{points:?}");
                }
            }
        }
    }

    #[test]
    fn a_spot_is_taken_once_and_only_on_the_panel() {
        let area = Area { x: 0.0, y: 0.0, width: 10.0, height: 10.0 };
        let mut spots = LabelSpots::new(area, Vec::new());
        let spot = Area { width: 3.0, height: 3.0, ..area };
        assert!(spots.take(spot) && !spots.take(spot));
        assert!(spots.take(Area { x: 7.0, ..spot }) && !spots.take(Area { y: 8.0, ..spot }));
    }
}
