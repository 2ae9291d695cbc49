//! The range image of a cloud.

use rerun::components::{Colormap, ImageFormat, ValueRange};
use rerun::{AsComponents, ChannelDatatype, RecordingStreamResult, archetypes};

use super::frame::FrameLogger;
use super::names::{reason_id, shown_id};
use crate::annotate::ClusteredFrame;
use crate::view::scene::row_from_top;
use divmerge_core::range_image::RangeImage;

/// Steps of the range image per metre.
const RANGE_STEPS: f32 = 200.0;
/// Width of a range image over its height, as in figures: pixels are drawn higher than wide.
const SHAPE: f32 = 8.0;

/// How much higher than wide the pixels are drawn.
pub fn stretch(image: &RangeImage) -> f32 {
    (image.columns() as f32 / SHAPE / image.rows() as f32).max(1.0)
}

impl FrameLogger<'_> {
    /// Logs the range image by range, component, instance and reason. The colours of ranges end
    /// `far` metres away.
    pub fn log_images(&self, far: f64) -> RecordingStreamResult<()> {
        let ClusteredFrame { cloud, stages, .. } = *self.frame;
        let (image, labels) = (&stages.image, &stages.labels);
        let size = [image.columns() as u32, image.rows() as u32];
        let range = self.pixels(|point| {
            let steps = cloud.squared_range(point).sqrt() as f32 * RANGE_STEPS;
            steps.round().min(f32::from(u16::MAX)) as u16
        });
        let range = archetypes::DepthImage::from_gray16(range, size)
            .with_meter(RANGE_STEPS)
            .with_colormap(Colormap::Turbo)
            .with_depth_range(ValueRange::new(0.0, far * f64::from(RANGE_STEPS)));
        self.log_stretched("image/range", &range)?;
        let format = ImageFormat::segmentation(size, ChannelDatatype::U16);
        let log = |below: &str, id: &dyn Fn(usize) -> u16| {
            let image = archetypes::SegmentationImage::new(self.pixels(id), format);
            self.log_stretched(below, &image)
        };
        log("image/component", &|p| shown_id(labels.component[p], labels.reason[p]))?;
        log("image/instance", &|p| shown_id(labels.instance[p], labels.reason[p]))?;
        log("image/reason", &|p| reason_id(labels.reason[p]))
    }

    /// Logs what lies on the range image.
    pub fn log_stretched(
        &self,
        below: &str,
        entity: &dyn AsComponents,
    ) -> RecordingStreamResult<()> {
        let high = stretch(&self.frame.stages.image);
        let mut batches = entity.as_serialized_batches();
        let stretched = archetypes::Transform3D::from_scale([1.0, high, 1.0]);
        batches.extend(stretched.as_serialized_batches());
        self.recording.log_serialized_batches(self.topic.join(&below.into()), false, batches)
    }

    /// Little-endian bytes of a value for each pixel, highest beam first; 0 without a point.
    fn pixels(&self, value: impl Fn(usize) -> u16) -> Vec<u8> {
        let image = &self.frame.stages.image;
        let (rows, columns) = (image.rows(), image.columns());
        let pixels = (0..rows).flat_map(|row| {
            let first = row_from_top(image, row) * columns;
            first..first + columns
        });
        pixels.flat_map(|pixel| image.point_at(pixel).map_or(0, &value).to_le_bytes()).collect()
    }
}
