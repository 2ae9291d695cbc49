//! Links between object pixels that lie near each other, the shortest first.
//!
//! A link joins two pixels of one window of the range image. The window need not reach farther than
//! the gap from which on things count as apart ([`TreeMerge::window`]), and is sampled: every
//! column and row next to a pixel, fewer farther away. Pixels of different sensors (a merged cloud)
//! are linked in space, each to its nearest ones of every other sensor. Where nobody knows where a
//! sensor stands, all are (`in_space`).

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

/// Links up to [`TreeMerge::farthest`], ascending by distance to half a millimetre: all those
/// within the window but those between pixels that shorter ones join already.
///
/// `row_step` is the usual angle between two rows, radians. Time O(M) for a window of a given size;
/// O(M log M) where there are several sensors.
pub fn links(
    objects: &ObjectPixels,
    image: &RangeImage,
    row_step: f64,
    params: &TreeMerge,
) -> Vec<Link> {
    /// Pixels so near each other are joined first, metres: few links are left between the rest.
    const NEAR: f64 = 0.25;
    let weight = params.height_weight as f32;
    let place: Vec<[f32; 3]> =
        objects.position.iter().map(|&[x, y, z]| [x, y, weight * z]).collect();
    let column_step = image.bands[0].column_step;
    let window = Window::new(row_step * params.height_weight, column_step, params.window);
    let padded = Padded::new(objects, image, &window);
    let mut links = Vec::new();
    let mut sets = DisjointSets::new(objects.len());
    for reach in [params.nearest, NEAR.min(params.farthest), params.farthest] {
        let group = padded.groups(&mut sets);
        let first = links.len();
        padded.visit(&group, &place, (&window.steps, reach), |link| links.push(link));
        for link in &links[first..] {
            sets.join(link.a as usize, link.b as usize);
        }
    }
    link_sensors(objects, image, &place, params, &mut links);
    sorted(&links, params)
}

/// A step down and to the right, and the angle that it leads across, radians.
type Step = (usize, isize, f32);

/// The pixels that one is linked with.
struct Window {
    /// Most rows down and most columns to a side.
    rows: usize,
    columns: usize,
    /// By angle, ascending: each pair of pixels is met once.
    steps: Vec<Step>,
}

impl Window {
    /// The window of pixels within an angle, given those between two rows and two columns, radians.
    fn new(row_step: f64, column_step: f64, angle: f64) -> Self {
        /// Rows and columns at least: where a sensor samples coarsely, or at random, what lies next
        /// to each other in space need not in the image.
        const LEAST: [f64; 2] = [4.0, 8.0];
        let most = |step: f64, least: f64| (angle / step).ceil().clamp(least, 64.0) as usize;
        let (rows, columns) = (most(row_step, LEAST[0]), most(column_step, LEAST[1]));
        let mut steps = Vec::new();
        for down in sampled(rows, 3) {
            for right in sampled(columns, 2) {
                let across = (down as f64 * row_step).hypot(right as f64 * column_step) as f32;
                if (down, right) != (0, 0) {
                    steps.push((down, right as isize, across));
                }
                if down > 0 && right > 0 {
                    steps.push((down, -(right as isize), across));
                }
            }
        }
        steps.sort_by(|a, b| a.2.total_cmp(&b.2));
        Window { rows, columns, steps }
    }
}

/// 0, 1, 2, ...: steps that grow by one with each `share` steps; rows lie farther apart than
/// columns.
fn sampled(most: usize, share: usize) -> Vec<usize> {
    let next = |&at: &usize| Some(at + 1 + at / share);
    std::iter::successors(Some(0), next).take_while(|&at| at <= most).collect()
}

const NO_OBJECT: u32 = u32::MAX;

/// The image with a margin as wide as the window below each sensor's rows and beside them, so that
/// no step leaves it. Beside the seam of a full turn the margin repeats the other side.
struct Padded {
    stride: usize,
    /// Object pixel at each place, or [`NO_OBJECT`].
    object: Vec<u32>,
    /// M: the place of each object pixel.
    place: Vec<u32>,
    /// M: distance from the sensor, metres.
    range: Vec<f32>,
}

impl Padded {
    fn new(objects: &ObjectPixels, image: &RangeImage, window: &Window) -> Self {
        let (columns, margin) = (image.columns(), window.columns);
        let stride = columns + 2 * margin;
        let rows = image.rows() + image.bands.len() * window.rows;
        let mut object = vec![NO_OBJECT; rows * stride];
        let mut place = Vec::with_capacity(objects.len());
        let mut range = Vec::with_capacity(objects.len());
        for (number, &pixel) in (0..).zip(&objects.pixel) {
            let (row, column) = (pixel as usize / columns, pixel as usize % columns);
            let band = image.band_of_row(row);
            let start = (row + band * window.rows) * stride;
            let at = start + margin + column;
            object[at] = number;
            if image.wraps && column < margin {
                object[at + columns] = number;
            }
            if image.wraps && column + margin >= columns {
                object[at - columns] = number;
            }
            place.push(at as u32);
            let position = objects.position[number as usize].map(f64::from);
            let from_sensor = image.bands[band].from_sensor(position);
            range.push(from_sensor.iter().map(|x| x * x).sum::<f64>().sqrt() as f32);
        }
        Padded { stride, object, place, range }
    }

    /// The set of each place's pixel, or [`NO_OBJECT`].
    fn groups(&self, sets: &mut DisjointSets) -> Vec<u32> {
        let of_object: Vec<u32> =
            (0..self.place.len()).map(|object| sets.root(object) as u32).collect();
        let group = |&object: &u32| match object {
            NO_OBJECT => NO_OBJECT,
            object => of_object[object as usize],
        };
        self.object.iter().map(group).collect()
    }

    /// Visits the links across some steps up to a distance in metres between pixels of different
    /// groups.
    fn visit(
        &self,
        group: &[u32],
        position: &[[f32; 3]],
        (steps, reach): (&[Step], f64),
        mut visit: impl FnMut(Link),
    ) {
        /// By how much less a step may lead across than the steps between columns and rows say: the
        /// rows of a sensor need not be even.
        const UNEVEN: f32 = 0.7;
        let reach = reach as f32;
        let ahead = |&(down, right, across): &Step| {
            ((down * self.stride).wrapping_add_signed(right), UNEVEN * across)
        };
        let steps: Vec<(usize, f32)> = steps.iter().map(ahead).collect();
        for (a, &at) in (0..).zip(&self.place) {
            let at = at as usize;
            let (own, p) = (group[at], position[a as usize]);
            let widest = reach / self.range[a as usize];
            for &(ahead, across) in &steps {
                if across > widest {
                    break;
                }
                let of_other = group[at + ahead];
                if of_other == own || of_other == NO_OBJECT {
                    continue;
                }
                let b = self.object[at + ahead];
                let q = position[b as usize];
                let squared: f32 = (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum();
                if squared <= reach * reach {
                    visit(Link { distance: squared.sqrt(), a, b });
                }
            }
        }
    }
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
pub(super) fn sorted(links: &[Link], params: &TreeMerge) -> Vec<Link> {
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
        assert_eq!(sampled(12, 2), [0, 1, 2, 4, 7, 11]);
        assert_eq!(sampled(12, 3), [0, 1, 2, 3, 5, 7, 10]);
        let window = Window::new(1.0, 1.5, 2.0);
        assert_eq!((window.rows, window.columns), (4, 8));
        let steps: Vec<(usize, isize)> = window.steps.iter().map(|step| (step.0, step.1)).collect();
        assert_eq!(steps[..5], [(1, 0), (0, 1), (1, 1), (1, -1), (2, 0)]);
        let again = |&(down, right): &(usize, isize)| down > 0 && steps.contains(&(down, -right));
        assert!(steps.iter().all(|step| step.0 == 0 || step.1 == 0 || again(step)));
        assert!(window.steps.is_sorted_by(|a, b| a.2 <= b.2));
    }

    #[test]
    fn the_shortest_come_first_and_equal_ones_stay_in_order() {
        let params = crate::cluster::ClusterParams::best().tree.expect("best cuts a tree");
        let link = |distance: f32, a: u32| Link { distance, a, b: 9 };
        let found = sorted(&[link(2.0, 0), link(0.5, 1), link(0.0, 2), link(0.5, 3)], &params);
        assert_eq!(found.iter().map(|link| link.a).collect::<Vec<_>>(), [2, 1, 3, 0]);
    }
}
