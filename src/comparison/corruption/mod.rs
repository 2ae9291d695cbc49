//! Classes as a network might give them: true ones, spoiled by a fixed procedure and a seed, so
//! that methods can be compared where classes are wrong.
//!
//! Truth stays as it is; [`corrupt`] changes what a method is given. In this order:
//!
//! 1. **Flicker**: a share of the objects gets a class that it is easily taken for (car and truck,
//!    person and bicyclist, ...). Half of these objects get it on all points, the other half on the
//!    points on one side of an upright plane through their middle.
//! 2. **Inner flicker**: a share of the points of things gets such a class, each point on its own
//!    or patch by patch: in cubes of the frame in which all points of things flicker together.
//! 3. **Border flips**: a share of the points of the border band gets the class of the nearest
//!    point of another class. The band is every point near another class where one of the two is a
//!    thing: object points beside another object or the ground, and what lies beside objects. Near
//!    is within 0.3 m or a hundredth of the range (about the step from beam to beam), whichever is
//!    more. Points flip each on its own, or patch by patch: in cubes of the frame in which all
//!    points of the band flip together, as the errors of networks do.
//! 4. **Lost people**: a share of the points of people gets the class of the nearest point that is
//!    no thing.
//! 5. **Ghosts**: a share of the points just behind the silhouettes of objects gets the class of
//!    the object, as from networks that see an image of ranges, in which the two lie side by side.
//!    Just behind is within 0.6 degrees of a return of the object as seen from the origin of the
//!    cloud, and farther from there than the object by more than the distance that counts as near
//!    in 3.
//! 6. **Dropped returns**: a share of all returns is removed.
//!
//! On request the classes come with a confidence. It runs from 0.3 to 1 whether the class is right
//! or wrong: it is 1 - 0.7 u^k, u drawn evenly from 0 to 1. Wrong classes have k = 1 (0.65 on
//! average), right ones near a border k = 2 (0.77), and all others k = 6 (0.90), so that no
//! confidence gives an error away. Patches that are spoiled together have one u, and so have the
//! points of an object that flickers: a network that takes a thing for another is equally sure of
//! all of it.
//!
//! Every point, patch and object draws once for each of these, whatever the shares: what is spoiled
//! at 5 % is spoiled at 10 % too.

mod draws;
mod flicker;
mod surroundings;

use serde::Serialize;

use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;
use draws::{Purpose, patch_draws, point_draws};
use flicker::Lookalikes;
pub use surroundings::Surroundings;

/// By how much confidence can be below 1.
const DOUBT: f64 = 0.7;

/// How fast doubt falls (the k of the confidence) where a class is wrong, ...
const WRONG: i32 = 1;

/// ... right but near a border, ...
const NEAR_BORDER: i32 = 2;

/// ... and right elsewhere.
const RIGHT: i32 = 6;

/// How much is spoiled: shares from 0 to 1. Default: nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Corruption {
    /// Of the points of the border band: flipped to the class beyond the border.
    pub border_flips: f64,
    /// Side of the cubes whose points flip or flicker together, metres; 0: each point on its own.
    pub patch: f64,
    /// Of the points of things: taken for something similar.
    pub inner_flicker: f64,
    /// Of the points of people: given the class of what is behind or below them.
    pub lost_people: f64,
    /// Of the points just behind the silhouettes of objects: given the class of the object.
    pub ghosts: f64,
    /// Of the objects: taken for something similar, wholly or in part.
    pub flicker: f64,
    /// Of the returns: removed.
    pub dropped: f64,
    /// Whether the classes come with a confidence.
    pub confidence: bool,
}

/// The cloud with spoiled classes. Dropped returns have no coordinates (NaN); whoever scores leaves
/// them out of the truth.
///
/// `cloud` has its true classes, `object` the id of the true object of each point; `surroundings`
/// are those of this cloud.
pub fn corrupt(
    cloud: &PointCloud,
    object: &[u32],
    (taxonomy, surroundings): (&Taxonomy, &Surroundings),
    corruption: &Corruption,
    seed: u64,
) -> PointCloud {
    let mut spoiled = cloud.clone();
    let truth = cloud.class.as_deref().unwrap_or_default();
    let mut class = truth.to_vec();
    let each = |purpose| point_draws(cloud.len(), seed, purpose);
    let together = |purpose| match corruption.patch > 0.0 {
        true => patch_draws(cloud, corruption.patch, seed, purpose),
        false => each(purpose),
    };
    let mut doubt = match corruption.confidence {
        true => together(Purpose::Confidence),
        false => vec![0.0; cloud.len()],
    };
    let lookalikes = Lookalikes::new(cloud, taxonomy);
    lookalikes.flicker_objects(object, corruption.flicker, seed, &mut class, &mut doubt);
    if corruption.inner_flicker > 0.0 {
        let [chance, which] = [Purpose::Inner, Purpose::Similar].map(together);
        lookalikes.flicker_points(corruption.inner_flicker, &chance, &which, &mut class);
    }
    let Surroundings { beyond, background, before } = surroundings;
    flip(&mut class, truth, beyond, &together(Purpose::Border), corruption.border_flips);
    flip(&mut class, truth, background, &each(Purpose::People), corruption.lost_people);
    flip(&mut class, truth, before, &each(Purpose::Ghosts), corruption.ghosts);
    let sure = corruption.confidence.then(|| confidence(truth, &class, taxonomy, beyond, &doubt));
    let chance = each(Purpose::Dropped);
    for point in (0..cloud.len()).filter(|&point| chance[point] < corruption.dropped) {
        spoiled.set_position(point, [f32::NAN; 3]);
    }
    let spoiled = spoiled.with(|columns| {
        columns.confidence = sure.or(columns.confidence.take());
        columns.class = columns.class.is_some().then_some(class);
    });
    spoiled.expect("one for each point")
}

/// Gives points whose chance is below a share the true class of their source, if they have one.
fn flip(class: &mut [u16], truth: &[u16], source: &[Option<u32>], chance: &[f64], share: f64) {
    for ((class, source), chance) in class.iter_mut().zip(source).zip(chance) {
        if let Some(source) = source.filter(|_| *chance < share) {
            *class = truth[source as usize];
        }
    }
}

/// N: confidence of the given raw classes, from a doubt of 0 to 1 for each point.
fn confidence(
    truth: &[u16],
    given: &[u16],
    taxonomy: &Taxonomy,
    beyond: &[Option<u32>],
    doubt: &[f64],
) -> Vec<f32> {
    let class_of = taxonomy.lookup();
    let is_right =
        |point: usize| class_of[usize::from(truth[point])] == class_of[usize::from(given[point])];
    let sure = |(point, &doubt): (usize, &f64)| {
        let fall = match (is_right(point), beyond.get(point)) {
            (false, _) => WRONG,
            (true, Some(Some(_))) => NEAR_BORDER,
            (true, _) => RIGHT,
        };
        (1.0 - DOUBT * doubt.powi(fall)) as f32
    };
    doubt.iter().enumerate().map(sure).collect()
}

#[cfg(test)]
mod tests;
