//! Panels of the bird's-eye plane: the votes, and the instances with their boxes.

use super::canvas::{Anchor, Area, Canvas, Stroke, between, opaque};
use super::font::{self, Weight};
use super::plane::{LabelSpots, Plane};
use super::scene::FrameScene;
use super::vote_graph;
use crate::messages::palette::reason_colour;
use crate::text::grouped;
use divmerge_core::cloud::Instance;
use divmerge_core::geometry::footprint::Rectangle;

/// Most boxes with a number: more are a crowd.
const MOST_NUMBERS: usize = 120;
/// Size of the instances' numbers.
const NUMBER: f64 = 8.5;

/// Components and votes over the dimmed cloud.
pub fn votes(canvas: &mut Canvas, scene: &FrameScene, plane: &Plane, dpi: f64) {
    let instance = &scene.stages.labels.instance;
    plane.points(canvas, scene, dpi / 96.0, |point| {
        between(scene.look().panel, scene.colour(instance[point]), 0.38)
    });
    let [drawn, all] = vote_graph::draw(canvas, plane, scene);
    plane.furniture(canvas);
    if drawn < all {
        let [drawn, all] = [drawn, all].map(|count| grouped(count as u64));
        plane.note(canvas, &format!("the {drawn} of {all} pairs in view with most votes"));
    }
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
    let boxes: Vec<(u32, Rectangle)> =
        by_points.iter().map(|instance| (instance.id, footprint(instance))).collect();
    canvas.clipped(plane.area, |canvas| {
        for (id, rectangle) in &boxes {
            let colour = scene.look().line_colour(scene.colour(*id));
            plane.rectangle(canvas, rectangle, Stroke::solid(opaque(colour), 0.9));
        }
    });
    plane.furniture(canvas);
    let limit = NumberLimit { most: MOST_NUMBERS, others: ["smaller box", "smaller boxes"] };
    numbers(canvas, plane, &boxes, limit);
}

/// The box of an instance from above, no smaller than what can be seen.
fn footprint(instance: &Instance) -> Rectangle {
    let bounds = &instance.bounds;
    Rectangle {
        centre: [bounds.centre[0], bounds.centre[1]],
        size: [bounds.size[0].max(0.2), bounds.size[1].max(0.2)],
        yaw: bounds.yaw,
    }
}

/// Most boxes that have numbers, and what those that are left out are called: one, and several.
#[derive(Debug, Clone, Copy)]
pub struct NumberLimit {
    pub most: usize,
    pub others: [&'static str; 2],
}

/// Writes the numbers of the first boxes beside them, clear of each other, and a note of how many
/// boxes have none.
pub fn numbers(canvas: &mut Canvas, plane: &Plane, boxes: &[(u32, Rectangle)], limit: NumberLimit) {
    let look = canvas.look();
    let style = look.label(NUMBER, look.on_panel, Anchor::Middle);
    let seen: Vec<&(u32, Rectangle)> =
        boxes.iter().filter(|(_, rectangle)| plane.shows(rectangle.centre)).collect();
    let named = &seen[..seen.len().min(limit.most)];
    let mut places = number_places(plane, named, false);
    if places.len() < seen.len() {
        places = number_places(plane, named, true);
        let left = seen.len() - places.len();
        let others = limit.others[usize::from(left != 1)];
        plane.note(canvas, &format!("{} {others} without a number", grouped(left as u64)));
    }
    for (number, [x, y]) in places {
        canvas.text([x, y], number.to_string(), style);
    }
}

/// Where numbers have room: of each the middle of its baseline. With a note its corner stays free.
fn number_places(
    plane: &Plane,
    boxes: &[&(u32, Rectangle)],
    has_note: bool,
) -> Vec<(u32, [f64; 2])> {
    const HEIGHT: f64 = 9.0;
    let area = plane.area;
    let note = Area { y: area.bottom() - 22.0, width: 190.0, height: 22.0, ..area };
    let [x, y] = plane.to_page([0.0, 0.0]);
    let sensor = Area { x: x - 6.0, y: y - 6.0, width: 14.0, height: 12.0 };
    let taken = if has_note { vec![sensor, note] } else { vec![sensor] };
    let mut spots = LabelSpots::new(area, taken);
    let mut places = Vec::new();
    for (number, rectangle) in boxes {
        let [x, y] = plane.to_page(rectangle.centre);
        let corners = rectangle.corners().map(|corner| plane.to_page(corner));
        let reach = |axis: usize, middle: f64| {
            corners.iter().map(|corner| corner[axis] - middle).fold(0.0, f64::max)
        };
        let width = font::width(&number.to_string(), NUMBER, Weight::Medium) + 4.0;
        let [across, down] = [reach(0, x) + width / 2.0, reach(1, y) + HEIGHT / 2.0 + 1.0];
        let free =
            [[0.0, -down], [0.0, down], [across, 0.0], [-across, 0.0]].into_iter().find(|by| {
                let [left, top] = [x + by[0] - width / 2.0, y + by[1] - HEIGHT / 2.0];
                spots.take(Area { x: left, y: top, width, height: HEIGHT })
            });
        places.extend(free.map(|by| (*number, [x + by[0], y + by[1] + 3.0])));
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::plane::PlaneRegion;

    #[test]
    fn numbers_find_room_beside_each_other_or_are_left_out() {
        let area = Area { x: 0.0, y: 0.0, width: 400.0, height: 400.0 };
        let plane = Plane::new(area, &PlaneRegion { x: [-10.0, 10.0], y: [-10.0, 10.0] });
        let boxes: Vec<(u32, Rectangle)> = (1..=20)
            .map(|id| (id, Rectangle { centre: [5.0, 5.0], size: [1.0, 1.0], yaw: 0.0 }))
            .collect();
        let places = number_places(&plane, &boxes.iter().collect::<Vec<_>>(), false);
        // Above, below, right and left of the one place where all boxes are.
        assert_eq!(places.iter().map(|(id, _)| *id).collect::<Vec<_>>(), [1, 2, 3, 4]);
        let mut page = Canvas::new(400.0, 400.0, crate::view::theme::PAGE);
        let limit = NumberLimit { most: 3, others: ["smaller box", "smaller boxes"] };
        numbers(&mut page, &plane, &boxes, limit);
        let drawn = crate::view::svg(&page);
        assert!(drawn.contains("\"17 smaller boxes without a number\""), "{drawn}");
    }
}
