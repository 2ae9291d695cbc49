//! By how much an object was displaced between two sightings: iterated nearest points (Besl and
//! McKay 1992), translation on the plane alone.

use nalgebra::Vector2;

use super::sighting::Sighting;

/// Cells farther apart than this have nothing to do with each other, metres.
const FARTHEST: f32 = 1.0;

/// Weight of a pair of cells at 0.2 m is a half (Geman and McClure's kernel is of that shape).
const HALF_WEIGHT_SQUARED: f32 = 0.04;

const ROUNDS: usize = 4;

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
    if expected.cost < GOOD_FIT {
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
    for _ in 0..ROUNDS {
        let (mut sum, mut total) = (Vector2::<f32>::zeros(), 0.0);
        let mut squared = 0.0_f32;
        let (x, y) = (shift.x as f32, shift.y as f32);
        for cell in 0..small.cells.len() {
            let [at_x, at_y, at_z] = small.cells.at(cell);
            let at = [at_x + x, at_y + y, at_z];
            let mut nearest = (FARTHEST * FARTHEST, None);
            for (other, distance) in large.cells.squared_from(at).enumerate() {
                if distance < nearest.0 {
                    nearest = (distance, Some(other));
                }
            }
            squared += nearest.0;
            if let Some(other) = nearest.1 {
                let weight = HALF_WEIGHT_SQUARED / (HALF_WEIGHT_SQUARED + nearest.0);
                let [to_x, to_y, _] = large.cells.at(other);
                sum += Vector2::new(to_x - at[0], to_y - at[1]) * weight;
                total += weight;
            }
        }
        cost = f64::from(squared) / small.cells.len().max(1) as f64;
        if total > 0.0 {
            shift += (sum / total).cast::<f64>();
        }
    }
    Fit { shift, cost }
}
