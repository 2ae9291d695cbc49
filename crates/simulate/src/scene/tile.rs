//! Layers of tiles, and what is placed on a tile.

use rand_pcg::Pcg32;

use crate::ground::{Ground, Strip};
use crate::material::Material;
use crate::objects::{Model, Placed};
use crate::random::{Purpose, stream};

/// Length of a tile along x in metres.
pub(super) const TILE: f64 = 40.0;

/// Things on a tile of the layer at rest, and tiles until their ids come round again (5 km).
pub(super) const STATIC_IDS: (usize, i64) = (192, 128);

/// The same for a moving layer (2.5 km past each other).
pub(super) const MOVING_IDS: (usize, i64) = (16, 64);

/// Objects that move along x together, or rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layer {
    /// Along x, metres per second.
    pub speed: f64,
    /// The middle of the layer's lane, metres.
    pub y: f64,
    /// Puts the objects on a tile, given the lane's y.
    pub fill: fn(&mut Tile<'_>, f64),
}

/// A stretch of a layer, being filled.
pub(super) struct Tile<'a> {
    pub rng: Pcg32,
    /// Seconds since the start of the drive.
    pub time: f64,
    /// Speed of the layer along x, metres per second.
    pub speed: f64,
    /// Its beginning along x in the layer, which at time 0 is the world's x; metres.
    pub start: f64,
    pub ids: std::ops::Range<u16>,
    pub ground: &'a Ground,
    pub placed: &'a mut Vec<Placed>,
}

impl<'a> Tile<'a> {
    /// Tile `number` of a layer `time` seconds after the start; objects are added to `placed`.
    pub fn new(
        (seed, ground): (u64, &'a Ground),
        (layer, speed): (usize, f64),
        number: i64,
        time: f64,
        placed: &'a mut Vec<Placed>,
    ) -> Self {
        Tile {
            rng: stream(seed, Purpose::Tile, layer as u64, number as u64),
            time,
            speed,
            start: number as f64 * TILE,
            ids: ids(layer, number),
            ground,
            placed,
        }
    }

    /// Direction in which the layer moves, radians.
    pub fn heading(&self) -> f64 {
        if self.speed < 0.0 { std::f64::consts::PI } else { 0.0 }
    }

    /// Stands an object on the ground `along` metres from the tile's beginning, turned by `yaw`
    /// radians. A thing for which no id is left is not placed.
    pub fn place(&mut self, model: Model, along: f64, y: f64, yaw: f64) {
        let id = if model.is_thing() {
            match self.ids.next() {
                Some(id) => id,
                None => return,
            }
        } else {
            0
        };
        let x = self.start + self.speed * self.time + along;
        self.placed.push(Placed::on(self.ground, id, model, [x, y, yaw]));
    }
}

/// The ids of a tile's things: layer 0 is at rest and has the lower ids.
pub(super) fn ids(layer: usize, number: i64) -> std::ops::Range<u16> {
    let (count, tiles) = if layer == 0 { STATIC_IDS } else { MOVING_IDS };
    let first = if layer == 0 {
        1
    } else {
        let per_layer = MOVING_IDS.0 * MOVING_IDS.1 as usize;
        1 + STATIC_IDS.0 * STATIC_IDS.1 as usize + (layer - 1) * per_layer
    };
    let first = first + count * number.rem_euclid(tiles) as usize;
    first as u16..(first + count) as u16
}

/// Shorthand for a strip of a scene's plan.
pub(super) fn strip(to_y: f64, class: u16, material: Material, is_raised: bool) -> Strip {
    Strip { to_y, class, material, is_raised }
}
