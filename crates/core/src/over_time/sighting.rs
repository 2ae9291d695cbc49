//! An instance of a frame in the tracker's world.

use nalgebra::{Isometry3, Point3, Vector2, Vector3};

use super::observation::{ObservedInstance, cell_side};
use crate::cloud::Body;

/// An instance of a frame, in the tracker's world: metres, z up.
#[derive(Debug, Clone)]
pub(super) struct Sighting {
    /// Seconds.
    pub time: f64,
    pub semantic: u16,
    pub body: Option<Body>,
    pub points: u32,
    /// Length, width, height of its box.
    pub size: [f32; 3],
    /// Direction of the length, radians.
    pub yaw: f32,
    /// Mean of the cells on the plane.
    pub middle: Vector2<f64>,
    pub cells: Cells,
    /// How near cells of two sightings are that may be the same, metres.
    pub reach: f32,
}

/// Variance of the mean of so many points that lie anywhere along a body of usual length, square
/// metres: two points of a far car can be of its nose in one frame and of its tail in the next. A
/// uniform distribution of width L has a variance of L²/12. Background has no usual length.
pub(super) fn sampling_variance(body: Option<Body>, points: u32) -> f64 {
    let length: f64 = match body {
        Some(Body::Person) => 0.6,
        Some(Body::TwoWheeler) => 1.8,
        Some(Body::Car) => 4.5,
        Some(Body::LargeVehicle) => 8.0,
        None => 0.0,
    };
    length.powi(2) / (12.0 * f64::from(points.max(1)))
}

/// The direction of a pose's x axis on the plane, radians.
pub(super) fn heading_of(pose: &Isometry3<f64>) -> f64 {
    let ahead = pose.rotation * Vector3::x();
    ahead.y.atan2(ahead.x)
}

/// Places, a column each, and the box around them.
#[derive(Debug, Clone, Default)]
pub(super) struct Cells {
    /// Columns of whole blocks of [`LANES`]; what is left of the last is infinitely far.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    count: usize,
    pub low: [f32; 3],
    pub high: [f32; 3],
}

/// Places that are compared at once.
const LANES: usize = 8;

impl Sighting {
    /// An instance seen from a pose, less the origin of the tracker's world.
    pub fn new(instance: &ObservedInstance, pose: &Isometry3<f64>, time: f64) -> Self {
        let heading = heading_of(pose) as f32;
        let pose = pose.cast::<f32>();
        let cells: Cells =
            instance.cells().map(|cell| (pose * Point3::from(cell)).coords.into()).collect();
        let count = cells.len().max(1);
        let mean = |column: &[f32]| {
            column.iter().take(cells.len()).map(|&at| f64::from(at)).sum::<f64>() / count as f64
        };
        let side = cell_side(instance.size.map(f64::from), instance.body) as f32;
        Sighting {
            time,
            semantic: instance.semantic,
            body: instance.body,
            points: instance.points,
            size: instance.size,
            yaw: instance.yaw + heading,
            middle: Vector2::new(mean(&cells.x), mean(&cells.y)),
            cells,
            reach: (0.15 + 0.6 * side).clamp(0.2, 0.5),
        }
    }

    /// Variance of the middle of its points along the object, square metres.
    pub fn sampling_variance(&self) -> f64 {
        sampling_variance(self.body, self.points)
    }

    /// Moves the world's origin.
    pub fn shift(&mut self, by: [f32; 3]) {
        self.middle -= Vector2::new(f64::from(by[0]), f64::from(by[1]));
        let Cells { x, y, z, low, high, .. } = &mut self.cells;
        for (axis, column) in [x, y, z].into_iter().enumerate() {
            column.iter_mut().for_each(|at| *at -= by[axis]);
            low[axis] -= by[axis];
            high[axis] -= by[axis];
        }
    }
}

impl Cells {
    pub fn len(&self) -> usize {
        self.count
    }

    pub fn at(&self, cell: usize) -> [f32; 3] {
        [self.x[cell], self.y[cell], self.z[cell]]
    }

    pub fn iter(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.count).map(|cell| self.at(cell))
    }

    /// Squared distances of the cells from a place, square metres, a block at a time.
    #[inline(always)]
    pub fn squared_from(&self, [x, y, z]: [f32; 3]) -> impl Iterator<Item = [f32; LANES]> {
        let columns = self.x.as_chunks::<LANES>().0.iter().zip(self.y.as_chunks::<LANES>().0);
        columns.zip(self.z.as_chunks::<LANES>().0).map(move |((a, b), c)| {
            std::array::from_fn(|lane| {
                let (dx, dy, dz) = (a[lane] - x, b[lane] - y, c[lane] - z);
                dx * dx + dy * dy + dz * dz
            })
        })
    }

    /// Whether a cell is within a squared distance of a place, square metres.
    #[inline]
    pub fn is_within(&self, at: [f32; 3], squared: f32) -> bool {
        let mut nearest = [f32::INFINITY; LANES];
        for block in self.squared_from(at) {
            nearest = std::array::from_fn(|lane| {
                if block[lane] < nearest[lane] { block[lane] } else { nearest[lane] }
            });
        }
        nearest.iter().any(|&nearest| nearest <= squared)
    }

    /// The squared distance of the cell nearest to a place, square metres, and its number; of
    /// equally near ones that of one of them, always the same.
    #[inline]
    pub fn nearest(&self, at: [f32; 3]) -> (f32, usize) {
        let (mut nearest, mut found) = ([f32::INFINITY; LANES], [0_u32; LANES]);
        for (number, block) in (0_u32..).zip(self.squared_from(at)) {
            for lane in 0..LANES {
                let is_nearer = block[lane] < nearest[lane];
                nearest[lane] = if is_nearer { block[lane] } else { nearest[lane] };
                found[lane] = if is_nearer { number } else { found[lane] };
            }
        }
        let first = (f32::INFINITY, 0);
        (0..LANES).fold(first, |best, lane| match nearest[lane] < best.0 {
            true => (nearest[lane], found[lane] as usize * LANES + lane),
            false => best,
        })
    }

    /// How many of the cells, moved on the plane, are within `reach` metres of one of others.
    pub fn count_near(&self, others: &Cells, [x, y]: [f32; 2], reach: f32) -> usize {
        let is_near = |&[a, b, c]: &[f32; 3]| {
            let at = [a + x, b + y, c];
            others.is_near(at, reach) && others.is_within(at, reach * reach)
        };
        self.iter().filter(is_near).count()
    }

    /// Whether a place is within `reach` metres of the box around the cells.
    pub fn is_near(&self, at: [f32; 3], reach: f32) -> bool {
        (0..3).all(|k| at[k] >= self.low[k] - reach && at[k] <= self.high[k] + reach)
    }

    /// Whether the boxes of these and of others, moved on the plane, are within `reach` metres.
    pub fn are_near(&self, others: &Cells, [x, y]: [f32; 2], reach: f32) -> bool {
        let shift = [x, y, 0.0];
        (0..3).all(|k| {
            others.low[k] + shift[k] <= self.high[k] + reach
                && others.high[k] + shift[k] >= self.low[k] - reach
        })
    }
}

impl FromIterator<[f32; 3]> for Cells {
    fn from_iter<T: IntoIterator<Item = [f32; 3]>>(places: T) -> Self {
        let mut cells =
            Cells { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3], ..Cells::default() };
        for place in places {
            cells.x.push(place[0]);
            cells.y.push(place[1]);
            cells.z.push(place[2]);
            for (axis, at) in place.into_iter().enumerate() {
                cells.low[axis] = cells.low[axis].min(at);
                cells.high[axis] = cells.high[axis].max(at);
            }
        }
        cells.count = cells.x.len();
        for column in [&mut cells.x, &mut cells.y, &mut cells.z] {
            column.resize(cells.count.next_multiple_of(LANES), f32::INFINITY);
        }
        cells
    }
}
