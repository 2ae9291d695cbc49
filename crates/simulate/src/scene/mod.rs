//! The scenes as layers of tiles: what a tile holds depends on the seed and its number alone, so
//! that a drive has no end and any of its frames can be made without the others.

mod crowd;
mod hills;
mod parking;
mod rows;
mod street;
mod tile;
mod walkers;
mod yard;

use std::fmt;
use std::str::FromStr;

use nalgebra::Isometry3;

use super::ground::{Ground, Relief};
use super::objects::Placed;
use tile::{Ego, Layer, TILE, Tile};

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
    /// A street over steep hills: slopes of 15 %, crests, dips and crossfall, parked cars on one
    /// side, a low wall and hedges on the other.
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

    /// Keeps the ego vehicle where it begins.
    pub fn stand(&mut self) {
        self.ego.speed = 0.0;
    }

    /// The foot of the ego vehicle after `time` seconds: on the ground, x ahead, z along its
    /// normal.
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
                let (place, layer_of) = ((self.seed, &self.ground), (index, layer.speed));
                let mut tile = Tile::new(place, layer_of, number, time, &mut placed);
                (layer.fill)(&mut tile, layer.y);
            }
        }
        placed
    }
}

#[cfg(test)]
mod tests {
    use super::tile::{MOVING_IDS, STATIC_IDS, ids};
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
        taken[usize::from(crate::EGO_INSTANCE)] = true;
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
