//! The hills: a street up and down, cars parked on the right, a low wall and hedges on the left,
//! houses.

use rand::RngExt;

use super::plan::{Ego, Plan};
use super::tile::{Layer, Tile, strip};
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
        strip(f64::INFINITY, TERRAIN, Grass, true),
    ];
    let layer = |speed, y, fill| Layer { speed, y, fill };
    let layers = vec![
        layer(0.0, 0.0, at_rest),
        layer(EGO.speed, EGO.y, rows::traffic_around_ego),
        layer(-8.0, 1.75, rows::traffic),
        layer(1.3, -9.0, people),
        layer(-1.4, -10.75, people),
    ];
    Plan::straight(strips, layers, EGO)
}

fn people(tile: &mut Tile<'_>, y: f64) {
    walkers::stream(tile, y, 1.65, 4.0..14.0);
}

fn at_rest(tile: &mut Tile<'_>, _: f64) {
    rows::parallel(tile, -5.78);
    rows::verge(tile, -7.6, 1.0);
    rows::frontage(tile, -13.2, -1.0);
    rows::low_boundary(tile, 6.0);
    rows::low_boundary(tile, 13.0);
    let height = tile.rng.random_range(4.0..8.0);
    rows::houses(tile, 24.0, 1.0, height);
}
