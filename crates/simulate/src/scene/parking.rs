//! The car park: aisles along x between rows of bays, a raised walkway, houses and a hedge around.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3};

use rand::RngExt;

use super::plan::{Ego, Plan};
use super::tile::{Layer, TILE, Tile, strip};
use super::{rows, walkers};
use crate::material::Material::{Asphalt, Grass, Paving};
use crate::objects::class::{PARKING, ROAD, SIDEWALK, TERRAIN};
use crate::objects::surroundings;

const EGO: Ego = Ego { y: -1.3, speed: 2.5 };

pub(super) fn plan() -> Plan {
    let strips = vec![
        strip(-31.0, TERRAIN, Grass, true),
        strip(-29.0, SIDEWALK, Paving, true),
        strip(-23.1, PARKING, Asphalt, false),
        strip(-16.8, ROAD, Asphalt, false),
        strip(-10.9, PARKING, Asphalt, false),
        strip(-9.1, SIDEWALK, Paving, true),
        strip(-3.2, PARKING, Asphalt, false),
        strip(3.2, ROAD, Asphalt, false),
        strip(15.4, PARKING, Asphalt, false),
        strip(21.5, ROAD, Asphalt, false),
        strip(27.5, PARKING, Asphalt, false),
        strip(31.0, SIDEWALK, Paving, true),
        strip(f64::INFINITY, TERRAIN, Grass, true),
    ];
    let layer = |speed, y, fill| Layer { speed, y, fill };
    let layers = vec![
        layer(0.0, 0.0, at_rest),
        layer(1.2, -10.0, walkway),
        layer(-1.3, 2.3, people),
        layer(-2.8, -21.4, rows::traffic),
        layer(2.2, -18.4, rows::traffic),
        layer(-2.4, 18.4, rows::traffic),
        layer(1.4, 29.6, people),
        layer(-1.1, -30.0, people),
    ];
    Plan::straight(strips, layers, EGO)
}

fn people(tile: &mut Tile<'_>, y: f64) {
    walkers::stream(tile, y, 1.5, 6.0..22.0);
}

fn walkway(tile: &mut Tile<'_>, y: f64) {
    walkers::stream(tile, y, 1.3, 5.0..16.0);
}

fn at_rest(tile: &mut Tile<'_>, _: f64) {
    rows::bays(tile, -6.15, FRAC_PI_2);
    rows::bays(tile, -13.85, FRAC_PI_2);
    rows::bays(tile, -26.0, FRAC_PI_3);
    rows::bays(tile, 6.15, FRAC_PI_3);
    rows::bays(tile, 12.35, FRAC_PI_3);
    rows::bays(tile, 24.5, FRAC_PI_2);
    for along in [9.0, 29.0] {
        let lamp = surroundings::lamp_post(&mut tile.rng);
        tile.place(lamp, along, -9.25, 0.0);
    }
    for y in [-31.6, 30.7] {
        for place in 0..5 {
            let along = 8.0 * place as f64 + tile.rng.random_range(1.5..6.5);
            let crown = tile.rng.random_range(1.6..2.6);
            let tree = surroundings::tree(&mut tile.rng, crown);
            tile.place(tree, along, y, 0.0);
        }
    }
    for place in 0..4 {
        let middle = (place as f64 + 0.5) * 0.25 * TILE;
        tile.place(surroundings::hedge(0.25 * TILE, 1.3), middle, -33.0, 0.0);
    }
    rows::frontage(tile, 34.0, 1.0);
}
