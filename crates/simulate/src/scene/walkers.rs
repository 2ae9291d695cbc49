//! People alone, in couples and in groups, walking and standing.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use rand::RngExt;

use super::tile::{TILE, Tile};
use crate::objects::class;
use crate::objects::person::Person;

/// Gap between the bodies of people who walk or stand together, metres.
const GAP: std::ops::Range<f64> = 0.1..0.5;

/// People side by side: each with the offset of its middle from the group's.
fn abreast(tile: &mut Tile<'_>, count: usize, room: f64) -> Vec<(Person, f64)> {
    let mut members: Vec<(Person, f64)> = Vec::new();
    let mut edge = 0.0;
    for _ in 0..count {
        let person = Person::random(&mut tile.rng);
        let gap = if members.is_empty() { 0.0 } else { tile.rng.random_range(GAP) };
        let centre = edge + gap + person.half_width();
        if centre + person.half_width() > room {
            break;
        }
        edge = centre + person.half_width();
        members.push((person, centre));
    }
    for member in &mut members {
        member.1 -= 0.5 * edge;
    }
    members
}

/// A stream of groups within `room` metres across, `spacing` metres from one group to the next.
pub(super) fn stream(tile: &mut Tile<'_>, y: f64, room: f64, spacing: std::ops::Range<f64>) {
    let mut along = tile.rng.random_range(0.8..spacing.end);
    while along < TILE - 0.8 {
        let count = match tile.rng.random_range(0..10) {
            0..4 => 1,
            4..8 => 2,
            _ => 3,
        };
        let members = abreast(tile, count, room);
        let taken: f64 = members.iter().map(|(person, _)| 2.0 * person.half_width()).sum();
        let gaps = 0.5 * members.len().saturating_sub(1) as f64;
        let spare = (0.5 * (room - taken - gaps)).max(1e-3);
        let aside = tile.rng.random_range(-spare..spare);
        for (person, offset) in members {
            let ahead = tile.rng.random_range(-0.12..0.12);
            let model = person.walking(class::MOVING_PERSON, tile.time);
            tile.place(model, along + ahead, y + aside + offset, tile.heading());
        }
        along += tile.rng.random_range(spacing.clone());
    }
}

/// People standing side by side who look towards -y or +y.
pub(super) fn line(tile: &mut Tile<'_>, along: f64, y: f64, count: usize) {
    let yaw = if tile.rng.random_bool(0.5) { FRAC_PI_2 } else { -FRAC_PI_2 };
    for (person, offset) in abreast(tile, count, 4.0) {
        tile.place(person.standing(class::PERSON), along + offset, y, yaw);
    }
}

/// People standing in a ring who look at its middle.
pub(super) fn ring(tile: &mut Tile<'_>, along: f64, y: f64, count: usize) {
    let first = tile.rng.random_range(0.0..TAU);
    let step = TAU / count as f64;
    let apart = tile.rng.random_range(0.85..1.05);
    let radius = (0.5 * apart / (0.5 * step).sin()).max(0.4);
    for member in 0..count {
        let (sin, cos) = (first + step * member as f64).sin_cos();
        let person = Person::random(&mut tile.rng);
        let model = person.standing(class::PERSON);
        let yaw = first + step * member as f64 + PI;
        tile.place(model, along + radius * cos, y + radius * sin, yaw);
    }
}
