//! The street: ego lane, oncoming lane, parked cars on both sides, sidewalks, houses.

use rand::RngExt;

use super::plan::{Ego, Plan};
use super::tile::{Layer, TILE, Tile, strip};
use super::{rows, walkers};
use crate::material::Material::{Asphalt, Grass, Paving};
use crate::objects::class::{PARKING, ROAD, SIDEWALK, TERRAIN};

const EGO: Ego = Ego { y: -1.75, speed: 7.0 };

pub(super) fn plan() -> Plan {
    let strips = vec![
        strip(-13.2, TERRAIN, Grass, true),
        strip(-6.9, SIDEWALK, Paving, true),
        strip(-4.7, PARKING, Asphalt, false),
        strip(4.5, ROAD, Asphalt, false),
        strip(10.2, PARKING, Asphalt, false),
        strip(16.5, SIDEWALK, Paving, true),
        strip(f64::INFINITY, TERRAIN, Grass, true),
    ];
    let layer = |speed, y, fill| Layer { speed, y, fill };
    let layers = vec![
        layer(0.0, 0.0, at_rest),
        layer(EGO.speed, EGO.y, rows::traffic_around_ego),
        layer(-8.0, 1.75, rows::traffic),
        layer(4.6, -4.0, rows::cyclists),
        layer(-5.2, 3.9, rows::cyclists),
        layer(1.3, -9.0, people),
        layer(-1.4, -10.75, people),
        layer(-1.2, 12.3, people),
        layer(1.5, 14.05, people),
    ];
    Plan::straight(strips, layers, EGO)
}

fn people(tile: &mut Tile<'_>, y: f64) {
    walkers::stream(tile, y, 1.65, 4.0..14.0);
}

fn at_rest(tile: &mut Tile<'_>, _: f64) {
    rows::parallel(tile, -5.78);
    let degrees: f64 = [45.0, 60.0, 60.0, 90.0][tile.rng.random_range(0..4)];
    rows::bays(tile, 7.35, degrees.to_radians());
    rows::verge(tile, -7.6, 1.0);
    rows::verge(tile, 10.9, -1.0);
    for y in [-12.3, 15.6] {
        let along = tile.rng.random_range(4.0..0.5 * TILE);
        let count = tile.rng.random_range(2..5);
        walkers::line(tile, along, y, count);
        let along = tile.rng.random_range(0.6 * TILE..TILE - 2.0);
        walkers::line(tile, along, y, 1);
    }
    rows::frontage(tile, -13.2, -1.0);
    rows::frontage(tile, 16.5, 1.0);
}
