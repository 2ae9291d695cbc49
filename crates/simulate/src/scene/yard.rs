//! The yard: terraces and beds behind low walls, hedges and fences, along the way and across it.

use std::f64::consts::FRAC_PI_2;

use rand::RngExt;

use super::plan::{Ego, Plan};
use super::tile::{Layer, TILE, Tile, strip};
use super::{rows, walkers};
use crate::material::Material::{Asphalt, Grass, Paving};
use crate::objects::class::{ROAD, SIDEWALK, TERRAIN};
use crate::objects::surroundings;
use crate::objects::vehicle::Vehicle;

const EGO: Ego = Ego { y: 0.0, speed: 2.0 };

pub(super) fn plan() -> Plan {
    let strips = vec![
        strip(-7.0, TERRAIN, Grass, false),
        strip(-4.0, SIDEWALK, Paving, true),
        strip(4.0, ROAD, Asphalt, false),
        strip(6.5, SIDEWALK, Paving, true),
        strip(12.0, TERRAIN, Grass, false),
        strip(f64::INFINITY, TERRAIN, Grass, true),
    ];
    let layer = |speed, y, fill| Layer { speed, y, fill };
    let layers = vec![layer(0.0, 0.0, at_rest), layer(1.2, -5.4, people), layer(-1.3, 5.2, people)];
    Plan::straight(strips, layers, EGO)
}

fn people(tile: &mut Tile<'_>, y: f64) {
    walkers::stream(tile, y, 1.0, 6.0..22.0);
}

fn at_rest(tile: &mut Tile<'_>, _: f64) {
    for y in [-8.0, -15.0, 7.2, 13.0, 19.0] {
        rows::low_boundary(tile, y);
    }
    for place in 0..4 {
        across(tile, 10.0 * place as f64 + 5.0, -11.5);
        across(tile, 10.0 * place as f64 + 2.0, 10.0);
    }
    for side in [-1.0, 1.0] {
        if tile.rng.random_bool(0.5) {
            let car = Vehicle::car(&mut tile.rng).parked();
            let along = tile.rng.random_range(5.0..TILE - 5.0);
            tile.place(car, along, 2.9 * side, 0.0);
        }
    }
    rows::frontage(tile, -22.0, -1.0);
    rows::frontage(tile, 26.0, 1.0);
}

/// Five metres of a low wall or of a fence across the way.
fn across(tile: &mut Tile<'_>, along: f64, y: f64) {
    let boundary = match tile.rng.random_range(0..4) {
        0 => return,
        1 => surroundings::fence(5.0, 1.2),
        _ => surroundings::wall(5.0, tile.rng.random_range(0.3..0.6)),
    };
    tile.place(boundary, along, y, FRAC_PI_2);
}
