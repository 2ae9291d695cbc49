//! The pedestrian street: people in streams, rings and lines, cyclists, bollards, delivery cars.

use rand::RngExt;

use super::plan::{Ego, Plan};
use super::tile::{Layer, TILE, Tile, strip};
use super::{rows, walkers};
use crate::material::Material::{Asphalt, Paving};
use crate::objects::class::{BICYCLIST, ROAD, SIDEWALK};
use crate::objects::vehicle::Vehicle;
use crate::objects::{cycle, surroundings};

const EGO: Ego = Ego { y: -0.5, speed: 1.5 };

pub(super) fn plan() -> Plan {
    let strips = vec![
        strip(-3.0, SIDEWALK, Paving, true),
        strip(3.0, ROAD, Asphalt, false),
        strip(f64::INFINITY, SIDEWALK, Paving, true),
    ];
    let layer = |speed, y, fill| Layer { speed, y, fill };
    let layers = vec![
        layer(0.0, 0.0, at_rest),
        layer(1.3, -4.6, people),
        layer(-1.2, -9.4, people),
        layer(1.5, -11.6, people),
        layer(-1.35, 4.6, people),
        layer(1.1, 9.4, people),
        layer(-1.45, 11.6, people),
        layer(3.9, -2.3, rows::cyclists),
        layer(-3.4, 1.5, rows::cyclists),
    ];
    Plan::straight(strips, layers, EGO)
}

fn people(tile: &mut Tile<'_>, y: f64) {
    walkers::stream(tile, y, 2.0, 4.0..17.0);
}

fn at_rest(tile: &mut Tile<'_>, _: f64) {
    for side in [-1.0, 1.0] {
        standing(tile, 7.3 * side);
        furniture(tile, side);
        delivery(tile, 14.3 * side);
        rows::frontage(tile, 16.2 * side, side);
    }
}

/// Rings and lines of people, with room between them.
fn standing(tile: &mut Tile<'_>, y: f64) {
    for place in 0..3 {
        let along = (place as f64 + 0.5) * TILE / 3.0 + tile.rng.random_range(-3.0..3.0);
        let count = tile.rng.random_range(2..6);
        match tile.rng.random_range(0..3) {
            0 => walkers::line(tile, along, y, count.min(4)),
            1 => walkers::ring(tile, along, y, count.min(4)),
            _ => (),
        }
    }
}

/// Bollards along the kerb, trees and lamps behind the nearest stream, bicycles, cyclists who
/// wait.
fn furniture(tile: &mut Tile<'_>, side: f64) {
    for place in 0..16 {
        let along = 1.25 + 2.5 * place as f64;
        tile.place(surroundings::bollard(), along, 3.3 * side, 0.0);
    }
    for place in 0..4 {
        let along = 10.0 * place as f64 + tile.rng.random_range(1.0..9.0);
        let model = match tile.rng.random_range(0..6) {
            0 => surroundings::lamp_post(&mut tile.rng),
            1 => cycle::bicycle(),
            2 => cycle::bicyclist(BICYCLIST, 0.6),
            _ => surroundings::tree(&mut tile.rng, 1.8),
        };
        tile.place(model, along, 5.9 * side, 0.0);
    }
}

/// Now and then a van, a truck or a car before the houses.
fn delivery(tile: &mut Tile<'_>, y: f64) {
    let vehicle = match tile.rng.random_range(0..6) {
        0 => Vehicle::van(&mut tile.rng),
        1 => Vehicle::truck(&mut tile.rng),
        2 | 3 => Vehicle::car(&mut tile.rng),
        _ => return,
    };
    let along = tile.rng.random_range(6.0..TILE - 6.0);
    tile.place(vehicle.parked(), along, y, 0.0);
}
