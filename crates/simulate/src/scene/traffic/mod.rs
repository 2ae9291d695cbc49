//! Two avenues along x and streets across between them: what stands, what keeps to its lane, and
//! the way of the ego vehicle. Those with ways of their own are in [`cast`].
//!
//! The ego vehicle drives along the first avenue, stops before a crossing for 7.5 s while people
//! cross, turns right into the street and left into the other avenue, where it goes on for good.
//!
//! ```text
//! y  18 sidewalk, houses behind     A tile is 40 m along x; every third has a street in its
//!    10 parked vehicles             middle, the first of them from x = 53 to 67.
//!     7 lane towards -x
//!   3.4 lane towards -x: lorries
//!     0 raised middle, a tram stop
//!  -3.4 lane towards +x: overtaking
//!    -7 lane towards +x: ego vehicle, a cyclist on its right
//!   -10 parked lorries and cars
//!   -14 sidewalk
//!   -22 houses             | street |
//!   -31 sidewalk
//!   -35 parked vehicles
//!   -38 lane towards -x
//!   -41 lane towards +x: ego vehicle, later
//!   -44 parked lorries and cars
//!   -49 sidewalk, houses behind
//! ```

mod cast;
mod lanes;

use std::f64::consts::{FRAC_PI_2, PI};

use rand::RngExt;

use lanes::{OTHER_RIGHT, OTHER_TOWARDS, RIGHT, TOWARDS};

use super::plan::Plan;
use super::tile::{Layer, TILE, Tile, strip};
use super::trajectory::{Leg, Trajectory};
use super::{rows, walkers};
use crate::ground::SideStreets;
use crate::material::Material::{Asphalt, Grass, Paving};
use crate::objects::class::{PARKING, ROAD, SIDEWALK, TERRAIN};
use crate::objects::surroundings;
use crate::objects::vehicle::Vehicle;

/// Speed at which the ego vehicle goes on for good, metres per second.
const AT_LAST: f64 = 6.0;

/// Every third tile has a street across.
const EVERY: f64 = 3.0 * TILE;

pub(super) fn plan() -> Plan {
    let strips = vec![
        strip(-52.0, TERRAIN, Grass, true),
        strip(-45.7, SIDEWALK, Paving, true),
        strip(-43.3, PARKING, Asphalt, false),
        strip(-35.9, ROAD, Asphalt, false),
        strip(-33.5, PARKING, Asphalt, false),
        strip(-28.5, SIDEWALK, Paving, true),
        strip(-16.5, TERRAIN, Grass, true),
        strip(-11.6, SIDEWALK, Paving, true),
        strip(-9.2, PARKING, Asphalt, false),
        strip(-1.5, ROAD, Asphalt, false),
        strip(1.5, SIDEWALK, Paving, true),
        strip(9.2, ROAD, Asphalt, false),
        strip(11.6, PARKING, Asphalt, false),
        strip(17.9, SIDEWALK, Paving, true),
        strip(f64::INFINITY, TERRAIN, Grass, true),
    ];
    let side_streets = Some(SideStreets {
        first: 53.0..67.0,
        every: EVERY,
        reach: -33.5..-11.6,
        surface: strip(f64::INFINITY, ROAD, Asphalt, false),
    });
    let layer = |speed, y, fill| Layer { speed, y, fill };
    let layers = vec![
        layer(0.0, 0.0, at_rest),
        layer(-8.0, TOWARDS[1], rows::traffic),
        layer(-4.5, 8.6, rows::cyclists),
        layer(1.3, 13.7, people),
        layer(-1.4, 15.45, people),
        layer(1.3, -47.8, people),
        layer(-1.4, -49.55, people),
        layer(-8.0, OTHER_TOWARDS, after_the_turn),
        layer(AT_LAST, OTHER_RIGHT, ahead_after_the_turn),
    ];
    Plan { strips, side_streets, layers, ego: ego(), actors: cast::actors }
}

/// The way of the ego vehicle: at the crossing from 6.5 to 14 s, through the curve to the right
/// until 19 s, through that to the left from 22.5 to 25.5 s.
fn ego() -> Trajectory {
    let legs = [
        Leg::Straight(42.0),
        Leg::Turn { angle: -FRAC_PI_2, radius: 6.5 },
        Leg::Straight(18.9),
        Leg::Turn { angle: FRAC_PI_2, radius: 9.0 },
    ];
    let speeds = [
        (0.0, 8.0),
        (2.5, 8.0),
        (6.5, 0.0),
        (14.0, 0.0),
        (16.0, 4.0),
        (19.0, 4.0),
        (20.5, 6.5),
        (21.5, 6.5),
        (22.5, 4.5),
        (25.5, 4.5),
        (27.0, AT_LAST),
    ];
    Trajectory::straight([8.0, RIGHT], 0.0, 0.0).along(&legs).at_speeds(&speeds)
}

fn people(tile: &mut Tile<'_>, y: f64) {
    walkers::stream(tile, y, 1.65, 4.0..14.0);
}

/// Traffic of the other avenue that reaches the ego vehicle's turn when that is over.
fn after_the_turn(tile: &mut Tile<'_>, y: f64) {
    if tile.start >= 300.0 {
        rows::traffic(tile, y);
    }
}

/// Traffic that is ahead of the ego vehicle once it is in the other avenue.
fn ahead_after_the_turn(tile: &mut Tile<'_>, y: f64) {
    if tile.start >= -80.0 {
        rows::traffic(tile, y);
    }
}

fn at_rest(tile: &mut Tile<'_>, _: f64) {
    let has_street = (tile.start - TILE).rem_euclid(EVERY) < 0.5 * TILE;
    rows::verge(tile, 12.3, -1.0);
    rows::frontage(tile, 17.9, 1.0);
    loading(tile, -44.5);
    rows::verge(tile, -46.4, 1.0);
    rows::frontage(tile, -52.0, -1.0);
    if has_street {
        tram_stop(tile);
    } else {
        rows::parallel(tile, 10.4);
        loading(tile, -10.4);
        rows::verge(tile, -12.3, 1.0);
        rows::parallel(tile, -34.7);
        rows::verge(tile, -32.8, -1.0);
    }
    block(tile, has_street);
    for along in [5.0, 35.0] {
        let lamp = surroundings::lamp_post(&mut tile.rng);
        tile.place(lamp, along, 0.0, PI);
    }
}

/// Two lorries that unload, and vehicles between them.
fn loading(tile: &mut Tile<'_>, y: f64) {
    let mut along = 1.0;
    for place in 0..6 {
        let vehicle = match place % 3 {
            0 => {
                let length = tile.rng.random_range(6.5..8.2);
                Vehicle::lorry(&mut tile.rng, length)
            }
            _ => Vehicle::car_or_van(&mut tile.rng, 0.15),
        };
        if along + vehicle.length > TILE - 0.6 {
            return;
        }
        let aside = tile.rng.random_range(-0.04..0.04);
        tile.place(vehicle.parked(), along + 0.5 * vehicle.length, y + aside, 0.0);
        along += vehicle.length + tile.rng.random_range(0.8..1.6);
    }
}

/// People who wait in the middle of the first avenue.
fn tram_stop(tile: &mut Tile<'_>) {
    for along in [25.0, 31.0] {
        let count = tile.rng.random_range(1..4);
        walkers::line(tile, along, 0.0, count);
    }
}

/// Houses from one avenue to the other, with room for a street.
fn block(tile: &mut Tile<'_>, has_street: bool) {
    let plots: &[f64] = if has_street { &[0.0, 3.0] } else { &[0.0, 1.0, 2.0, 3.0] };
    for plot in plots {
        let height = tile.rng.random_range(6.0..14.0);
        let house = surroundings::building(0.25 * TILE, -12.0, height);
        tile.place(house, (plot + 0.5) * 0.25 * TILE, -16.5, 0.0);
    }
}
