//! Classes as a network might give them: true ones, spoiled by a fixed procedure and a seed, so that
//! methods can be compared where classes are wrong.
//!
//! Truth stays what it was; [`corrupt`] changes what a method gets to see. In this order:
//!
//! 1. **Flicker**: a share of the objects gets a class that it is easily taken for (car and truck, person
//!    and bicyclist, ...), one half of these objects on all points, the other on the points on one side of
//!    an upright plane through their middle.
//! 2. **Inner flicker**: a share of the points of things gets such a class, each point on its own or patch by
//!    patch: cubes of the frame in which all points of things do so together.
//! 3. **Border flips**: a share of the points of the border band gets the class of the nearest point of
//!    another class. The band is every point near another class where one of the two is a thing: object
//!    points beside another object or the ground, and what lies beside objects. Near is within 0.3 m or a
//!    hundredth of the range, about the step from beam to beam, whichever is more. Points flip each on
//!    its own, or patch by patch: cubes of the frame in which all points of the band flip together, as the
//!    errors of networks do.
//! 4. **Lost people**: a share of the points of people gets the class of the nearest point that is no
//!    thing.
//! 5. **Ghosts**: a share of the points just behind the silhouettes of objects gets the class of the object, as
//!    networks give it that see an image of ranges in which the two are side by side. Just behind is within 0.6
//!    degrees of a return of the object as seen from the origin of the cloud, and farther from there than the object
//!    by more than a border is felt.
//! 6. **Dropped returns**: a share of all returns is not there.
//!
//! On request the classes come with how sure they are. Confidence runs from 0.3 to 1 whether the class is right or
//! wrong: it is 1 - 0.7 u^k, u drawn evenly from 0 to 1. Wrong classes have k = 1 (0.65 on average), right ones near
//! a border k = 2 (0.77), and all others k = 6 (0.90), so that no confidence gives an error away. Patches that
//! are spoiled together have one u, and so has what an object that flickers is taken for: who misnames a thing in one
//! piece is equally sure of all of it.
//!
//! Every point, patch and object draws once for each of these, whatever the shares: what is spoiled at 5 %
//! is spoiled at 10 % too.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use rustc_hash::FxHashMap;
use serde::Serialize;

use crate::cloud::PointCloud;
use crate::kd_tree::KdTree;
use crate::taxonomy::Taxonomy;

/// Metres within which a border is felt ...
const BORDER: f64 = 0.3;

/// ... and the share of the range, where that is more.
const BORDER_BY_RANGE: f64 = 0.01;

/// Radians within which a point is seen beside an object: two to three columns, or one to two rows, of the images of
/// 64 x 2048 pixels that networks see, about as far as their filters and their way back to points smear.
const BESIDE: f64 = 0.6 * std::f64::consts::PI / 180.0;

/// How far confidence reaches down from 1.
const DOUBT: f64 = 0.7;

/// How fast doubt falls (the k of the confidence): where a class is wrong, ...
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
    /// Of the points of people: given to what is behind or below them.
    pub lost_people: f64,
    /// Of the points just behind the silhouettes of objects: called what the object is.
    pub ghosts: f64,
    /// Of the objects: taken for something similar, wholly or in part.
    pub flicker: f64,
    /// Of the returns: gone.
    pub dropped: f64,
    /// Whether the classes come with how sure they are.
    pub confidence: bool,
}

/// What lies around each of N points; the same for all corruptions of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surroundings {
    /// N: the point beyond the border if the point is in the border band.
    pub beyond: Vec<Option<u32>>,
    /// N: for points of people the nearest point that is no thing.
    pub background: Vec<Option<u32>>,
    /// N: for points just behind the silhouette of an object of another class the point of it that is seen nearest.
    pub before: Vec<Option<u32>>,
}

impl Surroundings {
    /// Looks around every point of a cloud with its true classes. Points whose class is not known, or
    /// ignored, are beyond no border and have none.
    pub fn new(cloud: &PointCloud, taxonomy: &Taxonomy) -> Self {
        let class = class_numbers(cloud, taxonomy);
        let by_class = ByClass::new(cloud, &class, taxonomy);
        let is_person = people(taxonomy);
        let around = (0..cloud.len()).map(|point| {
            let own = usize::from(class[point]);
            if !cloud.is_return(point) || taxonomy.classes()[own].is_ignored {
                return (None, None);
            }
            let at = cloud.position(point).map(f64::from);
            let reach = BORDER.max(BORDER_BY_RANGE * cloud.squared_range(point).sqrt());
            let is_thing = taxonomy.classes()[own].is_thing;
            let beyond = by_class.nearest(at, reach, |other, other_is_thing| {
                other != class[point] && (is_thing || other_is_thing)
            });
            let background =
                || by_class.nearest(at, f64::INFINITY, |_, other_is_thing| !other_is_thing);
            (beyond, is_person[own].then(background).flatten())
        });
        let (beyond, background) = around.unzip();
        let before = before_each(cloud, &class, taxonomy);
        Surroundings { beyond, background, before }
    }

    /// Points in the border band.
    pub fn band(&self) -> usize {
        self.beyond.iter().flatten().count()
    }

    /// Points just behind the silhouettes of objects.
    pub fn behind(&self) -> usize {
        self.before.iter().flatten().count()
    }
}

/// The cloud with spoiled classes. Dropped returns have no coordinates (NaN); whoever scores leaves them
/// out of the truth.
///
/// `cloud` has its true classes, `object` the id of the true object of each point; `surroundings` are those
/// of this cloud.
pub fn corrupt(
    cloud: &PointCloud,
    object: &[u32],
    taxonomy: &Taxonomy,
    surroundings: &Surroundings,
    corruption: &Corruption,
    seed: u64,
) -> PointCloud {
    let mut spoiled = cloud.clone();
    let truth = cloud.class.as_deref().unwrap_or_default();
    let mut class = truth.to_vec();
    let together = |purpose| match corruption.patch > 0.0 {
        true => patch_draws(cloud, corruption.patch, seed, purpose),
        false => draws(cloud.len(), seed, purpose),
    };
    let mut doubt = match corruption.confidence {
        true => together(Purpose::Confidence),
        false => vec![0.0; cloud.len()],
    };
    flicker(cloud, object, taxonomy, corruption.flicker, seed, &mut class, &mut doubt);
    if corruption.inner_flicker > 0.0 {
        let [chance, which] = [Purpose::Inner, Purpose::Similar].map(together);
        inner_flicker(cloud, taxonomy, corruption.inner_flicker, &chance, &which, &mut class);
    }
    let chance = together(Purpose::Border);
    flip(&mut class, truth, &surroundings.beyond, &chance, corruption.border_flips);
    let chance = draws(cloud.len(), seed, Purpose::People);
    flip(&mut class, truth, &surroundings.background, &chance, corruption.lost_people);
    let chance = draws(cloud.len(), seed, Purpose::Ghosts);
    flip(&mut class, truth, &surroundings.before, &chance, corruption.ghosts);
    if corruption.confidence {
        let sure = confidence(truth, &class, taxonomy, &surroundings.beyond, &doubt);
        spoiled.confidence = Some(sure);
    }
    let chance = draws(cloud.len(), seed, Purpose::Dropped);
    for point in (0..cloud.len()).filter(|&point| chance[point] < corruption.dropped) {
        spoiled.x[point] = f32::NAN;
        spoiled.y[point] = f32::NAN;
        spoiled.z[point] = f32::NAN;
    }
    spoiled.class = cloud.class.is_some().then_some(class);
    spoiled
}

/// Points whose draw is below a share get the true class of their source, where they have one.
fn flip(class: &mut [u16], truth: &[u16], source: &[Option<u32>], chance: &[f64], share: f64) {
    for ((class, source), chance) in class.iter_mut().zip(source).zip(chance) {
        if let Some(source) = source.filter(|_| *chance < share) {
            *class = truth[source as usize];
        }
    }
}

/// A draw from 0 to 1 for each of N points.
fn draws(count: usize, seed: u64, purpose: Purpose) -> Vec<f64> {
    let mut draw = stream(seed, purpose);
    (0..count).map(|_| draw.random()).collect()
}

/// A draw for each of N points that is the same for all points of a cube of that side in metres.
fn patch_draws(cloud: &PointCloud, side: f64, seed: u64, purpose: Purpose) -> Vec<f64> {
    let cube =
        |point: usize| cloud.position(point).map(|along| (f64::from(along) / side).floor() as i32);
    let draw = |[x, y, z]: [i32; 3]| {
        let place = [x, y, z].iter().fold(seed, |mixed, &along| {
            mixed.wrapping_mul(APART).rotate_left(23) ^ u64::from(along as u32)
        });
        stream(place, purpose).random()
    };
    let mut known: FxHashMap<[i32; 3], f64> = FxHashMap::default();
    (0..cloud.len())
        .map(|point| *known.entry(cube(point)).or_insert_with_key(|at| draw(*at)))
        .collect()
}

/// What a stream of random numbers is drawn for.
#[derive(Clone, Copy)]
enum Purpose {
    Border = 1,
    People = 2,
    Flicker = 3,
    Dropped = 4,
    Inner = 5,
    Similar = 6,
    Ghosts = 7,
    Confidence = 8,
}

/// An odd number that spreads bits (2^64 over the golden ratio).
const APART: u64 = 0x9E37_79B9_7F4A_7C15;

fn stream(seed: u64, purpose: Purpose) -> Pcg32 {
    Pcg32::seed_from_u64(seed ^ APART.wrapping_mul(purpose as u64))
}

/// Classes by name, and what each is easily taken for.
const SIMILAR: &[(&str, &[&str])] = &[
    ("car", &["truck", "other-vehicle"]),
    ("truck", &["other-vehicle", "car"]),
    ("other-vehicle", &["truck", "car"]),
    ("bicycle", &["motorcycle"]),
    ("motorcycle", &["bicycle"]),
    ("person", &["bicyclist"]),
    ("bicyclist", &["person", "motorcyclist"]),
    ("motorcyclist", &["bicyclist"]),
];

/// Gives a share of the objects a similar class on all or some of their points, and those points one doubt.
fn flicker(
    cloud: &PointCloud,
    object: &[u32],
    taxonomy: &Taxonomy,
    share: f64,
    seed: u64,
    raw: &mut [u16],
    doubt: &mut [f64],
) {
    let class = class_numbers(cloud, taxonomy);
    let similar = similar_ids(taxonomy);
    let mut draw = stream(seed, Purpose::Flicker);
    let mut doubts = stream(!seed, Purpose::Confidence);
    for ((class, _), points) in objects(cloud, object, &class, taxonomy) {
        let [is_hit, which, half, turn] = [(); 4].map(|()| draw.random::<f64>());
        let one_doubt = doubts.random();
        let ids = &similar[usize::from(class)];
        if is_hit >= share || ids.is_empty() {
            continue;
        }
        let id = ids[(which * ids.len() as f64) as usize];
        let is_beyond = beyond_a_plane(cloud, &points, turn * std::f64::consts::TAU);
        for &point in points.iter().filter(|&&point| half < 0.5 || is_beyond(point)) {
            raw[point] = id;
            doubt[point] = one_doubt;
        }
    }
}

/// Gives the points of things whose chance is below a share a similar class; `which` draws which one.
fn inner_flicker(
    cloud: &PointCloud,
    taxonomy: &Taxonomy,
    share: f64,
    chance: &[f64],
    which: &[f64],
    raw: &mut [u16],
) {
    let class = class_numbers(cloud, taxonomy);
    let similar = similar_ids(taxonomy);
    for (point, &class) in class.iter().enumerate().filter(|&(point, _)| chance[point] < share) {
        let ids = &similar[usize::from(class)];
        if let Some(&id) = ids.get((which[point] * ids.len() as f64) as usize) {
            raw[point] = id;
        }
    }
}

/// How sure the given raw classes of N points are, by a doubt from 0 to 1 each.
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

/// For each of N points just behind the silhouette of an object the point of it that is seen nearest, if that is
/// of another class.
fn before_each(cloud: &PointCloud, class: &[u16], taxonomy: &Taxonomy) -> Vec<Option<u32>> {
    let kind = |point: usize| &taxonomy.classes()[usize::from(class[point])];
    let is_seen = |point: usize| cloud.is_return(point) && cloud.squared_range(point) > 0.0;
    let things: Vec<usize> =
        (0..cloud.len()).filter(|&point| is_seen(point) && kind(point).is_thing).collect();
    let directions: Vec<[f64; 3]> = things.iter().map(|&point| direction(cloud, point)).collect();
    let tree = KdTree::new(&directions);
    let before = |point: usize| {
        let nearest = things[seen_before(cloud, point, &things, &tree, &directions)?];
        (class[nearest] != class[point]).then_some(nearest as u32)
    };
    let before = |point: usize| {
        let counts = is_seen(point) && !kind(point).is_ignored;
        counts.then(|| before(point)).flatten()
    };
    (0..cloud.len()).map(before).collect()
}

/// Of some points of things that which is seen beside a point and clearly before it, the nearest as seen from the
/// sensor.
fn seen_before(
    cloud: &PointCloud,
    point: usize,
    things: &[usize],
    tree: &KdTree<3>,
    directions: &[[f64; 3]],
) -> Option<usize> {
    let range = |point: usize| cloud.squared_range(point).sqrt();
    let at = direction(cloud, point);
    let farthest = range(point) - BORDER.max(BORDER_BY_RANGE * range(point));
    let apart = |thing: usize| -> f64 {
        (0..3).map(|axis| (at[axis] - directions[thing][axis]).powi(2)).sum()
    };
    // Straight across from one direction to the other.
    let near = tree.within(at, 2.0 * (BESIDE / 2.0).sin()).into_iter().map(|thing| thing as usize);
    near.filter(|&thing| range(things[thing]) < farthest)
        .min_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(a.cmp(&b)))
}

/// Where a point is seen from the origin: a vector of length 1.
fn direction(cloud: &PointCloud, point: usize) -> [f64; 3] {
    let range = cloud.squared_range(point).sqrt();
    cloud.position(point).map(|along| f64::from(along) / range)
}

/// Which points lie on the side of a direction of the upright plane through the middle of some points.
fn beyond_a_plane<'a>(
    cloud: &'a PointCloud,
    points: &[usize],
    direction: f64,
) -> impl Fn(usize) -> bool + 'a {
    let (sin, cos) = direction.sin_cos();
    let along = move |p: usize| f64::from(cloud.x[p]) * cos + f64::from(cloud.y[p]) * sin;
    let middle = points.iter().map(|&p| along(p)).sum::<f64>() / points.len() as f64;
    move |point| along(point) > middle
}

/// The returns of each object, by class number and id.
fn objects(
    cloud: &PointCloud,
    object: &[u32],
    class: &[u16],
    taxonomy: &Taxonomy,
) -> BTreeMap<(u16, u32), Vec<usize>> {
    let mut objects: BTreeMap<(u16, u32), Vec<usize>> = BTreeMap::new();
    for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
        if taxonomy.classes()[usize::from(class[point])].is_thing {
            objects.entry((class[point], object[point])).or_default().push(point);
        }
    }
    objects
}

/// By class number the lowest raw ids of the classes that it is easily taken for.
fn similar_ids(taxonomy: &Taxonomy) -> Vec<Vec<u16>> {
    let raw_id = |name: &&str| {
        let class = taxonomy.class_named(name)?;
        taxonomy.known_ids().find(|&(_, known)| known == class).map(|(id, _)| id)
    };
    let of_class = |name: &str| {
        let similar = SIMILAR.iter().find(|(own, _)| *own == name);
        similar.map_or(vec![], |(_, names)| names.iter().filter_map(raw_id).collect())
    };
    taxonomy.classes().iter().map(|class| of_class(&class.name)).collect()
}

fn people(taxonomy: &Taxonomy) -> Vec<bool> {
    let names = ["person", "people", "pedestrian"];
    taxonomy.classes().iter().map(|class| names.contains(&class.name.as_str())).collect()
}

fn class_numbers(cloud: &PointCloud, taxonomy: &Taxonomy) -> Vec<u16> {
    let class_of = taxonomy.lookup();
    let raw = cloud.class.as_deref().unwrap_or_default();
    raw.iter().map(|&id| class_of[usize::from(id)]).collect()
}

/// The returns of each known class, ready for searches.
struct ByClass(Vec<Searchable>);

struct Searchable {
    class: u16,
    is_thing: bool,
    points: Vec<u32>,
    tree: KdTree<3>,
}

impl ByClass {
    fn new(cloud: &PointCloud, class: &[u16], taxonomy: &Taxonomy) -> Self {
        let mut points: BTreeMap<u16, Vec<u32>> = BTreeMap::new();
        for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
            if !taxonomy.classes()[usize::from(class[point])].is_ignored {
                points.entry(class[point]).or_default().push(point as u32);
            }
        }
        let searchable = |(class, points): (u16, Vec<u32>)| {
            let at = |&point: &u32| cloud.position(point as usize).map(f64::from);
            let tree = KdTree::new(&points.iter().map(at).collect::<Vec<_>>());
            let is_thing = taxonomy.classes()[usize::from(class)].is_thing;
            Searchable { class, is_thing, points, tree }
        };
        ByClass(points.into_iter().map(searchable).collect())
    }

    /// The nearest point within reach of the classes that `accepts` (class number, whether it is a thing)
    /// allows.
    fn nearest(
        &self,
        at: [f64; 3],
        mut reach: f64,
        accepts: impl Fn(u16, bool) -> bool,
    ) -> Option<u32> {
        let mut nearest = None;
        for one in self.0.iter().filter(|one| accepts(one.class, one.is_thing)) {
            if let Some(near) = one.tree.nearest(at, 1, reach).first() {
                reach = near.squared.sqrt();
                nearest = Some(one.points[near.point as usize]);
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAR: u16 = 10;
    const TRUCK: u16 = 18;
    /// The lowest id of other-vehicle.
    const BUS: u16 = 13;
    const PERSON: u16 = 30;
    const ROAD: u16 = 40;
    const WALL: u16 = 50;

    fn cloud(points: &[([f32; 3], u16)]) -> PointCloud {
        let column = |axis: usize| points.iter().map(|(position, _)| position[axis]).collect();
        let cloud = PointCloud::new(column(0), column(1), column(2)).expect("columns");
        cloud.with_class(points.iter().map(|&(_, class)| class).collect()).expect("one each")
    }

    /// `count` people of 50 points beside a wall, every second point within reach of it.
    fn people_at_a_wall(count: usize) -> (PointCloud, Vec<u32>) {
        let mut points = Vec::new();
        let mut object = Vec::new();
        for person in 0..count {
            for point in 0..50 {
                // Ten in a row and ten rows, all within 30 m.
                let y = (person % 10) as f32 * 2.0;
                let z = (person / 10) as f32 * 2.0 + point as f32 * 0.01;
                let beside = if point % 2 == 0 { 0.2 } else { 0.8 };
                points.push(([9.0 - beside, y, z], PERSON));
                points.push(([9.0, y, z], WALL));
                object.extend([person as u32 + 1, 0]);
            }
        }
        (cloud(&points), object)
    }

    fn spoiled(corruption: Corruption, seed: u64) -> (PointCloud, PointCloud, Surroundings) {
        let taxonomy = Taxonomy::semantic_kitti();
        let (cloud, object) = people_at_a_wall(100);
        let around = Surroundings::new(&cloud, &taxonomy);
        let spoiled = corrupt(&cloud, &object, &taxonomy, &around, &corruption, seed);
        (cloud, spoiled, around)
    }

    fn changed(before: &PointCloud, after: &PointCloud) -> Vec<usize> {
        let (before, after) = (before.class.as_ref().unwrap(), after.class.as_ref().unwrap());
        (0..before.len()).filter(|&point| before[point] != after[point]).collect()
    }

    /// Whether a count is within four deviations of what so many trials of a chance give.
    fn is_likely(count: usize, trials: usize, chance: f64) -> bool {
        let expected = trials as f64 * chance;
        (count as f64 - expected).abs() < 4.0 * (expected * (1.0 - chance)).sqrt()
    }

    #[test]
    fn the_band_needs_another_class_near_and_a_thing() {
        let cloud = cloud(&[
            ([10.0, 0.0, 0.0], CAR),
            ([10.2, 0.0, 0.0], ROAD),
            ([10.2, 0.2, 0.0], WALL),
            ([10.0, 5.0, 0.0], CAR),
            ([50.0, 0.0, 0.0], CAR),
            ([50.4, 0.0, 0.0], 0),
            ([50.0, 0.4, 0.0], ROAD),
            ([20.0, 0.0, 0.0], ROAD),
            ([20.1, 0.0, 0.0], WALL),
            ([30.0, 0.0, 0.0], CAR),
            ([30.1, 0.0, 0.0], 252),
        ]);
        let around = Surroundings::new(&cloud, &Taxonomy::semantic_kitti());
        let beyond = around.beyond;
        assert_eq!(beyond[..3], [Some(1), Some(0), Some(0)]);
        assert_eq!(beyond[3], None, "nothing near");
        assert_eq!(
            beyond[4..7],
            [Some(6), None, Some(4)],
            "farther at 50 m, unlabelled is nothing"
        );
        assert_eq!(beyond[7..9], [None; 2], "no thing");
        assert_eq!(beyond[9..11], [None; 2], "a moving car is a car");
    }

    #[test]
    fn nothing_spoils_nothing() {
        let (cloud, spoiled, _) = spoiled(Corruption::default(), 7);
        assert_eq!(cloud, spoiled);
    }

    #[test]
    fn border_flips_hit_the_stated_share_of_the_band_both_ways() {
        let (cloud, spoiled, around) =
            spoiled(Corruption { border_flips: 0.05, ..Corruption::default() }, 1);
        let hit = changed(&cloud, &spoiled);
        assert!(hit.iter().all(|&point| around.beyond[point].is_some()));
        // Half the people's points, and all of the wall beside them.
        assert_eq!(around.band(), 100 * (25 + 50));
        assert!(is_likely(hit.len(), around.band(), 0.05), "{} of {}", hit.len(), around.band());
        let class = spoiled.class.as_ref().unwrap();
        let to_wall = hit.iter().filter(|&&point| class[point] == WALL).count();
        assert!(is_likely(to_wall, 2500, 0.05), "{to_wall} of 2500");
    }

    #[test]
    fn more_flips_hit_the_same_points_and_others() {
        let flips = |border_flips| {
            let (cloud, spoiled, _) =
                spoiled(Corruption { border_flips, ..Corruption::default() }, 3);
            changed(&cloud, &spoiled)
        };
        let (few, many) = (flips(0.05), flips(0.3));
        assert!(few.len() < many.len() && few.iter().all(|point| many.contains(point)));
    }

    #[test]
    fn patches_flip_together() {
        let (cloud, spoiled, around) =
            spoiled(Corruption { border_flips: 0.3, patch: 0.5, ..Corruption::default() }, 1);
        let hit = changed(&cloud, &spoiled);
        // A person's points and the wall behind lie in one cube of half a metre each.
        let mut by_person = [0; 100];
        for point in hit.iter().filter(|&&point| cloud.x[point] < 9.0) {
            by_person[point / 100] += 1;
        }
        let of_band = |person: usize| {
            let own = (person * 100..person * 100 + 100).filter(|&point| cloud.x[point] < 9.0);
            own.filter(|&point| around.beyond[point].is_some()).count()
        };
        assert!((0..100).all(|person| [0, of_band(person)].contains(&by_person[person])));
        let people = by_person.iter().filter(|&&hits| hits > 0).count();
        assert!(is_likely(people, 100, 0.3), "{people} of 100");
    }

    #[test]
    fn people_lose_the_stated_share_to_the_wall() {
        let (cloud, spoiled, _) =
            spoiled(Corruption { lost_people: 0.2, ..Corruption::default() }, 2);
        let hit = changed(&cloud, &spoiled);
        let class = spoiled.class.as_ref().unwrap();
        assert!(hit.iter().all(|&point| class[point] == WALL));
        assert!(is_likely(hit.len(), 5000, 0.2), "{}", hit.len());
    }

    #[test]
    fn dropped_returns_are_the_stated_share() {
        let (cloud, spoiled, _) = spoiled(Corruption { dropped: 0.1, ..Corruption::default() }, 2);
        let gone = (0..cloud.len()).filter(|&point| !spoiled.is_return(point)).count();
        assert!(is_likely(gone, cloud.len(), 0.1), "{gone}");
        assert_eq!(cloud.class, spoiled.class);
    }

    #[test]
    fn flicker_hits_the_stated_share_of_objects_half_of_them_wholly() {
        let points: Vec<([f32; 3], u16)> = (0..4000)
            .map(|i| ([10.0 + (i % 10) as f32 * 0.3, (i / 10) as f32, 0.0], CAR))
            .collect();
        let cloud = cloud(&points);
        let object: Vec<u32> = (0..4000).map(|i| i / 10).collect();
        let (taxonomy, around) = (Taxonomy::semantic_kitti(), Surroundings::default());
        let corruption = Corruption { flicker: 0.3, ..Corruption::default() };
        let spoiled = corrupt(&cloud, &object, &taxonomy, &around, &corruption, 5);
        let class = spoiled.class.as_ref().unwrap();
        let hits: Vec<usize> = class
            .chunks(10)
            .map(|object| object.iter().filter(|&&class| class != CAR).count())
            .filter(|&hits| hits > 0)
            .collect();
        assert!(is_likely(hits.len(), 400, 0.3), "{}", hits.len());
        let whole = hits.iter().filter(|&&hits| hits == 10).count();
        assert!(is_likely(whole, hits.len(), 0.5), "{whole} of {}", hits.len());
        assert!(class.iter().all(|class| [CAR, TRUCK, BUS].contains(class)));
        assert!(class.contains(&TRUCK) && class.contains(&BUS));
    }

    /// One car of `count` points in a row, 1 m apart, 10 m off.
    fn cars(count: usize) -> PointCloud {
        let points: Vec<([f32; 3], u16)> =
            (0..count).map(|i| ([10.0, i as f32, 0.0], CAR)).collect();
        cloud(&points)
    }

    fn alone(cloud: &PointCloud, corruption: Corruption, seed: u64) -> PointCloud {
        let object = vec![1; cloud.len()];
        let (taxonomy, around) = (Taxonomy::semantic_kitti(), Surroundings::default());
        corrupt(cloud, &object, &taxonomy, &around, &corruption, seed)
    }

    #[test]
    fn inner_flicker_hits_the_stated_share_of_things_and_nothing_else() {
        let inner = |inner_flicker| Corruption { inner_flicker, ..Corruption::default() };
        let cars = cars(4000);
        let [few, many] = [0.05, 0.2].map(|share| alone(&cars, inner(share), 3));
        let (few_hit, many_hit) = (changed(&cars, &few), changed(&cars, &many));
        assert!(is_likely(few_hit.len(), 4000, 0.05), "{}", few_hit.len());
        assert!(is_likely(many_hit.len(), 4000, 0.2), "{}", many_hit.len());
        assert!(few_hit.iter().all(|point| many_hit.contains(point)));
        let class = many.class.as_ref().unwrap();
        let trucks = class.iter().filter(|&&class| class == TRUCK).count();
        assert!(is_likely(trucks, many_hit.len(), 0.5), "{trucks} of {}", many_hit.len());
        let (people, spoiled, _) = spoiled(inner(0.2), 2);
        let hit = changed(&people, &spoiled);
        assert!(hit.iter().all(|&point| people.class.as_ref().unwrap()[point] == PERSON));
        assert!(is_likely(hit.len(), 5000, 0.2), "{}", hit.len());
    }

    #[test]
    fn patches_flicker_together() {
        let cars = cars(4000);
        let corruption = Corruption { inner_flicker: 0.2, patch: 10.0, ..Corruption::default() };
        let spoiled = alone(&cars, corruption, 3);
        let class = spoiled.class.as_ref().unwrap();
        let patches: Vec<&[u16]> = class.chunks(10).collect();
        assert!(patches.iter().all(|patch| patch.iter().all(|class| class == &patch[0])));
        let hit = patches.iter().filter(|patch| patch[0] != CAR).count();
        assert!(is_likely(hit, 400, 0.2), "{hit} of 400");
    }

    #[test]
    fn what_is_seen_just_past_an_object_is_behind_it() {
        let degrees = |angle: f32, range: f32| {
            let (sin, cos) = angle.to_radians().sin_cos();
            [range * cos, range * sin, 0.0]
        };
        let cloud = cloud(&[
            (degrees(0.0, 10.0), CAR),
            (degrees(0.5, 20.0), WALL),
            (degrees(0.7, 20.0), WALL),
            (degrees(-0.3, 10.2), ROAD),
            (degrees(-0.3, 5.0), ROAD),
            (degrees(-0.5, 20.0), 0),
            (degrees(0.2, 30.0), CAR),
            (degrees(0.35, 20.0), TRUCK),
            (degrees(0.3, 30.0), WALL),
        ]);
        let before = Surroundings::new(&cloud, &Taxonomy::semantic_kitti()).before;
        assert_eq!(before[..3], [None, Some(0), None], "0.5 degrees beside, 0.7 degrees beside");
        assert_eq!(before[3..6], [None; 3], "as far, nearer, unlabelled");
        assert_eq!(before[6], Some(7), "the truck, not the car");
    }

    #[test]
    fn ghosts_are_the_stated_share_of_what_is_just_behind() {
        let mut points = vec![([10.0, 0.0, 0.0], PERSON)];
        points.extend((0..2000).map(|i| ([20.0 + i as f32 * 0.01, 0.05, 0.0], WALL)));
        let cloud = cloud(&points);
        let object = vec![0; cloud.len()];
        let taxonomy = Taxonomy::semantic_kitti();
        let around = Surroundings::new(&cloud, &taxonomy);
        assert_eq!(around.behind(), 2000);
        let corruption = Corruption { ghosts: 0.1, ..Corruption::default() };
        let spoiled = corrupt(&cloud, &object, &taxonomy, &around, &corruption, 1);
        let hit = changed(&cloud, &spoiled);
        assert!(is_likely(hit.len(), 2000, 0.1), "{}", hit.len());
        assert!(hit.iter().all(|&point| spoiled.class.as_ref().unwrap()[point] == PERSON));
    }

    #[test]
    fn confidence_is_lower_where_classes_are_wrong_and_gives_none_of_them_away() {
        let corruption =
            Corruption { border_flips: 0.3, confidence: true, ..Corruption::default() };
        let without = spoiled(Corruption { confidence: false, ..corruption }, 6).1;
        let (cloud, spoiled, around) = spoiled(corruption, 6);
        assert_eq!((without.class, without.confidence), (spoiled.class.clone(), None));
        let sure = spoiled.confidence.as_ref().expect("asked for");
        let wrong = changed(&cloud, &spoiled);
        let mean = |points: &[usize]| {
            points.iter().map(|&point| f64::from(sure[point])).sum::<f64>() / points.len() as f64
        };
        let right = |is_border: bool| -> Vec<usize> {
            let all = 0..cloud.len();
            all.filter(|p| wrong.binary_search(p).is_err())
                .filter(|&p| around.beyond[p].is_some() == is_border)
                .collect()
        };
        let means = [mean(&wrong), mean(&right(true)), mean(&right(false))];
        for (mean, expected) in means.iter().zip([0.65, 1.0 - 0.7 / 3.0, 0.9]) {
            assert!((mean - expected).abs() < 0.02, "{means:?}");
        }
        let ends = |points: &[usize]| {
            let sure = points.iter().map(|&point| sure[point]);
            (sure.clone().fold(1.0_f32, f32::min), sure.fold(0.0_f32, f32::max))
        };
        for points in [wrong.clone(), right(true), right(false)] {
            let (least, most) = ends(&points);
            assert!((0.3..0.35).contains(&least) && (0.98..=1.0).contains(&most));
        }
    }

    #[test]
    fn the_seed_decides() {
        let all = Corruption {
            border_flips: 0.3,
            lost_people: 0.2,
            flicker: 0.3,
            ..Corruption::default()
        };
        let [first, again, other] = [4, 4, 5].map(|seed| spoiled(all, seed).1);
        assert_eq!(first, again);
        assert_ne!(first.class, other.class);
    }
}
