//! What lies around each point of a cloud with true classes.

use std::collections::BTreeMap;

use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::geometry::kd_tree::KdTree;

/// Another class is near within so many metres, ...
const BORDER: f64 = 0.3;

/// ... or within this share of the range, whichever is more.
const BORDER_BY_RANGE: f64 = 0.01;

/// Angle within which a point is seen beside an object, radians: two to three columns, or one to
/// two rows, of the images of 64 x 2048 pixels that networks see. About as far do their filters and
/// the step back to points smear classes.
const BESIDE: f64 = 0.6 * std::f64::consts::PI / 180.0;

/// What lies around each of N points; the same for all corruptions of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surroundings {
    /// N: the point beyond the border if the point is in the border band.
    pub beyond: Vec<Option<u32>>,
    /// N: for points of people the nearest point that is no thing.
    pub background: Vec<Option<u32>>,
    /// N: for points just behind the silhouette of an object of another class, the point of that
    /// object that is seen nearest.
    pub before: Vec<Option<u32>>,
}

impl Surroundings {
    /// The surroundings of every point of a cloud with its true classes. Points whose class is not
    /// known, or ignored, are beyond no border and have none.
    pub fn new(cloud: &PointCloud, taxonomy: &Taxonomy) -> Self {
        let class = taxonomy.class_numbers(cloud.class.as_deref().unwrap_or_default());
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

    /// Number of points in the border band.
    pub fn band(&self) -> usize {
        self.beyond.iter().flatten().count()
    }

    /// Number of points just behind the silhouettes of objects.
    pub fn behind(&self) -> usize {
        self.before.iter().flatten().count()
    }
}

/// N: for points just behind the silhouette of an object, the point of the object that is seen
/// nearest to it, if that is of another class.
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

/// Of some points of things, the one that is seen nearest beside a point and is clearly before it.
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
    // The chord between two directions that far apart.
    let near = tree.within(at, 2.0 * (BESIDE / 2.0).sin()).into_iter().map(|thing| thing as usize);
    near.filter(|&thing| range(things[thing]) < farthest)
        .min_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(a.cmp(&b)))
}

/// The direction from the origin to a point: a vector of length 1.
fn direction(cloud: &PointCloud, point: usize) -> [f64; 3] {
    let range = cloud.squared_range(point).sqrt();
    cloud.position(point).map(|along| f64::from(along) / range)
}

fn people(taxonomy: &Taxonomy) -> Vec<bool> {
    let names = ["person", "people", "pedestrian"];
    taxonomy.classes().iter().map(|class| names.contains(&class.name.as_str())).collect()
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

    /// The nearest point within reach, of the classes that `accepts` by number and by whether they
    /// are things.
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
