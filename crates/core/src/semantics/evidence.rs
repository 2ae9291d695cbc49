//! Whether the class ids of a field are what a taxonomy says they are.
//!
//! A field `label` may hold nothing, another data set's numbers, or the numbers of clusters. Two
//! things speak against ids: that the taxonomy has no class for most of them, and that they do not
//! agree with the geometry, which knows one class: the ground. Things do not lie on the ground, and
//! what lies there is called ground or nothing at all.
//!
//! Ids are innocent until geometry says otherwise: where no ground is found, they are believed.
//! The ground is looked for only where a cheap look at the classes leaves a doubt: things that are
//! flat wherever they are, or no flat class of ground.

use super::ground::GroundParams;
use super::ground_of;
use crate::cloud::point_cloud::PointCloud;
use crate::cloud::taxonomy::{Class, Taxonomy};
use crate::geometry::statistics::median_by;
use crate::range_image::{ProjectionParams, RangeImage};

/// Share of the returns from which on a class is judged: a class that is wrong of fewer does little
/// harm, and a few points of a true thing may well lie on the ground.
const LEAST_SHARE: f64 = 0.02;
/// Returns from which on a class is judged.
const FEWEST_RETURNS: usize = 64;

/// What the ids of a cloud's classes are.
#[derive(Debug, Clone, PartialEq)]
pub enum Belief<'a> {
    /// Ids of this taxonomy.
    Classes(&'a Taxonomy),
    /// Not classes, or of a taxonomy that cannot be told.
    Doubt(Doubt),
}

/// Why ids are not believed.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    /// What speaks against them.
    pub reason: DoubtReason,
    /// Ids of the returns, the most frequent first, with their numbers of returns; at most eight.
    pub ids: Vec<(u16, usize)>,
    /// Names of the known taxonomies that the ids and the ground agree with, if several do.
    pub candidates: Vec<&'static str>,
}

/// What speaks against ids.
#[derive(Debug, Clone, PartialEq)]
pub enum DoubtReason {
    /// No return has an id that stands for a class.
    Nothing,
    /// Most ids other than 0 stand for no class.
    Unknown {
        /// Returns whose id, not 0, stands for no class.
        unknown: usize,
        /// Returns.
        returns: usize,
    },
    /// Most of what is not ground has ids other than 0 that stand for no class.
    UnknownObjects {
        /// Returns whose id, not 0, stands for no class.
        unknown: usize,
        /// Returns of classes that are no ground.
        named: usize,
    },
    /// Most points of a class of things lie on the ground.
    FlatThing {
        /// The class.
        class: String,
        /// Its returns.
        returns: usize,
        /// Those on the ground.
        on_ground: usize,
    },
    /// Most of the ground has classes that are no ground.
    OtherGround {
        /// Returns on the ground.
        ground: usize,
        /// Those whose class is ground, or that have none.
        agreeing: usize,
    },
}

/// Judges the ids of a cloud's classes, which are those of `assumed` unless something speaks
/// against it. Then the one known taxonomy that ids and ground agree with is believed.
pub fn judge<'a>(
    cloud: &PointCloud,
    assumed: &'a Taxonomy,
    projection: &ProjectionParams,
    params: &GroundParams,
) -> Belief<'a> {
    let Some(raw) = &cloud.class else {
        return Belief::Classes(assumed);
    };
    let counts = Counts::new(cloud, raw);
    let found = |is_needed: bool| {
        is_needed.then(|| {
            let image = RangeImage::new(cloud, projection);
            counts.on_ground(cloud, raw, &ground_of(cloud, &image, params).is_ground)
        })
    };
    let nameless = counts.nameless(assumed);
    let is_doubtful = nameless.is_none() && has_odd_shapes(cloud, raw, &counts, assumed);
    let on_ground = found(is_doubtful);
    let contradiction = on_ground.as_ref().and_then(|found| counts.contradiction(assumed, found));
    let reason = nameless.or(contradiction);
    if reason.is_none() && !counts.has_unknown(assumed) {
        return Belief::Classes(assumed);
    }
    let mut candidates = counts.candidates(assumed);
    if !candidates.is_empty() {
        let on_ground = on_ground.or_else(|| found(true)).unwrap_or_default();
        candidates.retain(|taxonomy| counts.agree(taxonomy, &on_ground));
    }
    match (&candidates[..], reason) {
        ([one], _) => Belief::Classes(one),
        (_, None) => Belief::Classes(assumed),
        (_, Some(reason)) => Belief::Doubt(Doubt {
            reason,
            ids: counts.most_frequent(),
            candidates: candidates.iter().map(|taxonomy| taxonomy.name.as_str()).collect(),
        }),
    }
}

/// The same by the ids alone, for a taxonomy that was asked for: who names it knows what its ids
/// mean, but not whether a cloud has them.
pub fn judge_ids<'a>(cloud: &PointCloud, taxonomy: &'a Taxonomy) -> Belief<'a> {
    let Some(raw) = &cloud.class else {
        return Belief::Classes(taxonomy);
    };
    let counts = Counts::new(cloud, raw);
    let unknown = counts.sum(|id| taxonomy.class_of(id).is_none());
    let reason = match counts.sum(|id| id != 0) {
        0 if counts.returns > 0 => DoubtReason::Nothing,
        some if 2 * unknown > some => DoubtReason::Unknown { unknown, returns: counts.returns },
        _ => return Belief::Classes(taxonomy),
    };
    let ids = counts.most_frequent();
    Belief::Doubt(Doubt { reason, ids, candidates: Vec::new() })
}

/// Returns by id.
struct Counts {
    /// The ids that returns have, ascending, with their numbers of returns.
    of_id: Vec<(u16, usize)>,
    returns: usize,
}

/// Returns on the ground, by id, in the order of [`Counts`].
#[derive(Debug, Default)]
struct OnGround {
    of_id: Vec<usize>,
    all: usize,
}

impl Counts {
    fn new(cloud: &PointCloud, raw: &[u16]) -> Self {
        let of_id = count_by_id(raw, |point| cloud.is_return(point));
        Counts { returns: of_id.iter().map(|&(_, count)| count).sum(), of_id }
    }

    fn on_ground(&self, cloud: &PointCloud, raw: &[u16], is_ground: &[bool]) -> OnGround {
        let found = count_by_id(raw, |point| is_ground[point] && cloud.is_return(point));
        let count = |id: u16| {
            found.binary_search_by_key(&id, |&(id, _)| id).map_or(0, |place| found[place].1)
        };
        let of_id: Vec<usize> = self.of_id.iter().map(|&(id, _)| count(id)).collect();
        OnGround { all: of_id.iter().sum(), of_id }
    }

    /// Whether a number of returns is enough to be judged by.
    fn is_much(&self, returns: usize) -> bool {
        returns >= FEWEST_RETURNS && returns as f64 >= LEAST_SHARE * self.returns as f64
    }

    fn most_frequent(&self) -> Vec<(u16, usize)> {
        const MOST: usize = 8;
        let mut ids = self.of_id.clone();
        ids.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
        ids.truncate(MOST);
        ids
    }

    /// Returns whose id meets a condition.
    fn sum(&self, holds: impl Fn(u16) -> bool) -> usize {
        self.of_id.iter().filter(|&&(id, _)| holds(id)).map(|&(_, count)| count).sum()
    }

    /// What speaks against the ids by themselves: no class at all, or most of them without one. 0
    /// is "nothing" everywhere, so that it does not count for or against a taxonomy.
    fn nameless(&self, taxonomy: &Taxonomy) -> Option<DoubtReason> {
        let class = |id: u16| usize::from(taxonomy.class_of(id).unwrap_or(0));
        let named = self.sum(|id| class(id) > 0);
        let unknown = self.sum(|id| id != 0 && class(id) == 0);
        let standing = self.sum(|id| class(id) > 0 && !taxonomy.classes()[class(id)].is_ground());
        if named + unknown == 0 {
            (self.returns > 0).then_some(DoubtReason::Nothing)
        } else if unknown > named {
            Some(DoubtReason::Unknown { unknown, returns: self.returns })
        } else if unknown > standing && self.is_much(unknown) {
            Some(DoubtReason::UnknownObjects { unknown, named: standing })
        } else {
            None
        }
    }

    /// Whether more than a few returns have ids that a taxonomy does not know at all.
    fn has_unknown(&self, taxonomy: &Taxonomy) -> bool {
        let unknown = self.of_id.iter().filter(|&&(id, _)| taxonomy.class_of(id).is_none());
        self.is_much(unknown.map(|&(_, count)| count).sum())
    }

    /// By class number: returns, and those on the ground.
    fn by_class(&self, taxonomy: &Taxonomy, on_ground: &OnGround) -> Vec<(usize, usize)> {
        let mut classes = vec![(0, 0); taxonomy.classes().len()];
        for (&(id, count), &low) in self.of_id.iter().zip(&on_ground.of_id) {
            let class = &mut classes[usize::from(taxonomy.class_of(id).unwrap_or(0))];
            *class = (class.0 + count, class.1 + low);
        }
        classes
    }

    /// Where the ids and the ground disagree.
    fn contradiction(&self, taxonomy: &Taxonomy, on_ground: &OnGround) -> Option<DoubtReason> {
        /// Share of the returns that must be ground before it says anything about its classes.
        const LEAST_GROUND: f64 = 0.2;
        let counts = self.by_class(taxonomy, on_ground);
        let mut classes = counts.iter().zip(taxonomy.classes()).skip(1);
        let flat = classes
            .find(|&(&(all, low), class)| class.is_thing && self.is_much(all) && 2 * low > all);
        if let Some((&(returns, on_ground), class)) = flat {
            return Some(DoubtReason::FlatThing { class: class.name.clone(), returns, on_ground });
        }
        let agreeing = counts.iter().zip(taxonomy.classes()).enumerate();
        let agreeing = agreeing.filter(|(number, (_, class))| *number == 0 || class.is_ground());
        let agreeing: usize = agreeing.map(|(_, (&(_, low), _))| low).sum();
        let ground = on_ground.all;
        let is_enough = self.is_much(ground) && ground as f64 > LEAST_GROUND * self.returns as f64;
        (is_enough && 2 * agreeing < ground)
            .then_some(DoubtReason::OtherGround { ground, agreeing })
    }

    /// The known taxonomies, but for one, that have a meaning for all ids and a class for most.
    fn candidates(&self, but: &Taxonomy) -> Vec<&'static Taxonomy> {
        /// Classes that must be there: two or three numbers agree with something by chance.
        const FEWEST_CLASSES: usize = 5;
        let fits = |taxonomy: &&'static Taxonomy| {
            let is_known = |&(id, _): &(u16, usize)| taxonomy.class_of(id).is_some();
            let is_named = |&&(id, _): &&(u16, usize)| taxonomy.class_of(id) > Some(0);
            self.of_id.iter().all(is_known)
                && self.of_id.iter().filter(is_named).count() >= FEWEST_CLASSES
                && self.nameless(taxonomy).is_none()
        };
        Taxonomy::known().iter().filter(|known| known.name != but.name).filter(fits).collect()
    }

    /// Whether the ground is found, has classes of ground, and all but a few of these lie on it.
    fn agree(&self, taxonomy: &Taxonomy, on_ground: &OnGround) -> bool {
        const MOST: f64 = 0.75;
        let counts = self.by_class(taxonomy, on_ground);
        let classes = counts.iter().zip(taxonomy.classes());
        let ground = classes.filter(|(_, class)| class.is_ground());
        let (all, low) = ground.fold((0, 0), |sum, (of, _)| (sum.0 + of.0, sum.1 + of.1));
        self.is_much(on_ground.all)
            && low as f64 > MOST * on_ground.all as f64
            && 2 * low > all
            && self.contradiction(taxonomy, on_ground).is_none()
    }
}

/// The ids of the points that count, ascending, each with its number of points.
fn count_by_id(raw: &[u16], is_counted: impl Fn(usize) -> bool) -> Vec<(u16, usize)> {
    let mut counts = vec![0; 1 << 16];
    for (point, &id) in raw.iter().enumerate() {
        counts[usize::from(id)] += usize::from(is_counted(point));
    }
    (0..=u16::MAX).zip(counts).filter(|&(_, count)| count > 0).collect()
}

/// Whether classes look as if they did not agree with the ground: things that are flat, or no class
/// of ground that is.
fn has_odd_shapes(cloud: &PointCloud, raw: &[u16], counts: &Counts, taxonomy: &Taxonomy) -> bool {
    /// Share of the returns from which on flat ground is ground enough.
    const ENOUGH_GROUND: f64 = 0.1;
    let number = taxonomy.lookup();
    let classes = taxonomy.classes();
    let mut all = vec![0; classes.len()];
    for &(id, count) in &counts.of_id {
        all[usize::from(number[usize::from(id)])] += count;
    }
    let is_flat = |is_asked: &[bool]| {
        let is_of = |point: &usize| is_asked[usize::from(number[usize::from(raw[*point])])];
        let rise = typical_rise(cloud, (0..cloud.len()).filter(is_of));
        rise.is_some_and(|rise| rise < FLAT)
    };
    let is_ground: Vec<bool> = classes.iter().map(Class::is_ground).collect();
    let ground: usize = all.iter().zip(&is_ground).filter(|(_, is)| **is).map(|(n, _)| n).sum();
    let is_called = ground as f64 > ENOUGH_GROUND * counts.returns as f64 && is_flat(&is_ground);
    // Where most points have no class, the ground may well be one of them.
    let is_open = 2 * all[0] < counts.returns && !is_called;
    let mut things = (1..all.len()).filter(|&c| classes[c].is_thing && counts.is_much(all[c]));
    is_open
        || things.any(|thing| {
            let is_thing: Vec<bool> = (0..all.len()).map(|class| class == thing).collect();
            is_flat(&is_thing)
        })
}

/// Rise within a cell, metres, of what is flat: a street of 10 % over 2 m, noise, and a kerb. (On
/// SemanticKITTI ground rises 0.07 to 0.11, cars, riders and trucks 0.73 to 2.7.)
const FLAT: f32 = 0.4;

/// Median over cells of 2 m of the height by which returns in them differ, where a cell has a few
/// of some thousand returns that are looked at; `None` without such a cell. (Cells 256 m apart are
/// one: nothing grows with the cloud's extent.)
fn typical_rise(cloud: &PointCloud, points: impl Iterator<Item = usize>) -> Option<f32> {
    const PER_METRE: f32 = 0.5;
    const SIDE: i32 = 128;
    const FEWEST: u32 = 4;
    const MOST_RETURNS: usize = 4096;
    let returns: Vec<usize> = points.filter(|&point| cloud.is_return(point)).collect();
    // Points, least and most height.
    let mut cells = vec![(0, f32::INFINITY, f32::NEG_INFINITY); (SIDE * SIDE) as usize];
    for &point in returns.iter().step_by(returns.len().div_ceil(MOST_RETURNS).max(1)) {
        let [x, y, z] = cloud.position(point);
        let [row, column] =
            [x, y].map(|along| ((along * PER_METRE).floor() as i32).rem_euclid(SIDE));
        let cell = &mut cells[(row * SIDE + column) as usize];
        *cell = (cell.0 + 1, cell.1.min(z), cell.2.max(z));
    }
    let rises = cells.iter().filter(|(count, ..)| *count >= FEWEST);
    let mut rises: Vec<f32> = rises.map(|&(_, low, high)| high - low).collect();
    median_by(&mut rises, f32::total_cmp)
}
