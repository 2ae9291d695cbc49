//! Objects and points of things that are taken for something similar.

use std::collections::BTreeMap;

use rand::RngExt;

use super::draws::{Purpose, stream};
use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;

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

/// A cloud with its true classes, and what each class is easily taken for.
pub(super) struct Lookalikes<'a> {
    cloud: &'a PointCloud,
    /// N: true class number.
    class: Vec<u16>,
    /// By class number: whether it is a thing.
    is_thing: Vec<bool>,
    /// By class number: the lowest raw ids of the classes that it is easily taken for.
    similar: Vec<Vec<u16>>,
}

impl<'a> Lookalikes<'a> {
    pub fn new(cloud: &'a PointCloud, taxonomy: &Taxonomy) -> Self {
        Lookalikes {
            cloud,
            class: taxonomy.class_numbers(cloud.class.as_deref().unwrap_or_default()),
            is_thing: taxonomy.classes().iter().map(|class| class.is_thing).collect(),
            similar: similar_ids(taxonomy),
        }
    }

    /// Gives a share of the objects a similar class on all or some of their points, and one doubt
    /// to all of these points.
    pub fn flicker_objects(
        &self,
        object: &[u32],
        share: f64,
        seed: u64,
        raw: &mut [u16],
        doubt: &mut [f64],
    ) {
        let mut draw = stream(seed, Purpose::Flicker);
        let mut doubts = stream(!seed, Purpose::Confidence);
        for ((class, _), points) in self.objects(object) {
            let [is_hit, which, half, turn] = [(); 4].map(|()| draw.random::<f64>());
            let one_doubt = doubts.random();
            let Some(id) = self.similar(class, which).filter(|_| is_hit < share) else {
                continue;
            };
            let is_beyond = beyond_a_plane(self.cloud, &points, turn * std::f64::consts::TAU);
            for &point in points.iter().filter(|&&point| half < 0.5 || is_beyond(point)) {
                raw[point] = id;
                doubt[point] = one_doubt;
            }
        }
    }

    /// Gives the points of things whose chance is below a share a similar class, which `which`
    /// draws.
    pub fn flicker_points(&self, share: f64, chance: &[f64], which: &[f64], raw: &mut [u16]) {
        for point in (0..raw.len()).filter(|&point| chance[point] < share) {
            if let Some(id) = self.similar(self.class[point], which[point]) {
                raw[point] = id;
            }
        }
    }

    /// One of the raw ids that a class is easily taken for, by a draw from 0 to 1.
    fn similar(&self, class: u16, draw: f64) -> Option<u16> {
        let ids = &self.similar[usize::from(class)];
        ids.get((draw * ids.len() as f64) as usize).copied()
    }

    /// The returns of each object, by class number and id.
    fn objects(&self, object: &[u32]) -> BTreeMap<(u16, u32), Vec<usize>> {
        let mut objects: BTreeMap<(u16, u32), Vec<usize>> = BTreeMap::new();
        for point in (0..self.cloud.len()).filter(|&point| self.cloud.is_return(point)) {
            let class = self.class[point];
            if self.is_thing[usize::from(class)] {
                objects.entry((class, object[point])).or_default().push(point);
            }
        }
        objects
    }
}

/// Which points lie on one side of the upright plane through the middle of some points; its normal
/// has the given direction, in radians.
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

/// By class number: the lowest raw ids of the classes that it is easily taken for.
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
