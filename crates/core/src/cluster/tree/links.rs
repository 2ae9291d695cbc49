//! Links between object pixels that lie near each other, the shortest first.
//!
//! A link joins two pixels of one window of the range image. The window need not reach farther than
//! the gap from which on things count as apart ([`TreeMerge::window`]), and is sampled: every
//! column and row next to a pixel, fewer farther away. Pixels of different sensors (a merged cloud)
//! are linked in space, each to its nearest ones of every other sensor.

use crate::cluster::objects::ObjectPixels;
use crate::cluster::params::TreeMerge;
use crate::geometry::disjoint_sets::DisjointSets;
use crate::geometry::kd_tree::KdTree;
use crate::range_image::RangeImage;

/// Two object pixels and their distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Distance in metres, heights weighed by [`TreeMerge::height_weight`].
    pub distance: f32,
    /// Object pixel.
    pub a: u32,
    /// Object pixel.
    pub b: u32,
}

const NO_OBJECT: u32 = u32::MAX;

/// The image as the window reads it: dense, a value for each pixel.
struct Dense<'a> {
    image: &'a RangeImage,
    /// Object pixel, or [`NO_OBJECT`].
    object: Vec<u32>,
    /// The group of pixels within [`TreeMerge::nearest`] that an object pixel is in.
    group: Vec<u32>,
    /// Position in metres, heights weighed.
    place: Vec<[f32; 3]>,
}

/// Links up to [`TreeMerge::farthest`], ascending by distance to half a millimetre. Within a group
/// of pixels that lie within [`TreeMerge::nearest`] of one another there are as many as it takes to
/// hold it together.
///
/// Time O(M) for a window of a given size; O(M log M) where there are several sensors.
pub fn links(
    objects: &ObjectPixels,
    image: &RangeImage,
    row_step: f64,
    params: &TreeMerge,
) -> Vec<Link> {
    let weight = params.height_weight as f32;
    let place: Vec<[f32; 3]> =
        objects.position.iter().map(|&[x, y, z]| [x, y, weight * z]).collect();
    let mut dense = Dense {
        image,
        object: vec![NO_OBJECT; image.point_of_pixel.len()],
        group: vec![NO_OBJECT; image.point_of_pixel.len()],
        place: vec![[0.0; 3]; image.point_of_pixel.len()],
    };
    for ((number, &pixel), &place) in (0..).zip(&objects.pixel).zip(&place) {
        dense.object[pixel as usize] = number;
        dense.group[pixel as usize] = number;
        dense.place[pixel as usize] = place;
    }
    let mut links = Vec::new();
    join_nearest(objects, &mut dense, params, &mut links);
    let column_step = image.bands[0].column_step;
    let reach = |step: f64, least: f64| (params.window / step).ceil().clamp(least, 64.0) as usize;
    let steps = window(reach(row_step / params.height_weight, 2.0), reach(column_step, 4.0));
    let farthest = (params.farthest * params.farthest) as f32;
    dense.visit(objects, &steps, |a, b, squared| {
        if squared <= farthest {
            links.push(Link { distance: squared.sqrt(), a, b });
        }
    });
    link_sensors(objects, image, &place, params, &mut links);
    sorted(&links, params)
}

/// Links each pixel to those right beside it that lie within [`TreeMerge::nearest`], and numbers
/// the groups.
fn join_nearest(
    objects: &ObjectPixels,
    dense: &mut Dense,
    params: &TreeMerge,
    links: &mut Vec<Link>,
) {
    let mut sets = DisjointSets::new(objects.len());
    let nearest = (params.nearest * params.nearest) as f32;
    dense.visit(objects, &[(0, 1), (1, 0), (0, 2), (1, 1), (1, -1)], |a, b, squared| {
        if squared <= nearest && sets.join(a as usize, b as usize) {
            links.push(Link { distance: squared.sqrt(), a, b });
        }
    });
    for (number, &pixel) in objects.pixel.iter().enumerate() {
        dense.group[pixel as usize] = sets.root(number) as u32;
    }
}

impl Dense<'_> {
    /// Visits the pairs of object pixels of different groups that are one of the steps apart, with
    /// the square of their distance.
    fn visit(
        &self,
        objects: &ObjectPixels,
        steps: &[(usize, isize)],
        mut visit: impl FnMut(u32, u32, f32),
    ) {
        let (rows, columns) = (self.image.rows(), self.image.columns());
        let last_row_of_band: Vec<usize> = (0..rows)
            .map(|row| self.image.bands[self.image.band_of_row(row)].rows.end.min(rows))
            .collect();
        for (a, &pixel) in (0..).zip(&objects.pixel) {
            let pixel = pixel as usize;
            let (row, column) = (pixel / columns, pixel % columns);
            let (group, p) = (self.group[pixel], self.place[pixel]);
            for &(down, right) in steps {
                if row + down >= last_row_of_band[row] {
                    continue;
                }
                let beside = column as isize + right;
                let beside = match usize::try_from(beside).ok().filter(|&beside| beside < columns) {
                    Some(beside) => beside,
                    None if self.image.wraps => beside.rem_euclid(columns as isize) as usize,
                    None => continue,
                };
                let other = (row + down) * columns + beside;
                let b = self.object[other];
                if b == NO_OBJECT || self.group[other] == group {
                    continue;
                }
                let q = self.place[other];
                let squared = (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum();
                visit(a, b, squared);
            }
        }
    }
}

/// Steps down and to the right: each pair of pixels of a window is met once.
fn window(rows: usize, columns: usize) -> Vec<(usize, isize)> {
    let mut steps = Vec::new();
    for down in sampled(rows) {
        for right in sampled(columns) {
            if (down, right) != (0, 0) {
                steps.push((down, right as isize));
            }
            if down > 0 && right > 0 {
                steps.push((down, -(right as isize)));
            }
        }
    }
    steps
}

/// 0, 1, 2, 3, 5, 7, 10, ...: steps that grow by a third of the way.
fn sampled(most: usize) -> Vec<usize> {
    let next = |&at: &usize| Some(at + 1 + at / 3);
    std::iter::successors(Some(0), next).take_while(|&at| at <= most).collect()
}

/// Links each pixel to its nearest ones of every other sensor.
fn link_sensors(
    objects: &ObjectPixels,
    image: &RangeImage,
    place: &[[f32; 3]],
    params: &TreeMerge,
    links: &mut Vec<Link>,
) {
    /// So many that one which leads to another thing does not hide all others.
    const NEIGHBOURS: usize = 4;
    if image.bands.len() < 2 {
        return;
    }
    let band =
        |object: u32| image.band_of_row(objects.pixel[object as usize] as usize / image.columns());
    let of_band: Vec<usize> = (0..objects.len() as u32).map(band).collect();
    for sensor in 1..image.bands.len() {
        let own: Vec<u32> = (0..objects.len() as u32)
            .filter(|&object| of_band[object as usize] == sensor)
            .collect();
        let at = |object: u32| place[object as usize].map(f64::from);
        let tree = KdTree::new(&own.iter().map(|&object| at(object)).collect::<Vec<_>>());
        for a in (0..objects.len() as u32).filter(|&a| of_band[a as usize] < sensor) {
            for near in tree.nearest(at(a), NEIGHBOURS, params.farthest) {
                let (b, distance) = (own[near.point as usize], near.squared.sqrt() as f32);
                links.push(Link { distance, a, b });
            }
        }
    }
}

/// Links by distance: a counting sort by half millimetres, which keeps the order of equal ones.
fn sorted(links: &[Link], params: &TreeMerge) -> Vec<Link> {
    const PER_METRE: f32 = 2000.0;
    let key = |link: &Link| (link.distance * PER_METRE) as usize;
    let mut start = vec![0_u32; (params.farthest as f32 * PER_METRE) as usize + 2];
    for link in links {
        start[key(link) + 1] += 1;
    }
    for place in 1..start.len() {
        start[place] += start[place - 1];
    }
    let mut sorted = vec![Link { distance: 0.0, a: 0, b: 0 }; links.len()];
    for link in links {
        let place = &mut start[key(link)];
        sorted[*place as usize] = *link;
        *place += 1;
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_meets_every_pair_once() {
        assert_eq!(sampled(12), [0, 1, 2, 3, 5, 7, 10]);
        let steps = window(2, 1);
        assert_eq!(steps, [(0, 1), (1, 0), (1, 1), (1, -1), (2, 0), (2, 1), (2, -1)]);
    }

    #[test]
    fn the_shortest_come_first_and_equal_ones_stay_in_order() {
        let params = crate::cluster::ClusterParams::best().tree.expect("best cuts a tree");
        let link = |distance: f32, a: u32| Link { distance, a, b: 9 };
        let found = sorted(&[link(2.0, 0), link(0.5, 1), link(0.0, 2), link(0.5, 3)], &params);
        assert_eq!(found.iter().map(|link| link.a).collect::<Vec<_>>(), [2, 1, 3, 0]);
    }
}
