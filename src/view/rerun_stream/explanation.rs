//! The points of an explanation, what voted on them, and the words.

use rerun::components::{Radius, ShowLabels};
use rerun::{RecordingStreamResult, archetypes};

use super::blueprint::PairPage;
use super::eye::Eye;
use super::frame::{FrameLogger, lines, titled_boxes};
use super::images::stretch;
use super::names::{rgb, shown_id};
use crate::annotate::ClusteredFrame;
use crate::diagnose::explain::Explanation;
use crate::messages::palette::instance_colour;
use crate::view::look;
use crate::view::scene::row_from_top;
use divmerge_core::cloud::Instance;

/// What is shown around the points: so many metres, and so much of the distance between them.
const AROUND_M: f64 = 4.0;
const AROUND: f64 = 0.75;

/// The points that are explained, and how far around them the scene is shown.
struct Neighbourhood {
    points: Vec<[f64; 3]>,
    reach: f64,
}

impl Neighbourhood {
    fn of(found: &Explanation) -> Self {
        let points: Vec<[f64; 3]> =
            found.points.iter().map(|point| point.position.map(f64::from)).collect();
        let apart = match points[..] {
            [a, b] => distance(a, b),
            _ => 0.0,
        };
        Neighbourhood { points, reach: AROUND_M.max(AROUND * apart) }
    }

    fn holds(&self, at: [f32; 3]) -> bool {
        let at = at.map(f64::from);
        self.points.iter().any(|&point| distance(at, point) <= self.reach)
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

impl FrameLogger<'_> {
    /// Logs the points of an explanation, the scene around them, the pairs of pixels that voted,
    /// and the answer in words; returns the page that shows them.
    pub fn log_explanation(
        &self,
        found: &Explanation,
        words: &str,
    ) -> RecordingStreamResult<PairPage> {
        let around = Neighbourhood::of(found);
        let names = || ["A", "B"].into_iter().take(found.points.len());
        let points = archetypes::Points3D::new(found.points.iter().map(|point| point.position))
            .with_colors([rgb(look::DARK.focus)])
            .with_radii([Radius::new_ui_points(7.0)])
            .with_labels(names())
            .with_show_labels(true);
        self.log_3d("explanation/points", &points)?;
        self.log_around(&around, found)?;
        let pairs = found.pairs();
        let dark = &look::DARK;
        for (below, flat, colour, holds) in [
            ("explanation/votes/for", "image/explained/for", dark.merged, true),
            ("explanation/votes/against", "image/explained/against", dark.apart, false),
        ] {
            let voted = || pairs.iter().filter(|pair| pair.holds == holds);
            let strips = voted().map(|pair| [pair.a.position, pair.b.position]);
            self.log_3d(below, &lines(strips, colour, 2.0))?;
            let strips =
                voted().map(|pair| [&pair.a, &pair.b].map(|at| self.middle([at.row, at.column])));
            let strips = archetypes::LineStrips2D::new(strips)
                .with_colors([rgb(colour)])
                .with_radii([Radius::new_ui_points(1.5)]);
            self.log_stretched(flat, &strips)?;
        }
        let pixels: Vec<[f32; 2]> =
            found.points.iter().filter_map(|point| point.pixel).map(|at| self.middle(at)).collect();
        let marks = archetypes::Points2D::new(pixels.iter().copied())
            .with_colors([rgb(dark.focus)])
            .with_radii([Radius::new_ui_points(6.0)])
            .with_labels(names())
            .with_show_labels(ShowLabels(true.into()));
        self.log_stretched("image/explained/points", &marks)?;
        self.log("explanation/text", &archetypes::TextDocument::new(words))?;
        Ok(PairPage {
            topic: self.frame.key.topic.to_owned(),
            frame_id: self.frame.key.frame_id.to_owned(),
            eye: Eye::on(&around.points, around.reach),
            window: self.window(&pixels),
            has_votes: self.frame.stages.post_merge.tree.is_none(),
        })
    }

    /// Logs the returns around the points by instance and component, and the boxes of their
    /// instances.
    fn log_around(&self, around: &Neighbourhood, found: &Explanation) -> RecordingStreamResult<()> {
        let ClusteredFrame { cloud, stages, .. } = *self.frame;
        let labels = &stages.labels;
        let near: Vec<usize> = (0..cloud.len())
            .filter(|&point| cloud.is_return(point) && around.holds(cloud.position(point)))
            .collect();
        let points = archetypes::Points3D::new(near.iter().map(|&point| cloud.position(point)))
            .with_radii([Radius::new_ui_points(2.2)])
            .with_show_labels(false);
        for (below, number) in [
            ("explanation/instance", &labels.instance),
            ("explanation/component", &labels.component),
        ] {
            let ids = near.iter().map(|&point| shown_id(number[point], labels.reason[point]));
            self.log_3d(below, &points.clone().with_class_ids(ids))?;
        }
        let of_points = |instance: &&Instance| {
            found.points.iter().any(|point| labels.instance[point.index] == instance.id)
        };
        let explained: Vec<&Instance> = stages.instances.iter().filter(of_points).collect();
        let boxes = titled_boxes(&explained, |instance| instance_colour(instance.id));
        self.log_3d("explanation/boxes", &boxes.with_show_labels(true))
    }

    /// The middle of a pixel, given by row and column, on the image with its highest row on top.
    fn middle(&self, [row, column]: [usize; 2]) -> [f32; 2] {
        let row = row_from_top(&self.frame.stages.image, row);
        [column as f32 + 0.5, row as f32 + 0.5]
    }

    /// The part of the image around some of its places, as it is drawn.
    fn window(&self, pixels: &[[f32; 2]]) -> Option<[[f64; 2]; 2]> {
        const LEAST_COLUMNS: f64 = 60.0;
        /// Height over width of what is shown.
        const SHAPE: f64 = 0.5;
        let image = &self.frame.stages.image;
        let high = f64::from(stretch(image));
        let bounds = |axis: usize| {
            let values = pixels.iter().map(|pixel| f64::from(pixel[axis]));
            let low = values.clone().fold(f64::INFINITY, f64::min);
            [low, values.fold(f64::NEG_INFINITY, f64::max)]
        };
        if pixels.is_empty() {
            return None;
        }
        let [x, y] = [bounds(0), bounds(1).map(|row| row * high)];
        let wide = LEAST_COLUMNS.max(1.6 * (x[1] - x[0]).max((y[1] - y[0]) / SHAPE));
        let around = |[low, high]: [f64; 2], size: f64| {
            let middle = (low + high) / 2.0;
            [middle - size / 2.0, middle + size / 2.0]
        };
        Some([around(x, wide), around(y, wide * SHAPE)])
    }
}
