//! Classes as a network might give them: true ones, spoiled by a fixed procedure and a seed, so that
//! methods can be compared where classes are wrong.
//!
//! Truth stays what it was; [`corrupt`] changes what a method gets to see. In this order:
//!
//! 1. **Flicker**: a share of the objects gets a class that it is easily taken for (car and truck, person
//!    and bicyclist, ...), one half of these objects on all points, the other on the points on one side of
//!    an upright plane through their middle.
//! 2. **Border flips**: a share of the points of the border band gets the class of the nearest point of
//!    another class. The band is every point near another class where one of the two is a thing: object
//!    points beside another object or the ground, and what lies beside objects. Near is within 0.3 m or a
//!    hundredth of the range, about the step from beam to beam, whichever is more. Points flip each on
//!    its own, or patch by patch: cubes of the frame in which all points of the band flip together, as the
//!    errors of networks do.
//! 3. **Lost people**: a share of the points of people gets the class of the nearest point that is no
//!    thing.
//! 4. **Dropped returns**: a share of all returns is not there.
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

/// How much is spoiled: shares from 0 to 1. Default: nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Corruption {
    /// Of the points of the border band: flipped to the class beyond the border.
    pub border_flips: f64,
    /// Side of the cubes whose points flip together, metres; 0: each point on its own.
    pub patch: f64,
    /// Of the points of people: given to what is behind or below them.
    pub lost_people: f64,
    /// Of the objects: taken for something similar, wholly or in part.
    pub flicker: f64,
    /// Of the returns: gone.
    pub dropped: f64,
}

/// What lies around each of N points; the same for all corruptions of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surroundings {
    /// N: the point beyond the border if the point is in the border band.
    pub beyond: Vec<Option<u32>>,
    /// N: for points of people the nearest point that is no thing.
    pub background: Vec<Option<u32>>,
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
        Surroundings { beyond, background }
    }

    /// Points in the border band.
    pub fn band(&self) -> usize {
        self.beyond.iter().flatten().count()
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
    flicker(cloud, object, taxonomy, corruption.flicker, seed, &mut class);
    let chance = match corruption.patch > 0.0 {
        true => patch_draws(cloud, corruption.patch, seed),
        false => draws(cloud.len(), seed, Purpose::Border),
    };
    flip(&mut class, truth, &surroundings.beyond, &chance, corruption.border_flips);
    let chance = draws(cloud.len(), seed, Purpose::People);
    flip(&mut class, truth, &surroundings.background, &chance, corruption.lost_people);
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
fn patch_draws(cloud: &PointCloud, side: f64, seed: u64) -> Vec<f64> {
    let cube =
        |point: usize| cloud.position(point).map(|along| (f64::from(along) / side).floor() as i32);
    let draw = |[x, y, z]: [i32; 3]| {
        let place = [x, y, z].iter().fold(seed, |mixed, &along| {
            mixed.wrapping_mul(APART).rotate_left(23) ^ u64::from(along as u32)
        });
        stream(place, Purpose::Border).random()
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

/// Gives a share of the objects a similar class on all or some of their points.
fn flicker(
    cloud: &PointCloud,
    object: &[u32],
    taxonomy: &Taxonomy,
    share: f64,
    seed: u64,
    raw: &mut [u16],
) {
    let class = class_numbers(cloud, taxonomy);
    let similar = similar_ids(taxonomy);
    let mut draw = stream(seed, Purpose::Flicker);
    for ((class, _), points) in objects(cloud, object, &class, taxonomy) {
        let [is_hit, which, half, turn] = [(); 4].map(|()| draw.random::<f64>());
        let ids = &similar[usize::from(class)];
        if is_hit >= share || ids.is_empty() {
            continue;
        }
        let id = ids[(which * ids.len() as f64) as usize];
        let is_beyond = beyond_a_plane(cloud, &points, turn * std::f64::consts::TAU);
        for &point in points.iter().filter(|&&point| half < 0.5 || is_beyond(point)) {
            raw[point] = id;
        }
    }
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
