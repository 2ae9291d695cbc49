//! A verdict on every true object of a frame and on every found instance.
//!
//! With n points of a true object t, m of a found instance p and s of both, t and p match as in
//! panoptic quality ([`panoptic`](super::panoptic)): they are of one class and s / (n + m - s) is
//! above a half, where points whose true class is ignored are first left out on both sides. At most
//! one p matches a t. The verdict is the first of these that holds:
//!
//! | verdict | of a true object | of a found instance |
//! | --- | --- | --- |
//! | correct | it has a match | it has a match |
//! | wrong class | it would have one but for the class | it would be one but for the class |
//! | missed | half or more of its points have no instance | |
//! | spurious | | more than half of its points are of no thing |
//! | under-segmented | more than half of it is in one instance | no object holds more than half |
//! | over-segmented | no instance holds more than half of it | one object holds more than half |
//!
//! Nothing falls between the rows. Where one instance holds s > n / 2 of an object and does not
//! match it, that instance holds at least 2 s - n other points, or the IoU would exceed a half.
//! These other points spoil the match and are listed ([`JudgedObject::beside`]). Likewise an
//! unmatched instance of which more than half lies in one object is a part of a larger object.
//!
//! As in panoptic quality an unmatched object of few points is no failure: it is marked
//! [`small`](JudgedObject::is_small) and counted apart.
//!
//! One thing differs from panoptic quality. Found points of a thing class without an instance (id
//! 0) are a segment there, which matches where they happen to be one object's and is false
//! elsewhere. Here they are points without an instance, and no object.

mod kinds;

use rustc_hash::FxHashMap;
use serde::Serialize;

use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{PointCloud, wide};

pub use kinds::Verdict;

/// Class number and id of an object. Where classes are not compared, a found object has class 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Segment {
    /// Class number in the taxonomy.
    pub class: u16,
    /// Id within the class.
    pub id: u32,
}

/// Class number and id of each of N points. Id 0 of a found point is no instance; true ids may be
/// any.
#[derive(Debug, Clone, Copy)]
pub struct Labelling<'a> {
    /// N: class number in the taxonomy.
    pub class: &'a [u16],
    /// N: id.
    pub id: &'a [u32],
}

/// How objects are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MatchRules {
    /// Unmatched objects of fewer points are small.
    pub min_points: u64,
    /// Whether a match has to be of one class. If not, classes of found points are ignored, every
    /// found id is an instance, and instances that hold mostly no thing are only counted
    /// ([`Verdicts::elsewhere`]), because truth numbers neither walls nor poles.
    pub by_class: bool,
}

/// An object that shares points with another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Overlap {
    /// The object.
    pub object: Segment,
    /// Name of its class; empty where classes are not compared.
    pub class_name: String,
    /// Points that both have.
    pub shared: u64,
    /// Points of the object.
    pub points: u64,
}

/// A true object or a found instance, and its verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JudgedObject {
    /// The object.
    pub object: Segment,
    /// Name of its class; empty where classes are not compared.
    pub class_name: String,
    /// Its points, without those whose true class is ignored.
    pub points: u64,
    /// The verdict.
    pub verdict: Verdict,
    /// Whether it has no match and too few points to be a failure.
    pub is_small: bool,
    /// Greatest IoU with an object of the other side, of the same class where classes are compared.
    pub iou: f64,
    /// Objects of the other side that share points with it: the match first, then the most points.
    pub parts: Vec<Overlap>,
    /// How many of its points no object of the other side has: they are without an instance, or of
    /// no thing.
    pub in_nothing: u64,
    /// The other objects of this side that share points with the first of `parts`, the most first.
    pub beside: Vec<Overlap>,
    /// How many points of the first of `parts` no object of this side has.
    pub beside_nothing: u64,
    /// Mean position of its points, metres, sensor frame.
    pub centre: [f64; 3],
}

impl JudgedObject {
    /// Whether it is a failure: unmatched, and not small.
    pub fn is_failure(&self) -> bool {
        self.verdict != Verdict::Correct && !self.is_small
    }
}

/// All verdicts of a frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Verdicts {
    /// The true things, by class and id.
    pub truth: Vec<JudgedObject>,
    /// The found instances, by class and id.
    pub found: Vec<JudgedObject>,
    /// Number of found instances that hold mostly no thing; 0 where classes are compared.
    pub elsewhere: u64,
}

impl Verdicts {
    /// The verdict on a true object.
    pub fn of_true(&self, object: Segment) -> Option<&JudgedObject> {
        let place = self.truth.binary_search_by_key(&object, |judged| judged.object);
        place.ok().map(|place| &self.truth[place])
    }
}

/// Gives a verdict on every true thing and every found instance of a frame of N points.
///
/// # Panics
/// If columns differ in length or a class number is not the taxonomy's.
pub fn verdicts(
    cloud: &PointCloud,
    truth: Labelling,
    found: Labelling,
    taxonomy: &Taxonomy,
    rules: MatchRules,
) -> Verdicts {
    let objects = Objects::new(truth, found, taxonomy, rules.by_class);
    let overlaps = Overlaps::new(&objects);
    let matching = Matching { overlaps: &overlaps, taxonomy, rules };
    let mut verdicts = Verdicts {
        truth: overlaps.truth.keys().map(|&object| matching.of_true(object)).collect(),
        found: overlaps.found.keys().map(|&object| matching.of_found(object)).collect(),
        elsewhere: 0,
    };
    if !rules.by_class {
        let all = verdicts.found.len();
        verdicts.found.retain(|judged| judged.verdict != Verdict::Spurious);
        verdicts.elsewhere = (all - verdicts.found.len()) as u64;
    }
    verdicts.truth.sort_unstable_by_key(|judged| judged.object);
    verdicts.found.sort_unstable_by_key(|judged| judged.object);
    set_centres(cloud, &objects.truth, &mut verdicts.truth);
    set_centres(cloud, &objects.found, &mut verdicts.found);
    verdicts
}

/// N: the true and the found object of each point; none where the point is left out.
struct Objects {
    truth: Vec<Option<Segment>>,
    found: Vec<Option<Segment>>,
}

impl Objects {
    fn new(truth: Labelling, found: Labelling, taxonomy: &Taxonomy, by_class: bool) -> Self {
        let points = truth.class.len();
        let lengths = [truth.id.len(), found.class.len(), found.id.len()];
        assert!(lengths == [points; 3], "columns of different length");
        let classes = taxonomy.classes();
        let of_point = |point: usize| {
            let class = truth.class[point];
            if classes[usize::from(class)].is_ignored {
                return (None, None);
            }
            let is_thing = classes[usize::from(class)].is_thing;
            let own = is_thing.then_some(Segment { class, id: truth.id[point] });
            let (class, id) = (found.class[point], found.id[point]);
            let has_instance = id != 0 && (!by_class || classes[usize::from(class)].is_thing);
            let class = if by_class { class } else { 0 };
            (own, has_instance.then_some(Segment { class, id }))
        };
        let (truth, found) = (0..points).map(of_point).unzip();
        Objects { truth, found }
    }
}

/// How many points each object has, and how many it shares with each of the other side.
#[derive(Default)]
struct Overlaps {
    truth: FxHashMap<Segment, PointCounts>,
    found: FxHashMap<Segment, PointCounts>,
}

/// The number of an object's points, and of those that it shares with each of the other side.
#[derive(Default)]
struct PointCounts {
    points: u64,
    overlaps: Vec<(Segment, u64)>,
}

impl PointCounts {
    fn add(&mut self, other: Option<Segment>, points: u64) {
        self.points += points;
        self.overlaps.extend(other.map(|other| (other, points)));
    }

    fn in_nothing(&self) -> u64 {
        self.points - self.overlaps.iter().map(|overlap| overlap.1).sum::<u64>()
    }
}

impl Overlaps {
    fn new(objects: &Objects) -> Self {
        let mut pairs: FxHashMap<(Option<Segment>, Option<Segment>), u64> = FxHashMap::default();
        for pair in objects.truth.iter().zip(&objects.found) {
            if pair != (&None, &None) {
                *pairs.entry((*pair.0, *pair.1)).or_default() += 1;
            }
        }
        let mut overlaps = Overlaps::default();
        for ((truth, found), points) in pairs {
            if let Some(truth) = truth {
                overlaps.truth.entry(truth).or_default().add(found, points);
            }
            if let Some(found) = found {
                overlaps.found.entry(found).or_default().add(truth, points);
            }
        }
        for counts in overlaps.truth.values_mut().chain(overlaps.found.values_mut()) {
            counts
                .overlaps
                .sort_unstable_by_key(|&(other, points)| (std::cmp::Reverse(points), other));
        }
        overlaps
    }
}

/// The objects of both sides and the rules by which they match.
struct Matching<'a> {
    overlaps: &'a Overlaps,
    taxonomy: &'a Taxonomy,
    rules: MatchRules,
}

impl Matching<'_> {
    fn of_true(&self, object: Segment) -> JudgedObject {
        let Overlaps { truth, found } = self.overlaps;
        self.judged(object, truth, found, |counts| {
            if 2 * counts.in_nothing() >= counts.points {
                Verdict::Missed
            } else if 2 * counts.overlaps[0].1 > counts.points {
                Verdict::UnderSegmented
            } else {
                Verdict::OverSegmented
            }
        })
    }

    fn of_found(&self, object: Segment) -> JudgedObject {
        let Overlaps { truth, found } = self.overlaps;
        self.judged(object, found, truth, |counts| {
            if 2 * counts.in_nothing() > counts.points {
                Verdict::Spurious
            } else if 2 * counts.overlaps[0].1 > counts.points {
                Verdict::OverSegmented
            } else {
                Verdict::UnderSegmented
            }
        })
    }

    /// The verdict on an object of the side `own` against the side `other`; `unmatched` gives that
    /// on an object that would have no match in any class.
    fn judged(
        &self,
        object: Segment,
        own: &FxHashMap<Segment, PointCounts>,
        other: &FxHashMap<Segment, PointCounts>,
        unmatched: impl Fn(&PointCounts) -> Verdict,
    ) -> JudgedObject {
        let counts = &own[&object];
        let iou = |&(with, shared): &(Segment, u64)| {
            shared as f64 / (counts.points + other[&with].points - shared) as f64
        };
        let may_match = |with: &Segment| !self.rules.by_class || with.class == object.class;
        let matched = counts.overlaps.iter().position(|overlap| iou(overlap) > 0.5);
        let verdict = match matched {
            Some(place) if may_match(&counts.overlaps[place].0) => Verdict::Correct,
            Some(_) => Verdict::WrongClass,
            None => unmatched(counts),
        };
        let comparable = counts.overlaps.iter().filter(|overlap| may_match(&overlap.0));
        let mut parts: Vec<Overlap> = counts
            .overlaps
            .iter()
            .map(|&(with, shared)| self.overlap(with, shared, other))
            .collect();
        parts[..matched.map_or(0, |place| place + 1)].rotate_right(usize::from(matched.is_some()));
        let holder = parts.first().map(|part| &other[&part.object]);
        let beside = holder.map_or(&[][..], |counts| &counts.overlaps);
        let beside = beside.iter().filter(|(one, _)| *one != object);
        JudgedObject {
            object,
            class_name: self.class_name(object),
            points: counts.points,
            verdict,
            is_small: verdict != Verdict::Correct && counts.points < self.rules.min_points,
            iou: comparable.map(iou).fold(0.0, f64::max),
            in_nothing: counts.in_nothing(),
            beside: beside.map(|&(one, shared)| self.overlap(one, shared, own)).collect(),
            beside_nothing: holder.map_or(0, PointCounts::in_nothing),
            parts,
            centre: [0.0; 3],
        }
    }

    fn overlap(
        &self,
        object: Segment,
        shared: u64,
        of: &FxHashMap<Segment, PointCounts>,
    ) -> Overlap {
        let class_name = self.class_name(object);
        Overlap { object, class_name, shared, points: of[&object].points }
    }

    fn class_name(&self, object: Segment) -> String {
        match object.class {
            0 => String::new(),
            class => self.taxonomy.classes()[usize::from(class)].name.clone(),
        }
    }
}

/// Sets the centres of objects from the object of each point.
fn set_centres(cloud: &PointCloud, object: &[Option<Segment>], judged: &mut [JudgedObject]) {
    let mut sums: FxHashMap<Segment, ([f64; 3], f64)> = FxHashMap::default();
    for (point, object) in object.iter().enumerate() {
        let Some(object) = object.filter(|_| cloud.is_return(point)) else {
            continue;
        };
        let (sum, count) = sums.entry(object).or_default();
        let at = wide(cloud.position(point));
        sum.iter_mut().zip(at).for_each(|(sum, along)| *sum += along);
        *count += 1.0;
    }
    for judged in judged {
        if let Some((sum, count)) = sums.get(&judged.object) {
            judged.centre = sum.map(|along| along / count);
        }
    }
}

#[cfg(test)]
mod tests;
