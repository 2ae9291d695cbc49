//! What a figure shows: one clustered cloud with its heading, and a part of its range image.

use std::ops::Range;

use super::look::{Look, Theme};
use crate::error::{FigureError, Result};
use crate::messages::palette::instance_colour;
use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Class;
use divmerge_core::pipeline::Stages;
use divmerge_core::range_image::RangeImage;

/// One clustered cloud and what is written about it.
#[derive(Debug, Clone)]
pub struct FrameScene<'a> {
    /// The cloud.
    pub cloud: &'a PointCloud,
    /// Every intermediate of its run.
    pub stages: &'a Stages,
    /// Classes of the mask by number; empty where there are no classes.
    pub classes: &'a [Class],
    /// N: intensity, if the cloud has it.
    pub intensity: Option<&'a [f32]>,
    /// Two components merge where their share of votes in favour exceeds this.
    pub merge_ratio: f64,
    /// Colour number of instance k at k - 1; an instance without one has its id's colour.
    pub colour_numbers: Vec<u32>,
    /// Heading of the figure: the frame and its time.
    pub heading: String,
    /// Smaller text beside the heading: topic, parameters.
    pub remark: String,
    /// Which panels it is shown on.
    pub theme: Theme,
}

impl FrameScene<'_> {
    /// Colour of a final instance.
    pub fn colour(&self, instance: u32) -> [u8; 3] {
        let number = self.colour_numbers.get((instance as usize).wrapping_sub(1));
        instance_colour(number.copied().unwrap_or(instance))
    }

    /// The colours of its panels.
    pub(super) fn look(&self) -> &'static Look {
        self.theme.look()
    }

    /// Component of each pixel of the range image, 0 for none.
    pub fn component_of_pixel(&self) -> Vec<u32> {
        let image = &self.stages.image;
        let mut component = vec![0; image.rows() * image.columns()];
        for (&pixel, &label) in self.stages.objects.pixel.iter().zip(&self.stages.components.label)
        {
            component[pixel as usize] = label;
        }
        component
    }

    /// Distance of a point from the sensor in metres.
    pub(super) fn range(&self, point: usize) -> f64 {
        let [x, y, z] = self.cloud.position(point).map(f64::from);
        (x * x + y * y + z * z).sqrt()
    }

    /// The points that have a pixel in the range image.
    pub(super) fn seen_points(&self) -> impl Iterator<Item = usize> + '_ {
        let image = &self.stages.image;
        (0..image.rows() * image.columns()).filter_map(|pixel| image.point_at(pixel))
    }

    /// The part of the image with some pixels in its middle, for a panel of a shape (width over
    /// height). Pixels, each a row from the top and a column, have their shape on a whole image of
    /// an aspect (height over width); of a part that is wider they are narrower.
    pub(super) fn window_around(
        &self,
        pixels: impl Iterator<Item = [usize; 2]>,
        aspect: f64,
        shape: f64,
    ) -> Window {
        const LEAST_ROWS: usize = 24;
        let size = [self.stages.image.rows(), self.stages.image.columns()];
        let (mut low, mut high) = (size, [0, 0]);
        for pixel in pixels {
            low = [0, 1].map(|axis| low[axis].min(pixel[axis]));
            high = [0, 1].map(|axis| high[axis].max(pixel[axis]));
        }
        if low[0] > high[0] {
            (low, high) = ([0, 0], size.map(|side| side - 1));
        }
        // Columns to a row of the panel.
        let columns = shape * aspect * size[1] as f64 / size[0] as f64;
        let with_margin = |axis: usize| (high[axis] + 1 - low[axis]) as f64 * 1.3 + 2.0;
        let least = LEAST_ROWS.min(size[0]) as f64;
        let tall = with_margin(0).max(with_margin(1) / columns).max(least).min(size[0] as f64);
        let part = |axis: usize, length: f64| {
            let length = (length.round() as usize).clamp(1, size[axis]);
            let middle = (low[axis] + high[axis]) / 2;
            let start = middle.saturating_sub(length / 2).min(size[axis] - length);
            start..start + length
        };
        let wide = (tall * columns).max(with_margin(1));
        Window { rows: part(0, tall), columns: part(1, wide) }
    }

    /// Row from the top and column of each object pixel with its component; 0 for none.
    pub(super) fn object_pixels(&self) -> impl Iterator<Item = (usize, usize, u32)> + '_ {
        let Stages { image, objects, components, .. } = self.stages;
        objects.pixel.iter().zip(&components.label).map(|(&pixel, &label)| {
            let (row, column) =
                (pixel as usize / image.columns(), pixel as usize % image.columns());
            (row_from_top(image, row), column, label)
        })
    }
}

/// A row of the range image counted from the top of a panel, and the other way round.
pub(super) fn row_from_top(image: &RangeImage, row: usize) -> usize {
    if image.top_row_first { row } else { image.rows() - 1 - row }
}

/// Final instance of each component, component k at k - 1; 0 for one that became too small.
pub(super) fn instance_of_component(stages: &Stages) -> Vec<u32> {
    let mut instance = vec![0; stages.components.count as usize];
    for (object, &label) in stages.components.label.iter().enumerate() {
        if label == 0 {
            continue;
        }
        if let Some(point) = stages.image.point_at(stages.objects.pixel[object] as usize) {
            instance[label as usize - 1] = stages.labels.instance[point];
        }
    }
    instance
}

/// Mean position in metres of the pixels of each component and their number, component k at k - 1.
pub(super) fn component_centroids(stages: &Stages) -> Vec<([f64; 3], usize)> {
    let mut centroids = vec![([0.0; 3], 0); stages.components.count as usize];
    for (&label, position) in stages.components.label.iter().zip(&stages.objects.position) {
        if label != 0 {
            let (sum, count) = &mut centroids[label as usize - 1];
            for (sum, &value) in sum.iter_mut().zip(position) {
                *sum += f64::from(value);
            }
            *count += 1;
        }
    }
    for (centroid, count) in &mut centroids {
        *centroid = centroid.map(|sum| sum / (*count).max(1) as f64);
    }
    centroids
}

/// A part of the range image.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PixelCrop {
    /// Columns; none means all.
    pub columns: Option<Range<usize>>,
    /// Rows from the top; none means all.
    pub rows: Option<Range<usize>>,
}

/// A part of the range image that lies within it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Window {
    /// Columns.
    pub columns: Range<usize>,
    /// Rows from the top.
    pub rows: Range<usize>,
}

impl Window {
    /// Whether a pixel lies in this part; its row counts from the top.
    pub fn contains(&self, row: usize, column: usize) -> bool {
        self.rows.contains(&row) && self.columns.contains(&column)
    }
}

impl PixelCrop {
    /// The part within an image of that size.
    ///
    /// # Errors
    /// [`Error::Figure`](crate::error::Error::Figure) if there is none.
    pub fn within(&self, rows: usize, columns: usize) -> Result<Window> {
        let part = |wanted: &Option<Range<usize>>, size: usize, side| match wanted {
            None => Ok(0..size),
            Some(range) if range.start < range.end.min(size) => {
                Ok(range.start..range.end.min(size))
            }
            Some(range) => {
                Err(FigureError::OutsideImage { side, range: range.clone(), rows, columns })
            }
        };
        Ok(Window {
            columns: part(&self.columns, columns, "columns")?,
            rows: part(&self.rows, rows, "rows")?,
        })
    }

    /// Whether it is the whole image.
    pub fn is_all(&self) -> bool {
        self.columns.is_none() && self.rows.is_none()
    }
}

/// Place of each class among the things.
pub(super) fn thing_places(classes: &[Class]) -> Vec<usize> {
    let mut next = 0;
    let place = |class: &Class| {
        next += usize::from(class.is_thing);
        next.saturating_sub(1)
    };
    classes.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_are_cut_to_the_image() {
        let crop = PixelCrop { columns: Some(100..900), rows: None };
        let window = crop.within(64, 512).unwrap();
        assert_eq!(window, Window { columns: 100..512, rows: 0..64 });
        let outside = crop.within(64, 100).unwrap_err().to_string();
        assert!(outside.contains("columns 100..900") && outside.contains("64 x 100"), "{outside}");
        assert!(PixelCrop { columns: None, rows: Some(3..3) }.within(9, 9).is_err());
    }
}
