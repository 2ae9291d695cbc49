//! Rows of parked vehicles, lanes of traffic, and what lines a road.

use std::f64::consts::PI;

use rand::RngExt;

use super::tile::{TILE, Tile};
use crate::objects::vehicle::Vehicle;
use crate::objects::{class, cycle, surroundings};

/// Vehicles parked end to end along x, 0.6 to 1.2 m apart.
pub(super) fn parallel(tile: &mut Tile<'_>, y: f64) {
    let mut along = 0.6;
    loop {
        let vehicle = match tile.rng.random_range(0..100) {
            0..5 => Vehicle::truck(&mut tile.rng),
            5..8 => Vehicle::caravan(&mut tile.rng),
            _ => Vehicle::car_or_van(&mut tile.rng, 0.15),
        };
        if along + vehicle.length > TILE - 0.6 {
            return;
        }
        let yaw = tile.rng.random_range(-0.015..0.015);
        let aside = tile.rng.random_range(-0.08..0.08);
        let centre = along + 0.5 * vehicle.length;
        if tile.rng.random_bool(0.92) {
            park(tile, vehicle, centre, y + aside, yaw);
        }
        along += vehicle.length + tile.rng.random_range(0.6..1.2);
    }
}

/// Vehicles side by side in bays at `angle` radians (0 to pi / 2] from x, 0.5 to 0.9 m apart.
pub(super) fn bays(tile: &mut Tile<'_>, y: f64, angle: f64) {
    let (sin, cos) = angle.sin_cos();
    let margin = 0.3 + 2.65 * cos;
    let mut along = margin;
    loop {
        let vehicle = Vehicle::car_or_van(&mut tile.rng, 0.14);
        let slot = vehicle.width / sin;
        if along + slot > TILE - margin {
            return;
        }
        let ahead = tile.rng.random_range(-0.15..0.15);
        let turn = if tile.rng.random_bool(0.6) { 0.0 } else { PI };
        let yaw = angle + turn + tile.rng.random_range(-0.012..0.012);
        let centre = along + 0.5 * slot + ahead * cos;
        if tile.rng.random_bool(0.92) {
            park(tile, vehicle, centre, y + ahead * sin, yaw);
        }
        along += slot + tile.rng.random_range(0.5..0.9) / sin;
    }
}

/// Parks a vehicle; in one of twelve someone waits at the wheel.
fn park(tile: &mut Tile<'_>, vehicle: Vehicle, along: f64, y: f64, yaw: f64) {
    let vehicle = if tile.rng.random_bool(0.08) { vehicle.driven() } else { vehicle };
    tile.place(vehicle.parked(), along, y, yaw);
}

/// A lane of moving cars, one or none to a tile.
pub(super) fn traffic(tile: &mut Tile<'_>, y: f64) {
    if !tile.rng.random_bool(0.6) {
        return;
    }
    let vehicle = if tile.rng.random_bool(0.06) {
        Vehicle::truck(&mut tile.rng)
    } else {
        Vehicle::car_or_van(&mut tile.rng, 0.12)
    };
    let along = tile.rng.random_range(8.0..TILE - 8.0);
    tile.place(vehicle.moving(), along, y, tile.heading());
}

/// The lane of the ego vehicle, which is at 0 of this layer: [`traffic`] at a distance.
pub(super) fn traffic_around_ego(tile: &mut Tile<'_>, y: f64) {
    if !(-TILE..=0.0).contains(&tile.start) {
        return traffic(tile, y);
    }
    let vehicle = Vehicle::car(&mut tile.rng);
    let along = if tile.start < 0.0 { 12.0 } else { 22.0 };
    tile.place(vehicle.moving(), along, y, tile.heading());
}

/// A lane of cyclists, now and then two in a row.
pub(super) fn cyclists(tile: &mut Tile<'_>, y: f64) {
    let mut along = tile.rng.random_range(2.0..20.0);
    while along < TILE - 2.0 {
        let pedal = tile.rng.random_range(0.0..PI) - 6.0 * tile.time;
        let aside = tile.rng.random_range(-0.08..0.08);
        let model = cycle::bicyclist(class::MOVING_BICYCLIST, pedal);
        tile.place(model, along, y + aside, tile.heading());
        let follows = tile.rng.random_bool(0.3);
        along += tile.rng.random_range(if follows { 2.4..3.5 } else { 12.0..30.0 });
    }
}

/// Trees, lamps, signs and parked bicycles along a kerb; lamps reach over the road on side `side`
/// (+-1).
pub(super) fn verge(tile: &mut Tile<'_>, y: f64, side: f64) {
    let mut along = 2.0;
    while along < TILE - 4.0 {
        match tile.rng.random_range(0..10) {
            0..4 => {
                let crown = tile.rng.random_range(1.4..2.4);
                let tree = surroundings::tree(&mut tile.rng, crown);
                tile.place(tree, along, y, 0.0);
            }
            4..6 => {
                let lamp = surroundings::lamp_post(&mut tile.rng);
                let yaw = if side > 0.0 { 0.0 } else { PI };
                tile.place(lamp, along, y, yaw);
            }
            6 => {
                let sign = surroundings::traffic_sign(&mut tile.rng);
                let yaw = if side > 0.0 { 0.0 } else { PI };
                tile.place(sign, along, y, yaw);
            }
            7 => {
                let radius = tile.rng.random_range(0.35..0.5);
                tile.place(surroundings::bush(radius), along, y, 0.0);
            }
            8 => tile.place(cycle::motorcycle(), along + 0.6, y, 0.0),
            _ => bicycle_stand(tile, along, y),
        }
        along += tile.rng.random_range(4.2..8.0);
    }
}

/// Two bicycles behind each other, parallel to the kerb.
fn bicycle_stand(tile: &mut Tile<'_>, along: f64, y: f64) {
    for place in 0..2 {
        let yaw = tile.rng.random_range(-0.08..0.08);
        tile.place(cycle::bicycle(), along + 1.9 * place as f64, y, yaw);
    }
}

/// A low boundary along the line y = const, metres: a wall of 0.3 to 0.6 m or a hedge, in pieces
/// short enough to follow the ground, with gaps to walk through.
pub(super) fn low_boundary(tile: &mut Tile<'_>, y: f64) {
    const PIECE: f64 = 2.0;
    let wall = tile.rng.random_range(0.3..0.6);
    let is_hedge = tile.rng.random_bool(0.25);
    for piece in 0..(TILE / PIECE) as usize {
        if tile.rng.random_bool(0.1) {
            continue;
        }
        let model = match is_hedge {
            true => surroundings::hedge(PIECE, wall + 0.4),
            false => surroundings::wall(PIECE, wall),
        };
        tile.place(model, (piece as f64 + 0.5) * PIECE, y, 0.0);
    }
}

/// Houses wall to wall along the line y = `front`, on its side `side` (+-1), `height` metres high.
pub(super) fn houses(tile: &mut Tile<'_>, front: f64, side: f64, height: f64) {
    let plot = 0.25 * TILE;
    for number in 0..4 {
        let house = surroundings::building(plot, side * 9.0, height);
        tile.place(house, (number as f64 + 0.5) * plot, front, 0.0);
    }
}

/// Houses and gardens along the line y = `front`, on its side `side` (+-1).
pub(super) fn frontage(tile: &mut Tile<'_>, front: f64, side: f64) {
    let plot = 0.25 * TILE;
    for number in 0..4 {
        let middle = (number as f64 + 0.5) * plot;
        if tile.rng.random_bool(0.55) {
            let height = tile.rng.random_range(5.5..14.0);
            let setback = tile.rng.random_range(0.0..0.8);
            let house = surroundings::building(plot, side * 9.0, height);
            tile.place(house, middle, front + side * setback, 0.0);
        } else {
            garden(tile, middle, front, side, plot);
        }
    }
}

/// A boundary, a tree and a house behind.
fn garden(tile: &mut Tile<'_>, middle: f64, front: f64, side: f64, plot: f64) {
    let boundary = match tile.rng.random_range(0..3) {
        0 => surroundings::fence(plot, 1.3),
        1 => surroundings::wall(plot, tile.rng.random_range(0.6..1.4)),
        _ => surroundings::hedge(plot, tile.rng.random_range(0.9..1.8)),
    };
    tile.place(boundary, middle, front + side * 0.5, 0.0);
    let crown = tile.rng.random_range(1.6..2.8);
    let tree = surroundings::tree(&mut tile.rng, crown);
    let aside = tile.rng.random_range(-2.0..2.0);
    tile.place(tree, middle + aside, front + side * 4.5, 0.0);
    let house = surroundings::building(plot - 2.0, side * 8.0, tile.rng.random_range(4.0..8.0));
    tile.place(house, middle, front + side * 9.0, 0.0);
}
