//! Panels of the bird's-eye plane: the votes, and the instances with their boxes.

use super::canvas::{Anchor, Area, Canvas, Stroke, between, opaque};
use super::font::{self, Weight};
use super::plane::{LabelSpots, Plane};
use super::scene::FrameScene;
use super::{theme, vote_graph};
use crate::messages::palette::reason_colour;
use divmerge_core::cloud::Instance;
use divmerge_core::geometry::footprint::Rectangle;

/// Size of the instances' numbers.
const NUMBER: f64 = 8.5;

/// Components and votes over the dimmed cloud.
pub fn votes(canvas: &mut Canvas, scene: &FrameScene, plane: &Plane, dpi: f64) {
    let instance = &scene.stages.labels.instance;
    plane.points(canvas, scene, dpi / 96.0, |point| {
        between(theme::PANEL, scene.colour(instance[point]), 0.38)
    });
    vote_graph::draw(canvas, plane, scene);
    plane.furniture(canvas);
}

/// The instances with their boxes; the largest have their numbers where there is room.
pub fn birds_eye(canvas: &mut Canvas, scene: &FrameScene, plane: &Plane, dpi: f64) {
    let labels = &scene.stages.labels;
    plane.points(canvas, scene, dpi / 96.0, |point| match labels.instance[point] {
        0 => reason_colour(labels.reason[point] as u8),
        instance => scene.colour(instance),
    });
    let mut by_points: Vec<&Instance> = scene.stages.instances.iter().collect();
    by_points.sort_by_key(|instance| (std::cmp::Reverse(instance.points), instance.id));
    canvas.clipped(plane.area, |canvas| {
        for instance in &by_points {
            let bounds = &instance.bounds;
            let rectangle = Rectangle {
                centre: [bounds.centre[0], bounds.centre[1]],
                size: [bounds.size[0].max(0.2), bounds.size[1].max(0.2)],
                yaw: bounds.yaw,
            };
            let stroke = Stroke::solid(opaque(scene.colour(instance.id)), 0.9);
            plane.rectangle(canvas, &rectangle, stroke);
        }
    });
    plane.furniture(canvas);
    let named = by_points.iter().map(|instance| {
        let [x, y, _] = instance.bounds.centre;
        (instance.id, [x, y], instance.bounds.size[1])
    });
    numbers(canvas, plane, named);
}

/// Writes numbers above boxes, clear of each other and of the metre bar; of each the number, the
/// middle and the width in metres.
pub fn numbers(
    canvas: &mut Canvas,
    plane: &Plane,
    boxes: impl Iterator<Item = (u32, [f64; 2], f64)>,
) {
    let area = plane.area;
    let bar = Area {
        x: area.right() - area.width / 4.0,
        y: area.bottom() - 32.0,
        width: area.width / 4.0,
        height: 32.0,
    };
    let mut spots = LabelSpots::new(area, vec![bar]);
    let style = theme::label(NUMBER, theme::ON_PANEL, Anchor::Middle);
    for (number, middle, width) in boxes {
        let words = number.to_string();
        let [x, y] = plane.to_page(middle);
        let half = width / 2.0 * plane.scale;
        let width = font::width(&words, NUMBER, Weight::Medium) + 4.0;
        let spot = Area { x: x - width / 2.0, y: y - half - 11.0, width, height: 10.0 };
        if spots.take(spot) {
            canvas.text([x, spot.bottom() - 2.0], words, style);
        }
    }
}
