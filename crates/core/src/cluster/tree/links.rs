//! Links between object pixels that lie near each other.
//!
//! A link joins two pixels of one window of the range image. The window need not reach farther than
//! the gap from which on things count as apart ([`TreeMerge::window`]), and is sampled: every
//! column and row next to a pixel, fewer farther away. Pixels of different sensors (a merged cloud)
//! are linked in space, each to its nearest ones of every other sensor. Where nobody knows where a
//! sensor stands, all are (`in_space`).

use crate::cloud::point_cloud::wide;
use crate::cluster::objects::ObjectPixels;
use crate::cluster::params::TreeMerge;
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

/// Finds the links between object pixels.
pub(super) trait Linker {
    /// Reaches between the nearest and the farthest, metres, ascending: few links are left between
    /// what is joined so far.
    fn reaches(&self) -> &'static [f32];

    /// Visits links of up to `reach` metres that join all pixels so near each other.
    fn nearest(&mut self, reach: f32, visit: impl FnMut(Link));

    /// Visits the links of up to `reach` metres between pixels of different groups, given the group
    /// of each of M object pixels.
    fn between(&mut self, group: &[u32], reach: f32, visit: impl FnMut(Link));
}

/// Links within a window of the range image, and in space between pixels of different sensors. Time
/// O(M) for a window of a given size; O(M log M) where there are several sensors.
pub(super) struct WindowLinker {
    steps: Vec<Step>,
    padded: Padded,
    /// Links between pixels of different sensors.
    between_sensors: Vec<Link>,
}

impl WindowLinker {
    /// Of the object pixels of an image, in whose rows the usual angle from one to the next is
    /// `row_step`, radians.
    pub fn new(
        objects: &ObjectPixels,
        image: &RangeImage,
        row_step: f64,
        params: &TreeMerge,
    ) -> Self {
        let place = places(objects, params);
        let column_step = image.bands[0].column_step;
        let window = Window::new(row_step * params.height_weight, column_step, params.window);
        WindowLinker {
            padded: Padded::new(objects, &place, image, &window),
            between_sensors: between_sensors(objects, image, &place, params),
            steps: window.steps,
        }
    }

    fn visit(&self, reach: f32, mut visit: impl FnMut(Link)) {
        self.padded.visit(&self.steps, reach, &mut visit);
        let is_near = |link: &&Link| link.distance <= reach;
        self.between_sensors.iter().filter(is_near).for_each(|link| visit(*link));
    }
}

impl Linker for WindowLinker {
    fn reaches(&self) -> &'static [f32] {
        &[0.25]
    }

    fn nearest(&mut self, reach: f32, visit: impl FnMut(Link)) {
        self.visit(reach, visit);
    }

    fn between(&mut self, group: &[u32], reach: f32, visit: impl FnMut(Link)) {
        self.padded.regroup(group);
        self.visit(reach, visit);
    }
}

/// M: the positions of the object pixels, metres, heights weighed.
pub(super) fn places(objects: &ObjectPixels, params: &TreeMerge) -> Vec<[f32; 3]> {
    let weight = params.height_weight as f32;
    objects.position.iter().map(|&[x, y, z]| [x, y, weight * z]).collect()
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
/// and the group of that, if there is one; else not a number, which is near nothing. In one piece,
/// as both are read together.
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
        let mut cells = vec![Cell { position: [f32::NAN; 3], group: NO_OBJECT }; rows * stride];
        let mut object = vec![NO_OBJECT; rows * stride];
        let mut repeated = Vec::new();
        let mut place = Vec::with_capacity(objects.len());
        let mut range = Vec::with_capacity(objects.len());
        let (mut band, mut begin, mut end, mut start) = (0, 0, 0, 0);
        for (number, &pixel) in (0..).zip(&objects.pixel) {
            let pixel = pixel as usize;
            if pixel >= end {
                let row = pixel / columns;
                (begin, end) = (row * columns, (row + 1) * columns);
                band = image.band_of_row(row);
                start = (row + band * window.rows) * stride + margin;
            }
            let (column, at) = (pixel - begin, start + pixel - begin);
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
            let position = wide(objects.position[number as usize]);
            let from_sensor = image.bands[band].from_sensor(position);
            range.push(from_sensor.iter().map(|x| x * x).sum::<f64>().sqrt() as f32);
        }
        let own = vec![0; objects.len()];
        Padded { stride, cells, object, repeated, place, range, own }
    }

    /// Gives each pixel another group.
    fn regroup(&mut self, group: &[u32]) {
        for ((&at, &own), sides) in self.place.iter().zip(group).zip(&mut self.own) {
            let at = at as usize;
            let around = [(RIGHT, at + 1), (LEFT, at - 1), (BELOW, at + self.stride)];
            *sides = 0;
            for (side, at) in around {
                let object = self.object[at];
                if object != NO_OBJECT && group[object as usize] == own {
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
    fn visit(&self, steps: &[Step], reach: f32, mut visit: impl FnMut(Link)) {
        let mut steps: [Steps; 8] =
            std::array::from_fn(|own| Steps::new(self.steps_leaving(steps, own as u8)));
        let most = reach * reach;
        let mut links = vec![(0.0, 0_u32); steps[0].ahead.len()];
        for (a, (&at, range)) in (0..).zip(self.place.iter().zip(&self.range)) {
            let at = at as usize;
            let Cell { position: p, group } = self.cells[at];
            let cells = &self.cells[at..];
            let mut found = 0;
            for &ahead in steps[usize::from(self.own[a as usize])].within(reach / range) {
                let Cell { position: q, group: other } = cells[ahead as usize];
                let [x, y, z] = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
                let squared = x * x + y * y + z * z;
                links[found] = (squared, ahead);
                found += usize::from((squared <= most) & (other != group));
            }
            for &(squared, ahead) in &links[..found] {
                let b = self.object[at + ahead as usize];
                visit(Link { distance: squared.sqrt(), a, b });
            }
        }
    }

    /// The steps that leave a pixel not only on sides where the next one is of its own group: how
    /// far ahead they lead, and the least angle across which they may lead, radians.
    fn steps_leaving(&self, steps: &[Step], own: u8) -> Vec<(u32, f32)> {
        /// By how much less a step may lead across than the steps between columns and rows say: the
        /// rows of a sensor need not be even.
        const UNEVEN: f32 = 0.7;
        let leaving = steps.iter().filter(|step| sides(step.0, step.1) & !own != 0);
        let ahead = |&(down, right, across): &Step| {
            ((down * self.stride).wrapping_add_signed(right) as u32, UNEVEN * across)
        };
        leaving.map(ahead).collect()
    }
}

/// Steps by the angle that they lead across, ascending.
struct Steps {
    /// How far ahead each leads.
    ahead: Vec<u32>,
    /// The angle, radians.
    across: Vec<f32>,
    /// How many of them were within the last angle.
    near: usize,
}

impl Steps {
    fn new(steps: Vec<(u32, f32)>) -> Self {
        let (ahead, across) = steps.into_iter().unzip();
        Steps { ahead, across, near: 0 }
    }

    /// Those up to an angle. Pixels next to each other mostly have as many.
    fn within(&mut self, angle: f32) -> &[u32] {
        while self.across.get(self.near).is_some_and(|&across| across <= angle) {
            self.near += 1;
        }
        while self.near > 0 && self.across[self.near - 1] > angle {
            self.near -= 1;
        }
        &self.ahead[..self.near]
    }
}

/// Links from each pixel to its nearest ones of every other sensor.
fn between_sensors(
    objects: &ObjectPixels,
    image: &RangeImage,
    place: &[[f32; 3]],
    params: &TreeMerge,
) -> Vec<Link> {
    /// So many that one which leads to another thing does not hide all others.
    const NEIGHBOURS: usize = 4;
    let mut links = Vec::new();
    if image.bands.len() < 2 {
        return links;
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
    links
}

/// Puts links in the order of their distances, none of them beyond `reach` metres: a counting sort
/// by a 512th of that, which keeps the order of equal ones.
pub(super) fn sort(links: &[Link], reach: f32, sorted: &mut Vec<Link>) {
    const STEPS: usize = 512;
    let per_metre = STEPS as f32 / reach;
    // Signed, as processors have an instruction for it.
    let key = |link: &Link| ((link.distance * per_metre) as i32 as usize).min(STEPS);
    let mut start = [0_u32; STEPS + 2];
    for link in links {
        start[key(link) + 1] += 1;
    }
    for place in 1..start.len() {
        start[place] += start[place - 1];
    }
    sorted.resize(links.len(), Link { distance: 0.0, a: 0, b: 0 });
    for link in links {
        let place = &mut start[key(link)];
        sorted[*place as usize] = *link;
        *place += 1;
    }
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
        let link = |distance: f32, a: u32| Link { distance, a, b: 9 };
        let mut found = Vec::new();
        sort(&[link(2.0, 0), link(0.5, 1), link(0.0, 2), link(0.5, 3)], 2.0, &mut found);
        assert_eq!(found.iter().map(|link| link.a).collect::<Vec<_>>(), [2, 1, 3, 0]);
    }
}
