//! What is measured on the nodes of a tree, each from what its children have.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::Serialize;

use super::nodes::Tree;
use crate::cluster::objects::ObjectPixels;
use crate::range_image::RangeImage;
use crate::semantics::ground::GroundHeights;

/// What is measured on a node.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NodeMeasures {
    /// Longer and shorter side of the rectangle around it on the plane, and its height, metres. The
    /// rectangle is the smallest of those in eight directions.
    pub size: [f64; 3],
    /// Heights of its lowest and of its highest point above the ground, metres, where there is
    /// ground nearby.
    pub above_ground: Option<[f64; 2]>,
    /// Distance of its nearest point from the sensor, metres.
    pub range: f64,
    /// Share of its face towards the sensor that its pixels cover, 0 to 1; 1 where nobody knows
    /// where the sensor stands.
    pub filled: f64,
}

/// Directions on the plane in which the extent of a node is known, over half a turn.
const DIRECTIONS: usize = 16;

/// What adds up from the pixels to the root.
#[derive(Debug, Clone, Copy)]
struct Sums {
    /// Least and greatest extent in each direction, metres.
    low: [f32; DIRECTIONS],
    high: [f32; DIRECTIONS],
    /// Heights of the lowest and of the highest point, metres, upwards.
    bottom: f32,
    top: f32,
    /// Distance of the nearest point from its sensor, metres, and where on the plane that stands.
    range: f32,
    sensor: [f64; 2],
    /// Area that the pixels stand for, square metres across the ray.
    seen: f32,
}

impl Sums {
    const NOTHING: Sums = Sums {
        low: [f32::INFINITY; DIRECTIONS],
        high: [f32::NEG_INFINITY; DIRECTIONS],
        bottom: f32::INFINITY,
        top: f32::NEG_INFINITY,
        range: f32::INFINITY,
        sensor: [0.0; 2],
        seen: 0.0,
    };

    fn add(&mut self, other: &Sums) {
        for i in 0..DIRECTIONS {
            self.low[i] = self.low[i].min(other.low[i]);
            self.high[i] = self.high[i].max(other.high[i]);
        }
        self.bottom = self.bottom.min(other.bottom);
        self.top = self.top.max(other.top);
        if other.range < self.range {
            (self.range, self.sensor) = (other.range, other.sensor);
        }
        self.seen += other.seen;
    }

    /// Extent in a direction, metres.
    fn side(&self, direction: usize) -> f64 {
        f64::from(self.high[direction] - self.low[direction])
    }

    fn measures(&self, ground: &GroundHeights, up: f64) -> NodeMeasures {
        /// What a face is at least, metres: a single row or column of pixels has no area.
        const LEAST: f64 = 0.05;
        const QUARTER: usize = DIRECTIONS / 2;
        let area = |i: usize| self.side(i).max(LEAST) * self.side(i + QUARTER).max(LEAST);
        let smallest = (1..QUARTER).fold(0, |best, i| if area(i) < area(best) { i } else { best });
        let sides = [smallest, smallest + QUARTER].map(|i| self.side(i));
        let height = f64::from(self.top - self.bottom);
        let [x, y] = [0, QUARTER].map(|i| f64::from(self.low[i] + self.high[i]) / 2.0);
        let above = |height: f64| [self.bottom, self.top].map(|z| f64::from(z) - up * height);
        let across =
            ((y - self.sensor[1]).atan2(x - self.sensor[0]) + FRAC_PI_2) / PI * DIRECTIONS as f64;
        let across = (across.round() as i64).rem_euclid(DIRECTIONS as i64) as usize;
        let face = self.side(across).max(LEAST) * height.max(LEAST);
        NodeMeasures {
            size: [sides[0].max(sides[1]), sides[0].min(sides[1]), height],
            above_ground: ground.at([x, y, 0.0]).map(above),
            range: f64::from(self.range),
            filled: (f64::from(self.seen) / face).min(1.0),
        }
    }
}

/// The measures of every node of a tree over M object pixels, given the angle between the rows of
/// the image at each, radians, the ground, and whether z points up (1) or down (-1). Time O(M).
pub fn measures(
    tree: &Tree,
    (objects, image): (&ObjectPixels, &RangeImage),
    row_steps: &[f64],
    (ground, up): (&GroundHeights, f64),
) -> Vec<NodeMeasures> {
    let axes: [[f32; 2]; DIRECTIONS] = std::array::from_fn(|i| {
        let (sin, cos) = (PI * i as f64 / DIRECTIONS as f64).sin_cos();
        [cos as f32, sin as f32]
    });
    let (columns, is_assumed) = (image.columns(), image.is_from_assumed_place());
    let mut sums: Vec<Sums> = Vec::with_capacity(tree.nodes.len());
    for node in &tree.nodes {
        let mut all = Sums::NOTHING;
        for &child in node.children.iter().flatten() {
            all.add(&sums[child as usize]);
        }
        for &object in tree.own_pixels_of(node) {
            let position = objects.position[object as usize];
            let pixel = objects.pixel[object as usize] as usize;
            let band = image.band_of(pixel);
            let from_sensor = band.from_sensor(position.map(f64::from));
            let squared = from_sensor.iter().map(|x| x * x).sum::<f64>();
            let along = axes.map(|[cos, sin]| cos * position[0] + sin * position[1]);
            all.add(&Sums {
                low: along,
                high: along,
                bottom: up as f32 * position[2],
                top: up as f32 * position[2],
                range: squared.sqrt() as f32,
                sensor: [band.sensor.translation.x, band.sensor.translation.y],
                seen: match is_assumed {
                    true => f32::INFINITY,
                    false => (squared * band.column_step * row_steps[pixel / columns]) as f32,
                },
            });
        }
        sums.push(all);
    }
    sums.iter().map(|sums| sums.measures(ground, up)).collect()
}
