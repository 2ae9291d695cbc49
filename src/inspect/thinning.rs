//! Fewer points of a cloud that is too large for a case.

use std::borrow::Cow;

use rustc_hash::FxHashMap;

use super::run::Run;
use divmerge_core::range_image::{NOWHERE, RangeImage};

/// The points of a cloud of N points that are kept.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Thinning {
    /// The points that are kept, ascending.
    points: Vec<usize>,
    /// N: the place of each among them, or [`NOWHERE`].
    place: Vec<u32>,
}

impl Thinning {
    /// Keeps one of so many returns of the background and of objects, each kind in the order of the
    /// range image, and some points always.
    pub fn new(run: &Run, [background, objects]: [usize; 2], always: &[usize]) -> Self {
        let (cloud, stages) = (&run.cloud.cloud, &run.stages);
        let mut returns: Vec<usize> = (0..cloud.len()).filter(|&p| cloud.is_return(p)).collect();
        returns.sort_by_key(|&point| (stages.image.pixel_of_point[point], point));
        let mut is_kept = vec![false; cloud.len()];
        let mut seen = [0; 2];
        for point in returns {
            let is_object = stages.mask.is_object[point] || stages.labels.instance[point] != 0;
            let kind = usize::from(is_object);
            is_kept[point] = seen[kind] % [background, objects][kind] == 0;
            seen[kind] += 1;
        }
        always.iter().for_each(|&point| is_kept[point] = true);
        Thinning::of_flags(&is_kept)
    }

    fn of_flags(is_kept: &[bool]) -> Self {
        let points: Vec<usize> = (0..is_kept.len()).filter(|&point| is_kept[point]).collect();
        let mut place = vec![NOWHERE; is_kept.len()];
        for (number, &point) in (0..).zip(&points) {
            place[point] = number;
        }
        Thinning { points, place }
    }

    /// How many points are kept.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// The place of a point among those that are kept.
    pub fn place(&self, point: usize) -> Option<usize> {
        let place = *self.place.get(point)?;
        (place != NOWHERE).then_some(place as usize)
    }

    /// The place of a point that stands for another: itself, or the first with its labels.
    pub fn stand_in(&self, point: usize, labels: [&[u32]; 2]) -> Option<usize> {
        let of = |point: usize| labels.map(|labels| labels[point]);
        let like = || self.points.iter().position(|&kept| of(kept) == of(point));
        self.place(point).or_else(like)
    }

    /// For each pixel the place of its point, or of the next in its row with the same instance.
    fn point_of_pixel(&self, image: &RangeImage, instance: &[u32]) -> Vec<u32> {
        let all = image.point_of_pixel.values();
        let place = |&point: &u32| self.place(point as usize).map_or(NOWHERE, |at| at as u32);
        let mut places: Vec<u32> = all.iter().map(place).collect();
        let columns = image.columns();
        for row in 0..image.rows() {
            let pixels = row * columns..(row + 1) * columns;
            fill(&mut places, pixels.clone(), (all, instance));
            fill(&mut places, pixels.rev(), (all, instance));
        }
        places
    }
}

/// Gives pixels without a place that of the last pixel with the same instance.
fn fill(
    places: &mut [u32],
    pixels: impl Iterator<Item = usize>,
    (points, instance): (&[u32], &[u32]),
) {
    let mut last: FxHashMap<u32, u32> = FxHashMap::default();
    for pixel in pixels.filter(|&pixel| points[pixel] != NOWHERE) {
        let id = instance[points[pixel] as usize];
        match places[pixel] {
            NOWHERE => places[pixel] = last.get(&id).copied().unwrap_or(NOWHERE),
            place => drop(last.insert(id, place)),
        }
    }
}

/// Steps of a metre to which positions are rounded where they are coarse.
const STEPS: f32 = 128.0;

/// How much of a cloud is told.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Detail {
    /// Whether positions are rounded to 1/128 m, and intensities to 1/128 of the brightest.
    pub is_coarse: bool,
    /// Whether there are intensities.
    pub has_intensity: bool,
    /// The points that are kept; all if there is nothing here.
    pub thinning: Option<Thinning>,
}

impl Detail {
    /// Everything.
    pub const WHOLE: Detail = Detail { is_coarse: false, has_intensity: true, thinning: None };

    /// The values of the points that are kept.
    pub fn of<'a, T: Copy>(&self, all: &'a [T]) -> Cow<'a, [T]> {
        match &self.thinning {
            None => Cow::Borrowed(all),
            Some(Thinning { points, .. }) => points.iter().map(|&point| all[point]).collect(),
        }
    }

    /// The points that are kept, of so many.
    pub fn points(&self, count: usize) -> Vec<usize> {
        self.thinning.as_ref().map_or_else(|| (0..count).collect(), |own| own.points.clone())
    }

    /// For each pixel its point, by its place among those that are kept.
    pub fn point_of_pixel<'a>(&self, image: &'a RangeImage, instance: &[u32]) -> Cow<'a, [u32]> {
        match &self.thinning {
            None => Cow::Borrowed(image.point_of_pixel.values()),
            Some(thinning) => Cow::Owned(thinning.point_of_pixel(image, instance)),
        }
    }

    /// A value, coarse if that is asked for; `unit` is divided into 128 steps.
    pub fn rounded(&self, value: f32, unit: f32) -> f32 {
        match self.is_coarse {
            true => (value / unit * STEPS).round() / STEPS * unit,
            false => value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_that_is_kept_stands_for_those_that_are_not() {
        let kept = Thinning::of_flags(&[true, false, false, true, false]);
        assert_eq!((kept.len(), kept.place(3), kept.place(1)), (2, Some(1), None));
        let (ids, other) = ([0, 7, 7, 7, 8], [1, 1, 1, 1, 1]);
        assert_eq!(kept.stand_in(0, [&ids, &other]), Some(0));
        assert_eq!(kept.stand_in(1, [&ids, &other]), Some(1));
        assert_eq!(kept.stand_in(4, [&ids, &other]), None);
        let mut places = vec![0, NOWHERE, NOWHERE, 1, NOWHERE];
        fill(&mut places, 0..5, (&[0, 1, 2, 3, 4], &ids));
        fill(&mut places, (0..5).rev(), (&[0, 1, 2, 3, 4], &ids));
        assert_eq!(places, [0, 1, 1, 1, NOWHERE]);
    }

    #[test]
    fn coarse_values_are_near() {
        let coarse = Detail { is_coarse: true, ..Detail::WHOLE };
        for value in [0.0, -17.123_4, 99.999, 1e30] {
            let away = (coarse.rounded(value, 1.0) - value).abs();
            assert!(away <= 0.5 / STEPS, "{value}: {away}");
        }
        assert!(coarse.rounded(f32::NAN, 1.0).is_nan());
        assert_eq!(Detail::WHOLE.rounded(17.123_4, 1.0), 17.123_4);
    }
}
