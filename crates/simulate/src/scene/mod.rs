//! The scenes as layers of tiles: what a tile holds depends on the seed and its number alone, so that a
//! drive has no end and any of its frames can be made without the others.

mod crowd;
mod hills;
mod parking;
mod rows;
mod street;
mod walkers;
mod yard;

use std::fmt;
use std::str::FromStr;

use nalgebra::Isometry3;
use rand_pcg::Pcg32;

use super::ground::{Ground, Relief, Strip};
use super::material::Material;
use super::objects::{Model, Placed};
use super::random::{Purpose, stream};

/// Length of a tile along x in metres.
const TILE: f64 = 40.0;

/// Things on a tile of the layer at rest, and tiles until their ids come round again (5 km).
const STATIC_IDS: (usize, i64) = (192, 128);

/// The same for a moving layer (2.5 km past each other).
const MOVING_IDS: (usize, i64) = (16, 64);

/// A place to drive through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scene {
    /// A road between parked cars, end to end on the right and in bays on the left, with sidewalks,
    /// traffic, cyclists, trees and houses.
    Street,
    /// A car park with facing rows of perpendicular and diagonal bays and people between them.
    Parking,
    /// A pedestrian street full of people.
    Crowd,
    /// A street over steep hills: slopes of 15 %, crests, dips and crossfall, parked cars on one side, a
    /// low wall and hedges on the other.
    Hills,
    /// A yard of low walls (0.3 to 0.6 m), kerbs, hedges and fences along and across.
    Yard,
}

impl Scene {
    /// All of them.
    pub const ALL: [Scene; 5] =
        [Scene::Street, Scene::Parking, Scene::Crowd, Scene::Hills, Scene::Yard];

    fn name(self) -> &'static str {
        match self {
            Scene::Street => "street",
            Scene::Parking => "parking",
            Scene::Crowd => "crowd",
            Scene::Hills => "hills",
            Scene::Yard => "yard",
        }
    }
}

impl fmt::Display for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Scene {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|scene| scene.name() == name);
        found.ok_or_else(|| format!("`{name}` is no scene: street, parking, crowd, hills or yard"))
    }
}

/// Objects that move along x together, or rest.
#[derive(Debug, Clone, Copy)]
struct Layer {
    /// Along x, metres per second.
    speed: f64,
    /// The middle of the layer's lane, metres.
    y: f64,
    /// Puts the objects on a tile, given the lane's y.
    fill: fn(&mut Tile<'_>, f64),
}

/// The vehicle that carries the sensor.
#[derive(Debug, Clone, Copy)]
struct Ego {
    y: f64,
    speed: f64,
}

/// A scene with its ground, for one seed.
#[derive(Debug, Clone)]
pub(super) struct World {
    seed: u64,
    pub ground: Ground,
    layers: Vec<Layer>,
    ego: Ego,
}

impl World {
    pub fn new(scene: Scene, seed: u64) -> Self {
        let (strips, layers, ego) = match scene {
            Scene::Street => street::plan(),
            Scene::Parking => parking::plan(),
            Scene::Crowd => crowd::plan(),
            Scene::Hills => hills::plan(),
            Scene::Yard => yard::plan(),
        };
        let relief = if scene == Scene::Hills { Relief::HILLY } else { Relief::GENTLE };
        World { seed, ground: Ground::new(seed, relief, strips), layers, ego }
    }

    /// The foot of the ego vehicle after `time` seconds: on the ground, x ahead, z along its normal.
    pub fn ego(&self, time: f64) -> Isometry3<f64> {
        let x = self.ego.speed * time;
        self.ground.frame_on_slope(x, self.ego.y, 0.0)
    }

    /// Everything on the tiles within `reach` metres of the ego vehicle after `time` seconds.
    pub fn objects(&self, time: f64, reach: f64) -> Vec<Placed> {
        let x = self.ego.speed * time;
        let mut placed = Vec::new();
        for (index, layer) in self.layers.iter().enumerate() {
            let moved = layer.speed * time;
            let tile_at = |x: f64| ((x - moved) / TILE).floor() as i64;
            for number in tile_at(x - reach)..=tile_at(x + reach) {
                let mut tile = Tile::new(self, index, number, time, &mut placed);
                (layer.fill)(&mut tile, layer.y);
            }
        }
        placed
    }
}

/// A stretch of a layer, being filled.
struct Tile<'a> {
    rng: Pcg32,
    /// Seconds since the start of the drive.
    time: f64,
    /// Speed of the layer along x, metres per second.
    speed: f64,
    /// Its beginning along x in the layer, which at time 0 is the world's x; metres.
    start: f64,
    ids: std::ops::Range<u16>,
    ground: &'a Ground,
    placed: &'a mut Vec<Placed>,
}

impl<'a> Tile<'a> {
    fn new(
        world: &'a World,
        layer: usize,
        number: i64,
        time: f64,
        placed: &'a mut Vec<Placed>,
    ) -> Self {
        Tile {
            rng: stream(world.seed, Purpose::Tile, layer as u64, number as u64),
            time,
            speed: world.layers[layer].speed,
            start: number as f64 * TILE,
            ids: ids(layer, number),
            ground: &world.ground,
            placed,
        }
    }

    /// Direction in which the layer moves, radians.
    fn heading(&self) -> f64 {
        if self.speed < 0.0 { std::f64::consts::PI } else { 0.0 }
    }

    /// Stands an object on the ground `along` metres from the tile's beginning, turned by `yaw` radians.
    /// A thing for which no id is left is not placed.
    fn place(&mut self, model: Model, along: f64, y: f64, yaw: f64) {
        let id = if model.is_thing() {
            match self.ids.next() {
                Some(id) => id,
                None => return,
            }
        } else {
            0
        };
        let x = self.start + self.speed * self.time + along;
        let world_from_object = if model.leans {
            self.ground.frame_on_slope(x, y, yaw)
        } else {
            self.ground.frame_upright(x, y, yaw)
        };
        self.placed.push(Placed { id, model, world_from_object });
    }
}

/// The ids of a tile's things: layer 0 is at rest and has the lower ids.
fn ids(layer: usize, number: i64) -> std::ops::Range<u16> {
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
fn strip(to_y: f64, class: u16, material: Material, is_raised: bool) -> Strip {
    Strip { to_y, class, material, is_raised }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for scene in Scene::ALL {
            assert_eq!(scene.to_string().parse(), Ok(scene));
        }
        assert!("".parse::<Scene>().is_err());
    }

    #[test]
    fn ids_never_coincide_and_are_never_zero() {
        let layers = Scene::ALL.map(|scene| World::new(scene, 0).layers.len());
        let count = *layers.iter().max().unwrap();
        let mut taken = vec![false; 1 << 16];
        taken[0] = true;
        for layer in 0..count {
            let tiles = if layer == 0 { STATIC_IDS.1 } else { MOVING_IDS.1 };
            for number in -tiles / 2..tiles / 2 {
                for id in ids(layer, number) {
                    assert!(!std::mem::replace(&mut taken[id as usize], true));
                }
            }
        }
    }
}
