//! The feet of what stands on the ground: bumpers, wheels, shoes, the foot of a wall.
//!
//! They are as low as a kerb, so that neither their height nor a slope over a baseline tells them
//! from ground. What tells is that the face goes on: a return right under one that is no ground,
//! nearly as far away, is of the same face, until the ground in front of it is reached.

use super::found::is_ground;
use super::profile::Return;

/// Farthest that a return of a face lies from the one above it, metres along the ground.
const RUN: f32 = 0.3;

/// Least slope from a return of a face up to the one above it, rise over run: faces lean, ground
/// does not.
const LEAST_SLOPE: f32 = 0.5;

/// What is not so much higher than the ground in front, metres, is ground as well: twice the noise
/// of a sensor.
const LEAST_HEIGHT: f32 = 0.06;

/// Share of ground among feet, by the labels of the drives that the curves of the confidence were
/// fitted to.
const SHARE: f32 = 0.2;

/// Points of a column, bottom up, that are taken for ground but are feet, take the share of ground
/// among feet as their confidence.
pub(super) fn doubt_feet(column: &[Return], confidence: &mut [f32]) {
    // The return above, if it is of a face; and the feet of faces whose ground in front is below.
    let mut face: Option<&Return> = None;
    let mut open: Vec<&Return> = Vec::new();
    for seen in column.iter().rev().filter(|seen| seen.exists()) {
        if !is_ground(confidence[seen.point as usize]) {
            face = Some(seen);
        } else if face.is_some_and(|above| goes_on(above, seen)) {
            open.push(seen);
            face = Some(seen);
        } else {
            for foot in open.drain(..).filter(|foot| foot.height - seen.height >= LEAST_HEIGHT) {
                confidence[foot.point as usize] = SHARE;
            }
            face = None;
        }
    }
    open.iter().for_each(|foot| confidence[foot.point as usize] = SHARE);
}

/// Whether a face goes on in the return below.
fn goes_on(above: &Return, below: &Return) -> bool {
    let run = (above.distance - below.distance).abs();
    run < RUN && above.height - below.height > LEAST_SLOPE * run
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The feet of a column of returns at some distances and heights, bottom up, of which those
    /// from `first` on are taken for no ground.
    fn feet_of(returns: &[[f32; 2]], first: usize) -> Vec<usize> {
        let column = (0..).zip(returns).map(|(point, &[x, z])| Return::new([x, 0.0, z], point));
        let column: Vec<Return> = column.collect();
        let confidence = |point: usize| if point < first { 0.9 } else { 0.1 };
        let before: Vec<f32> = (0..column.len()).map(confidence).collect();
        let mut after = before.clone();
        doubt_feet(&column, &mut after);
        (0..column.len()).filter(|&point| after[point] != before[point]).collect()
    }

    #[test]
    fn a_face_goes_down_to_the_ground_in_front() {
        // Road, a bumper that hangs over it, the hatch.
        let car = [[9.0, -1.7], [9.8, -1.7], [10.1, -1.65], [10.05, -1.5], [10.0, -1.3]];
        let hatch = [[10.1, -1.1], [10.3, -0.8]];
        assert_eq!(feet_of(&[&car[..], &hatch[..]].concat(), 5), [3, 4]);
    }

    #[test]
    fn ground_that_ends_at_a_face_is_none() {
        // A road up to a wall, rows 10 cm apart; a kerb of which nothing above is a face.
        assert_eq!(feet_of(&[[9.8, -1.7], [9.9, -1.7], [10.0, -1.7], [10.0, -1.5]], 3), [0; 0]);
        assert_eq!(feet_of(&[[9.8, -1.7], [10.0, -1.7], [10.0, -1.6], [10.2, -1.58]], 4), [0; 0]);
    }

    #[test]
    fn without_ground_below_all_of_a_face_is_one() {
        assert_eq!(feet_of(&[[10.0, -1.7], [10.0, -1.5], [10.0, -1.2]], 2), [0, 1]);
    }
}
