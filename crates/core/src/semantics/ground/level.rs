//! Which way is up: the turn from the sensor's frame to one whose z is the normal of the ground
//! around it.
//!
//! Sensors are mounted tilted, hung upside down, and recorded in frames with z down. All later
//! steps read heights and slopes, so they are given the cloud turned until the ground around it
//! lies level.
//!
//! Steps: returns from which the next one of their column lies no steeper than `STEEPEST`, the
//! lowest and the highest of each cell around the sensor; the plane that most of the lowest lie on
//! and run along, and that of the highest, by random sample consensus (Fischler and Bolles 1981,
//! scored as Torr and Zisserman's MSAC 2000) over a fixed sequence of samples; the one below the
//! sensor unless the one above has several times its support. A ceiling over a floor is therefore a
//! ceiling, and a sensor that hangs upside down between both takes it for the floor.
//!
//! Places alone do not tell the floor in a small room: a tilted sensor sees a patch of floor on one
//! side and a patch of ceiling on the other, and a plane through both carries more cells than the
//! floor. The chords within each patch rise and fall against that plane.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::found::GroundPose;
use super::params::{CLEARANCE, GroundParams};
use crate::cloud::point_cloud::PointCloud;
use crate::range_image::{NOWHERE, RangeImage};

/// The turn that makes the ground level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    /// From the sensor's frame.
    rotation: Matrix3<f32>,
    /// Whether z points down in the sensor's frame.
    pub is_upside_down: bool,
}

/// Steepest chord between two returns of a column that are taken for ground, rise over run in the
/// sensor's frame: 40 degrees, 30 of tilt and a 10 % road on top.
const STEEPEST: f32 = 0.84;
/// Most tilt, as a tangent: 30 degrees.
const MOST_TILT: f32 = 0.58;
/// Nothing nearer to the sensor's axis says where the ground lies, metres: it is what the sensor is
/// mounted on, a desk, the vehicle.
const MOUNT: f32 = 1.5;
/// One column in this many is looked at.
const COLUMN_STRIDE: usize = 8;
/// Planes tried. With 40 % of the cells on the ground, the chance that none of so many samples of
/// three lies wholly on it is below one in a thousand.
const SAMPLES: u32 = 128;
/// Cells, spread over all of them, that choose among the planes.
const JUDGES: usize = 128;
/// Distance from a plane in metres at which a cell no longer supports it: a kerb and some bend.
const BAND: f32 = 0.3;
/// A plane above the sensor is the ground only with this many times the support of the one below:
/// from a sensor that hangs upside down there is sky below, and hardly a flat return. In simulated
/// streets, car parks and yards the ratio is at most 0.3 upright, and 6.6 or more upside down,
/// where the roofs of parked cars lie below.
const UPSIDE_DOWN_SUPPORT: f32 = 4.0;
/// Share of the flat cells above the sensor that then lie on the plane: the rest are the tops of
/// what stands on the ground. In simulated car parks it is 0.47 or more.
const UPSIDE_DOWN_SHARE: f32 = 0.33;
/// Cells that support the ground at least.
const FEWEST_CELLS: f32 = 4.0;
/// Greatest slope of a cell's chord against a plane that the cell supports, as a sine: 15 degrees,
/// twice the tilt that noise of 0.03 m gives a chord of 0.35 m. A plane from the floor on one side
/// of a room to the ceiling on the other leans by more, or meets but a strip of each.
const STEEPEST_ON_PLANE: f32 = 0.26;
/// Distance beyond a plane in metres from which on a cell speaks against it: nothing is seen
/// through the ground, but for a dip.
pub(super) const BEYOND: f32 = 3.0 * BAND;

impl Level {
    /// The sensor's own frame.
    #[cfg(test)]
    pub const IDENTITY: Level = Level {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        is_upside_down: false,
    };

    /// The level of the ground around the sensor; `None` where no plane below it is found, nor one
    /// above it that can be the ground of a sensor upside down.
    pub fn of_ground(
        cloud: &PointCloud,
        image: &RangeImage,
        params: &GroundParams,
    ) -> Option<Level> {
        let [below, above] = flat_cells(cloud, image, params);
        // A ground above has most cells above, wherever their chords lead.
        let above = above.into_iter().map(|flat| FlatReturn::at_place(flat.at));
        let above: Vec<FlatReturn> = above.collect();
        let ceiling = if cloud.is_z_up { None } else { Consensus::of(&above, Side::Above) };
        // Ground that a tilted sensor sees on both sides of its own plane is no floor.
        let others = below.iter().filter(|flat| ceiling.is_none_or(|plane| !plane.carries(flat)));
        let floor = Consensus::of(&others.copied().collect::<Vec<_>>(), Side::Below);
        let least_above = UPSIDE_DOWN_SUPPORT * floor.map_or(1.0, |floor| floor.support.max(1.0));
        let is_ground = |ceiling: &Consensus| {
            let carried = above.iter().filter(|flat| ceiling.carries(flat)).count();
            ceiling.support > least_above
                && carried as f32 > UPSIDE_DOWN_SHARE * above.len() as f32
                && !is_enclosed(cloud, params)
        };
        if let Some(ceiling) = ceiling.filter(is_ground) {
            return Some(Level::from_normal(-ceiling.refined(&above), true));
        }
        let floor = Consensus::of(&below, Side::Below)?;
        Some(Level::from_normal(floor.refined(&below), false))
    }

    /// The least turn that brings `up` to z, after half a turn about x where z points down.
    pub fn from_normal(up: Vector3<f32>, is_upside_down: bool) -> Level {
        let half_turn = match is_upside_down {
            true => Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)),
            false => Matrix3::identity(),
        };
        let turn = Rotation3::rotation_between(&(half_turn * up), &Vector3::z());
        let turn = turn.map_or(Matrix3::identity(), |turn| *turn.matrix());
        Level { rotation: turn * half_turn, is_upside_down }
    }

    /// How the ground lies in the sensor's frame.
    pub fn pose(&self) -> GroundPose {
        let upwards = self.rotation.m33.abs().min(1.0);
        GroundPose {
            lean_degrees: f64::from(upwards.acos().to_degrees()),
            is_overhead: self.is_upside_down,
        }
    }

    /// A position of the sensor's frame in the level frame, metres.
    pub fn turn(&self, position: [f32; 3]) -> [f32; 3] {
        // Written out: a call a point otherwise.
        let [x, y, z] = position;
        let row = |row: usize| {
            let turn = &self.rotation;
            turn[(row, 0)] * x + turn[(row, 1)] * y + turn[(row, 2)] * z
        };
        [row(0), row(1), row(2)]
    }
}

/// What a cell around the sensor knows of the ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct FlatReturn {
    /// Metres from the sensor.
    pub at: Vector3<f32>,
    /// Unit vector along the surface, the mean of the chords to and from the flat returns of the
    /// cell; zero where it is unknown, which lies along every plane.
    along: Vector3<f32>,
}

impl FlatReturn {
    /// A return on a surface that is known at this place alone.
    pub fn at_place(at: Vector3<f32>) -> Self {
        FlatReturn { at, along: Vector3::zeros() }
    }
}

/// Flat returns near the sensor: of each cell around it the lowest below the sensor, and the
/// highest above.
fn flat_cells(
    cloud: &PointCloud,
    image: &RangeImage,
    params: &GroundParams,
) -> [Vec<FlatReturn>; 2] {
    let (baseline, reach) = (params.baseline as f32, params.start_distance as f32);
    let mut extremes = [Extremes::new(params), Extremes::new(params)];
    let columns = image.columns().div_ceil(COLUMN_STRIDE);
    let mut last = vec![Vector3::repeat(f32::NAN); columns];
    for row in 0..image.rows() {
        let pixels = image.point_of_pixel.row(row).iter().step_by(COLUMN_STRIDE);
        for (&point, last) in pixels.zip(&mut last) {
            if point == NOWHERE {
                continue;
            }
            let here = Vector3::from(cloud.position(point as usize));
            let step = here - *last;
            let run = step.xy().norm();
            if run < baseline {
                continue;
            }
            // The first return of a column has no step: not a number, and not flat.
            let is_flat = step.z.abs() <= STEEPEST * run;
            for at in [here, *last].into_iter().filter(|at| is_flat && is_away(at)) {
                extremes[usize::from(at.z > 0.0)].keep(at, step, reach);
            }
            *last = here;
        }
    }
    extremes.map(|extremes| extremes.returns())
}

/// Whether a return may lie on the ground by its distance from the sensor.
fn is_away(at: &Vector3<f32>) -> bool {
    at.z.abs() > CLEARANCE && at.xy().norm() > MOUNT
}

/// Whether returns surround the sensor below its own height, as in a room. From a sensor that hangs
/// upside down over the ground there is sky in most directions.
fn is_enclosed(cloud: &PointCloud, params: &GroundParams) -> bool {
    const SECTORS: usize = 36;
    const MOST_OPEN: usize = 4;
    /// Metres below the sensor.
    const BELOW: f32 = 0.5;
    let reach = params.start_distance as f32;
    let mut is_closed = [false; SECTORS];
    for point in 0..cloud.len() {
        let [x, y, z] = cloud.position(point);
        if cloud.is_return(point) && z < -BELOW && x.hypot(y) < reach {
            let turn = (y.atan2(x) / std::f32::consts::TAU + 0.5).min(0.999_999);
            is_closed[(turn * SECTORS as f32) as usize] = true;
        }
    }
    is_closed.iter().filter(|&&is_closed| !is_closed).count() <= MOST_OPEN
}

/// The flat return farthest from the sensor's horizontal plane in each cell of a square around the
/// sensor, and the sum of the chords to and from those of the cell.
struct Extremes {
    cell: f32,
    side: usize,
    cells: Vec<Option<FlatReturn>>,
}

impl Extremes {
    /// Most cells from the sensor to the square's edge.
    const MOST: f32 = 64.0;

    fn new(params: &GroundParams) -> Self {
        let cell = params.cell as f32;
        let half = (params.start_distance as f32 / cell).clamp(1.0, Self::MOST);
        let side = 2 * half as usize + 1;
        Extremes { cell, side, cells: vec![None; side * side] }
    }

    fn keep(&mut self, at: Vector3<f32>, chord: Vector3<f32>, reach: f32) {
        if at.x.abs() >= reach || at.y.abs() >= reach {
            return;
        }
        let [row, column] =
            [at.x, at.y].map(|along| (along / self.cell + 0.5 * self.side as f32) as usize);
        if let Some(kept) = self.cells.get_mut(row * self.side + column) {
            let kept = kept.get_or_insert(FlatReturn::at_place(at));
            kept.along += chord;
            if at.z.abs() > kept.at.z.abs() {
                kept.at = at;
            }
        }
    }

    fn returns(self) -> Vec<FlatReturn> {
        let unit = |FlatReturn { at, along }| FlatReturn {
            at,
            along: along.try_normalize(0.0).unwrap_or_default(),
        };
        self.cells.into_iter().flatten().map(unit).collect()
    }
}

/// A side of the sensor, along its z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Below,
    Above,
}

/// A plane through three returns and how well the others agree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Consensus {
    /// Unit normal with positive z.
    normal: Vector3<f32>,
    offset: f32,
    /// Returns on the plane, less for those off it, less one for each beyond it.
    support: f32,
}

impl Consensus {
    /// The plane that most returns agree with, if there is one below or above the sensor.
    pub fn of(returns: &[FlatReturn], side: Side) -> Option<Consensus> {
        if returns.len() < 3 {
            return None;
        }
        let mut draw = Draws(0);
        let planes = (0..SAMPLES).filter_map(|_| {
            let sample = [(); 3].map(|()| returns[draw.below(returns.len())].at);
            Consensus::through(sample).filter(|plane| (plane.offset > 0.0) == (side == Side::Above))
        });
        let judges = returns.iter().step_by(returns.len().div_ceil(JUDGES));
        let judges: Vec<FlatReturn> = judges.copied().collect();
        let scored = planes.map(|plane| plane.supported_by(&judges));
        let best =
            scored.reduce(|best, next| if next.support > best.support { next } else { best });
        Some(best?.supported_by(returns)).filter(|plane| plane.support >= FEWEST_CELLS)
    }

    fn through([a, b, c]: [Vector3<f32>; 3]) -> Option<Consensus> {
        const LEAST_AREA: f32 = 1.0;
        let cross = (b - a).cross(&(c - a));
        let norm = cross.norm();
        let is_near_level = cross.xy().norm() <= MOST_TILT * cross.z.abs();
        if !(norm > LEAST_AREA && is_near_level) {
            return None;
        }
        let normal = cross * (cross.z.signum() / norm);
        let offset = normal.dot(&a);
        (offset.abs() > CLEARANCE).then_some(Consensus { normal, offset, support: 0.0 })
    }

    /// Whether a return agrees with the plane.
    pub fn carries(&self, flat: &FlatReturn) -> bool {
        (self.normal.dot(&flat.at) - self.offset).abs() < BAND && self.runs_along(flat)
    }

    /// Whether the surface at a return may lie in the plane.
    fn runs_along(&self, flat: &FlatReturn) -> bool {
        self.normal.dot(&flat.along).abs() < STEEPEST_ON_PLANE
    }

    fn supported_by(self, returns: &[FlatReturn]) -> Consensus {
        let agreement = |flat: &FlatReturn| {
            let beyond = (self.normal.dot(&flat.at) - self.offset) * self.offset.signum();
            let share = beyond / BAND;
            match beyond > BEYOND {
                true => -1.0,
                false if self.runs_along(flat) => (1.0 - share * share).max(0.0),
                false => 0.0,
            }
        };
        Consensus { support: returns.iter().map(agreement).sum(), ..self }
    }

    /// Unit normal of the least-squares plane through the returns that agree, with a weak pull to
    /// this plane, which settles what a single ring or line leaves open.
    pub fn refined(&self, returns: &[FlatReturn]) -> Vector3<f32> {
        let mut normal_matrix = Matrix3::from_diagonal(&Vector3::new(1e-3, 1.0, 1.0));
        let mut right = Vector3::zeros();
        for flat in returns {
            if self.carries(flat) {
                let at = flat.at;
                let residual = self.normal.dot(&at) - self.offset;
                let row = Vector3::new(1.0, at.x, at.y);
                normal_matrix += row * row.transpose();
                right += row * (residual / self.normal.z);
            }
        }
        let change = normal_matrix.cholesky().map_or(Vector3::zeros(), |solve| solve.solve(&right));
        let lean = self.normal / self.normal.z;
        Vector3::new(lean.x - change.y, lean.y - change.z, 1.0).normalize()
    }
}

/// A fixed sequence of numbers without pattern: Weyl's with the golden ratio, mixed.
struct Draws(u32);

impl Draws {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9);
        let mixed = (self.0 ^ (self.0 >> 16)).wrapping_mul(0x85EB_CA6B);
        let mixed = (mixed ^ (mixed >> 13)).wrapping_mul(0xC2B2_AE35);
        ((u64::from(mixed ^ (mixed >> 16)) * count as u64) >> 32) as usize
    }
}
