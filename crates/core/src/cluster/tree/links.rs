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
    let mut padded = Padded::new(objects, &place, image, &window);
    let mut links = Vec::new();
    let mut sets = DisjointSets::new(objects.len());
    // Up to the nearest gap only what hangs together matters.
    padded.visit(&window.steps, params.nearest, |link| {
        if sets.join(link.a as usize, link.b as usize) {
            links.push(link);
        }
    });
    padded.regroup(&mut sets);
    let first = links.len();
    padded.visit(&window.steps, NEAR.min(params.farthest), |link| links.push(link));
    for link in &links[first..] {
        sets.join(link.a as usize, link.b as usize);
    }
    padded.regroup(&mut sets);
    padded.visit(&window.steps, params.farthest, |link| links.push(link));
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

/// What a place of the padded image holds: position of its object pixel, metres, heights weighed,
/// and the set that the pixel is in, or [`NO_OBJECT`]. In one piece, as both are read together.
#[derive(Debug, Clone, Copy)]
struct Cell {
    position: [f32; 3],
    group: u32,
}

/// The image with a margin as wide as the window below each sensor's rows and beside them, so that
/// no step leaves it. Beside the seam of a full turn the margin repeats the other side.
struct Padded {
    stride: usize,
    cells: Vec<Cell>,
    /// Object pixel at each place, or [`NO_OBJECT`].
    object: Vec<u32>,
    /// Places beside the seam and those that they repeat.
    repeated: Vec<[u32; 2]>,
    /// M: the place of each object pixel.
    place: Vec<u32>,
    /// M: distance from the sensor, metres.
    range: Vec<f32>,
    /// M: on which sides of each object pixel the next one is of its own group.
    own: Vec<u8>,
}

/// Sides of a pixel on which steps leave it, as bits.
const RIGHT: u8 = 1;
const LEFT: u8 = 2;
const BELOW: u8 = 4;

/// The sides on which a step leaves a pixel.
fn sides(down: usize, right: isize) -> u8 {
    let below = if down > 0 { BELOW } else { 0 };
    match right {
        1.. => below | RIGHT,
        0 => below,
        _ => below | LEFT,
    }
}

impl Padded {
    /// Of object pixels at M positions, each a group of its own.
    fn new(
        objects: &ObjectPixels,
        positions: &[[f32; 3]],
        image: &RangeImage,
        window: &Window,
    ) -> Self {
        let (columns, margin) = (image.columns(), window.columns);
        let stride = columns + 2 * margin;
        let rows = image.rows() + image.bands.len() * window.rows;
        let mut cells = vec![Cell { position: [0.0; 3], group: NO_OBJECT }; rows * stride];
        let mut object = vec![NO_OBJECT; rows * stride];
        let mut repeated = Vec::new();
        let mut place = Vec::with_capacity(objects.len());
        let mut range = Vec::with_capacity(objects.len());
        for (number, &pixel) in (0..).zip(&objects.pixel) {
            let (row, column) = (pixel as usize / columns, pixel as usize % columns);
            let band = image.band_of_row(row);
            let start = (row + band * window.rows) * stride;
            let at = start + margin + column;
            let beyond = [
                (image.wraps && column < margin).then_some(at + columns),
                (image.wraps && column + margin >= columns).then(|| at - columns),
            ];
            let beyond = beyond.into_iter().flatten();
            repeated.extend(beyond.clone().map(|again| [again as u32, at as u32]));
            for at in beyond.chain([at]) {
                object[at] = number;
                cells[at] = Cell { position: positions[number as usize], group: number };
            }
            place.push(at as u32);
            let position = objects.position[number as usize].map(f64::from);
            let from_sensor = image.bands[band].from_sensor(position);
            range.push(from_sensor.iter().map(|x| x * x).sum::<f64>().sqrt() as f32);
        }
        let own = vec![0; objects.len()];
        Padded { stride, cells, object, repeated, place, range, own }
    }

    /// Each pixel's group becomes the set that it is in.
    fn regroup(&mut self, sets: &mut DisjointSets) {
        let set: Vec<u32> = (0..self.place.len()).map(|object| sets.root(object) as u32).collect();
        for ((&at, &own), sides) in self.place.iter().zip(&set).zip(&mut self.own) {
            let at = at as usize;
            let around = [(RIGHT, at + 1), (LEFT, at - 1), (BELOW, at + self.stride)];
            *sides = 0;
            for (side, at) in around {
                let object = self.object[at];
                if object != NO_OBJECT && set[object as usize] == own {
                    *sides |= side;
                }
            }
            self.cells[at].group = own;
        }
        for &[again, at] in &self.repeated {
            self.cells[again as usize].group = self.cells[at as usize].group;
        }
    }

    /// Visits the links across some steps up to a distance in metres between pixels of different
    /// groups, but for those that begin across pixels of their own group: from there it is nearer.
    ///
    /// Whether a step leads to another group, and near enough, follows no pattern that a processor
    /// could foresee, so that it is found without a branch.
    fn visit(&self, steps: &[Step], reach: f64, mut visit: impl FnMut(Link)) {
        let reach = reach as f32;
        let mut steps: [Steps; 8] =
            std::array::from_fn(|own| Steps::new(self.steps_leaving(steps, own as u8)));
        let mut links = vec![(0.0, 0_u32); steps[0].all.len()];
        for (a, (&at, range)) in (0..).zip(self.place.iter().zip(&self.range)) {
            let at = at as usize;
            let Cell { position: p, group } = self.cells[at];
            let mut found = 0;
            for &(ahead, _) in steps[usize::from(self.own[a as usize])].within(reach / range) {
                let other = self.cells[at + ahead];
                let q = other.position;
                let squared: f32 = (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum();
                links[found] = (squared, (at + ahead) as u32);
                let is_other = (other.group != group) & (other.group != NO_OBJECT);
                found += usize::from(is_other & (squared <= reach * reach));
            }
            for &(squared, other) in &links[..found] {
                visit(Link { distance: squared.sqrt(), a, b: self.object[other as usize] });
            }
        }
    }

    /// The steps that leave a pixel not only on sides where the next one is of its own group: how
    /// far ahead they lead, and the least angle across which they may lead, radians.
    fn steps_leaving(&self, steps: &[Step], own: u8) -> Vec<(usize, f32)> {
        /// By how much less a step may lead across than the steps between columns and rows say: the
        /// rows of a sensor need not be even.
        const UNEVEN: f32 = 0.7;
        let leaving = steps.iter().filter(|step| sides(step.0, step.1) & !own != 0);
        let ahead = |&(down, right, across): &Step| {
            ((down * self.stride).wrapping_add_signed(right), UNEVEN * across)
        };
        leaving.map(ahead).collect()
    }
}

/// Steps by the angle that they lead across, ascending.
struct Steps {
    /// How far ahead each leads, and the angle, radians.
    all: Vec<(usize, f32)>,
    /// How many of them were within the last angle.
    near: usize,
}

impl Steps {
    fn new(all: Vec<(usize, f32)>) -> Self {
        Steps { all, near: 0 }
    }

    /// Those up to an angle. Pixels next to each other mostly have as many.
    fn within(&mut self, angle: f32) -> &[(usize, f32)] {
        while self.all.get(self.near).is_some_and(|&(_, across)| across <= angle) {
            self.near += 1;
        }
        while self.near > 0 && self.all[self.near - 1].1 > angle {
            self.near -= 1;
        }
        &self.all[..self.near]
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
    // Signed, as processors have an instruction for it.
    let keys: Vec<i32> = links.iter().map(|link| (link.distance * PER_METRE) as i32).collect();
    let mut start = vec![0_u32; (params.farthest as f32 * PER_METRE) as usize + 2];
    for &key in &keys {
        start[key as usize + 1] += 1;
    }
    for place in 1..start.len() {
        start[place] += start[place - 1];
    }
    let mut sorted = vec![Link { distance: 0.0, a: 0, b: 0 }; links.len()];
    for (link, &key) in links.iter().zip(&keys) {
        let place = &mut start[key as usize];
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
