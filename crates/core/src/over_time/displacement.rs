//! By how much an object was displaced between two sightings: iterated nearest points (Besl and
//! McKay 1992), translation on the plane alone.

use nalgebra::Vector2;

use super::sighting::Sighting;

/// Cells farther apart than this have nothing to do with each other, metres.
const FARTHEST: f32 = 1.0;

/// Weight of a pair of cells at 0.2 m is a half (Geman and McClure's kernel is of that shape).
const HALF_WEIGHT_SQUARED: f32 = 0.04;

/// Rounds for objects, and for background, which hardly moves.
const ROUNDS: (usize, usize) = (4, 1);

/// Most cells that are moved.
const MOST_CELLS: usize = 32;

/// A smaller step ends the rounds, metres.
const LEAST_STEP: f64 = 0.01;

/// A fit this good needs no other start: mean squared distance, square metres.
const GOOD_FIT: f64 = 0.01;

/// By how much `b` is displaced from `a` on the plane, metres, where `predicted` is expected. The
/// smaller of the two is moved into the larger, so that a part finds its place in the whole.
pub(super) fn displacement(a: &Sighting, b: &Sighting, predicted: Vector2<f64>) -> Vector2<f64> {
    let extent = |sighting: &Sighting| sighting.size.map(|side| side.max(0.1)).iter().product();
    let (of_a, of_b): (f32, f32) = (extent(a), extent(b));
    match of_a > of_b {
        true => -moved_into(b, a, -predicted),
        false => moved_into(a, b, predicted),
    }
}

fn moved_into(small: &Sighting, large: &Sighting, predicted: Vector2<f64>) -> Vector2<f64> {
    let expected = fit(small, large, predicted);
    if expected.cost < GOOD_FIT || large.body.is_none() {
        return expected.shift;
    }
    let of_middles = fit(small, large, large.middle - small.middle);
    match of_middles.cost < 0.5 * expected.cost {
        true => of_middles.shift,
        false => expected.shift,
    }
}

struct Fit {
    shift: Vector2<f64>,
    /// Mean squared distance, of cells without a near one that of [`FARTHEST`].
    cost: f64,
}

fn fit(small: &Sighting, large: &Sighting, start: Vector2<f64>) -> Fit {
    let mut shift = start;
    let mut cost = 0.0;
    let stride = small.cells.len().div_ceil(MOST_CELLS).max(1);
    let rounds = if large.body.is_some() { ROUNDS.0 } else { ROUNDS.1 };
    for _ in 0..rounds {
        let (mut sum, mut total) = (Vector2::<f32>::zeros(), 0.0);
        let mut squared = 0.0_f32;
        let (x, y) = (shift.x as f32, shift.y as f32);
        let mut moved = 0;
        for cell in (0..small.cells.len()).step_by(stride) {
            moved += 1;
            let [at_x, at_y, at_z] = small.cells.at(cell);
            let at = [at_x + x, at_y + y, at_z];
            let (distance, other) = large.cells.nearest(at);
            squared += distance.min(FARTHEST * FARTHEST);
            if distance < FARTHEST * FARTHEST {
                let weight = HALF_WEIGHT_SQUARED / (HALF_WEIGHT_SQUARED + distance);
                let [to_x, to_y, _] = large.cells.at(other);
                sum += Vector2::new(to_x - at[0], to_y - at[1]) * weight;
                total += weight;
            }
        }
        cost = f64::from(squared) / f64::from(moved.max(1));
        let step = if total > 0.0 { (sum / total).cast::<f64>() } else { Vector2::zeros() };
        shift += step;
        if step.norm() < LEAST_STEP {
            break;
        }
    }
    Fit { shift, cost }
}
