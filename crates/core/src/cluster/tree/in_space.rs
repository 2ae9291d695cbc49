//! Links and labels in space, for a cloud of which nobody knows where its sensor stands: what lies
//! next to each other in an image from an assumed place need not in space.

use rustc_hash::{FxHashMap, FxHashSet};

use super::links::{Link, Linker, places};
use crate::cloud::point_cloud::wide;
use crate::cluster::method::MethodInput;
use crate::cluster::objects::ObjectPixels;
use crate::cluster::params::TreeMerge;
use crate::geometry::disjoint_sets::DisjointSets;
use crate::geometry::kd_tree::KdTree;

/// Cells to a reach along each axis, in which one pixel of a group stands for the others.
const FINER: f32 = 12.0;

type Cell = [i32; 3];

/// Links in space, for pixels that others of their group do not stand for: one of each group and
/// small cell does.
///
/// A link is longer than the gap by a sixth of the reach at most in each axis. Time O(M log M),
/// whatever the density.
pub(super) struct SpaceLinker {
    place: Vec<[f32; 3]>,
}

impl SpaceLinker {
    /// Of object pixels in space.
    pub fn new(objects: &ObjectPixels, params: &TreeMerge) -> Self {
        SpaceLinker { place: places(objects, params) }
    }
}

impl Linker for SpaceLinker {
    fn reaches(&self) -> &'static [f32] {
        &[0.25, 0.7]
    }

    fn nearest(&mut self, reach: f32, mut visit: impl FnMut(Link)) {
        let mut sets = DisjointSets::new(self.place.len());
        for link in within_cells(&self.place, reach / FINER) {
            sets.join(link.a as usize, link.b as usize);
            visit(link);
        }
        let group: Vec<u32> = (0..self.place.len()).map(|a| sets.root(a) as u32).collect();
        self.between(&group, reach, visit);
    }

    fn between(&mut self, group: &[u32], reach: f32, visit: impl FnMut(Link)) {
        between_groups(&self.place, group, reach).into_iter().for_each(visit);
    }
}

/// Links between the first pixel of each cell and its others.
fn within_cells(place: &[[f32; 3]], side: f32) -> Vec<Link> {
    let mut first: FxHashMap<Cell, u32> = FxHashMap::default();
    let link = |b: u32| {
        let a = *first.entry(cell(place[b as usize], side)).or_insert(b);
        let squared = squared_distance(place[a as usize], place[b as usize]);
        (a != b).then(|| Link { distance: squared.sqrt(), a, b })
    };
    (0..place.len() as u32).filter_map(link).collect()
}

/// Links between pixels of different groups within reach, for one pixel of each group and cell.
fn between_groups(place: &[[f32; 3]], group: &[u32], reach: f32) -> Vec<Link> {
    let mut seen = FxHashSet::default();
    let is_first =
        |&a: &u32| seen.insert((group[a as usize], cell(place[a as usize], reach / FINER)));
    let chosen: Vec<u32> = (0..place.len() as u32).filter(is_first).collect();
    let mut cells: FxHashMap<Cell, Vec<u32>> = FxHashMap::default();
    for &a in &chosen {
        cells.entry(cell(place[a as usize], reach)).or_default().push(a);
    }
    let mut links = Vec::new();
    for &a in &chosen {
        let (p, own) = (place[a as usize], group[a as usize]);
        let near = around(cell(p, reach)).filter_map(|cell| cells.get(&cell)).flatten();
        for &b in near.filter(|&&b| b > a && group[b as usize] != own) {
            let squared = squared_distance(p, place[b as usize]);
            if squared <= reach * reach {
                links.push(Link { distance: squared.sqrt(), a, b });
            }
        }
    }
    links
}

fn cell(at: [f32; 3], side: f32) -> Cell {
    at.map(|along| (along / side).floor() as i32)
}

/// A cell and those next to it.
fn around([x, y, z]: Cell) -> impl Iterator<Item = Cell> {
    let step = |from: i32, by: i32| from.saturating_add(by);
    (0..27).map(move |i| [step(x, i / 9 - 1), step(y, i / 3 % 3 - 1), step(z, i % 3 - 1)])
}

fn squared_distance(p: [f32; 3], q: [f32; 3]) -> f32 {
    (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum()
}

/// N: the label of each object point, given those of the pixels: its own pixel's where it is seen
/// there, else that of the nearest pixel in space across [`TreeMerge::background`] at most; 0 of
/// all other points.
pub(super) fn labels_of_points(input: &MethodInput, label: &[u32], reach: f64) -> Vec<u32> {
    let MethodInput { cloud, image, objects, .. } = *input;
    let places: Vec<[f64; 3]> = objects.position.iter().map(|&at| wide(at)).collect();
    let tree = KdTree::new(&places);
    let mut of_point = vec![0; cloud.len()];
    for point in objects.points.iter().map(|&point| point as usize) {
        let nearest = || {
            let near = tree.nearest(wide(cloud.position(point)), 1, reach);
            near.first().map(|near| near.point as usize)
        };
        let object = match image.is_shadowed(point) {
            true => nearest(),
            false => objects.at(image.pixel_of_point[point] as usize),
        };
        of_point[point] = object.map_or(0, |object| label[object]);
    }
    of_point
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::ClusterParams;
    use crate::cluster::tree::nodes::Tree;

    fn objects(position: Vec<[f32; 3]>) -> ObjectPixels {
        ObjectPixels { pixel: (0..position.len() as u32).collect(), position, ..Default::default() }
    }

    /// The gaps across which groups become one are those between them, but for what one pixel
    /// stands for.
    #[test]
    fn gaps_between_groups_are_found_whatever_the_order() {
        let params = ClusterParams::best().tree.expect("best cuts a tree");
        let bar = |y: f32| (0..200).map(move |i| [0.02 * i as f32, y, 0.0]);
        let gaps = [0.15, 0.6, 1.7];
        let mut y = 0.0;
        let mut all: Vec<[f32; 3]> = bar(0.0).collect();
        for gap in gaps {
            y += gap;
            all.extend(bar(y));
        }
        for turn in [0, 1, 333] {
            all.rotate_left(turn);
            let mut linker = SpaceLinker::new(&objects(all.clone()), &params);
            let tree = Tree::grow(all.len(), &mut linker, &params).tree;
            let joined = tree.nodes.iter().filter(|node| node.children.is_some());
            let births: Vec<f32> = joined.map(|node| node.birth).collect();
            assert_eq!(births.len(), gaps.len(), "{births:?}");
            for (found, gap) in births.iter().zip(gaps) {
                assert!((gap - 1e-3..1.2 * gap).contains(found), "{found} for {gap}");
            }
        }
    }

    #[test]
    fn many_pixels_at_one_place_take_linear_time() {
        let params = ClusterParams::best().tree.expect("best cuts a tree");
        let crowd = |i: usize| [3.0, 1.0 + 1e-6 * (i % 100) as f32, 0.5];
        let objects = objects((0..100_000).map(crowd).collect());
        let mut links = 0;
        SpaceLinker::new(&objects, &params).nearest(params.nearest as f32, |_| links += 1);
        assert_eq!(links, 99_999);
    }
}
