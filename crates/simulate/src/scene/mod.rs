//! The scenes as layers of tiles: what a tile holds depends on the seed and its number alone, so
//! that a drive has no end and any of its frames can be made without the others.

mod actor;
mod crowd;
mod hills;
mod parking;
mod plan;
mod rows;
mod street;
mod tile;
mod traffic;
mod trajectory;
mod walkers;
mod yard;

use std::fmt;
use std::str::FromStr;

use nalgebra::Isometry3;

use super::ground::{Ground, Relief};
use super::objects::Placed;
use actor::Actor;
use tile::{Layer, TILE, Tile};
use trajectory::Trajectory;

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
    /// Two avenues and a street between them. The ego vehicle is overtaken, stops where people
    /// cross, turns right into the street and left into the other avenue. Lorries that pass it and
    /// lorries that are parked hide people, cars and cyclists.
    Traffic,
}

impl Scene {
    /// The five that tables of methods are about.
    pub const USUAL: [Scene; 5] =
        [Scene::Street, Scene::Parking, Scene::Crowd, Scene::Hills, Scene::Yard];

    /// All of them.
    pub const ALL: [Scene; 6] =
        [Scene::Street, Scene::Parking, Scene::Crowd, Scene::Hills, Scene::Yard, Scene::Traffic];

    /// The names, as in `street, parking or crowd`.
    pub fn names() -> String {
        let (last, first) = Self::ALL.split_last().expect("there are some");
        let first: Vec<&str> = first.iter().map(|scene| scene.name()).collect();
        format!("{} or {}", first.join(", "), last.name())
    }

    fn name(self) -> &'static str {
        match self {
            Scene::Street => "street",
            Scene::Parking => "parking",
            Scene::Crowd => "crowd",
            Scene::Hills => "hills",
            Scene::Yard => "yard",
            Scene::Traffic => "traffic",
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
        found.ok_or_else(|| format!("`{name}` is no scene: {}", Self::names()))
    }
}

/// A scene with its ground, for one seed.
#[derive(Debug, Clone)]
pub(super) struct World {
    seed: u64,
    pub ground: Ground,
    layers: Vec<Layer>,
    actors: Vec<Actor>,
    ego: Trajectory,
}

impl World {
    pub fn new(scene: Scene, seed: u64) -> Self {
        let plan = match scene {
            Scene::Street => street::plan(),
            Scene::Parking => parking::plan(),
            Scene::Crowd => crowd::plan(),
            Scene::Hills => hills::plan(),
            Scene::Yard => yard::plan(),
            Scene::Traffic => traffic::plan(),
        };
        let relief = match scene {
            Scene::Hills => Relief::HILLY,
            Scene::Traffic => Relief::LEVEL,
            _ => Relief::GENTLE,
        };
        let ground = Ground::new(seed, relief, plan.strips).crossed_by(plan.side_streets);
        let actors = (plan.actors)(seed);
        World { seed, ground, layers: plan.layers, actors, ego: plan.ego }
    }

    /// Keeps the ego vehicle where it begins.
    pub fn stand(&mut self) {
        self.ego = self.ego.clone().at_rest();
    }

    /// The foot of the ego vehicle after `time` seconds: on the ground, x ahead, z along its
    /// normal.
    pub fn ego(&self, time: f64) -> Isometry3<f64> {
        let [x, y, heading] = self.ego.at(time);
        self.ground.frame_on_slope(x, y, heading)
    }

    /// Everything on the tiles within `reach` metres of the ego vehicle after `time` seconds, and
    /// all actors.
    pub fn objects(&self, time: f64, reach: f64) -> Vec<Placed> {
        let [x, ..] = self.ego.at(time);
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
        let actors = self.actors.iter().enumerate();
        placed.extend(actors.map(|(number, actor)| actor.placed(number, time, &self.ground)));
        placed
    }
}

#[cfg(test)]
mod tests {
    use super::actor::ACTOR_IDS;
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
        for scene in Scene::ALL {
            assert!(World::new(scene, 0).actors.len() <= ACTOR_IDS.len());
        }
        assert!(ACTOR_IDS.into_iter().all(|id| !taken[usize::from(id)]));
    }
}
