//! Which way up lies, by the points: away from the surface that lies under everything.

use nalgebra::Vector3;

use super::extent::sample;
use super::point_cloud::PointCloud;

/// A direction of the cloud's frame that may be up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Along x.
    X,
    /// Against x.
    MinusX,
    /// Along y.
    Y,
    /// Against y, as in the optical frame of a camera (x to the right, y down, z ahead).
    MinusY,
    /// Along z, as in most frames.
    Z,
    /// Against z.
    MinusZ,
}

impl Axis {
    /// All six.
    pub const ALL: [Axis; 6] =
        [Axis::Z, Axis::MinusZ, Axis::Y, Axis::MinusY, Axis::X, Axis::MinusX];

    /// Which axes lie across this one, and this one; and whether it is against its axis.
    fn parts(self) -> ([usize; 2], usize, bool) {
        match self {
            Axis::X => ([1, 2], 0, false),
            Axis::MinusX => ([1, 2], 0, true),
            Axis::Y => ([0, 2], 1, false),
            Axis::MinusY => ([0, 2], 1, true),
            Axis::Z => ([0, 1], 2, false),
            Axis::MinusZ => ([0, 1], 2, true),
        }
    }

    /// The direction as a unit vector.
    pub fn direction(self) -> Vector3<f64> {
        let (_, axis, is_against) = self.parts();
        let mut direction = Vector3::zeros();
        direction[axis] = if is_against { -1.0 } else { 1.0 };
        direction
    }

    /// The `--sensor-frame` of a frame in which up is so: which way its x, y and z look.
    pub fn sensor_frame(self) -> &'static str {
        match self {
            Axis::X => "ufl",
            Axis::MinusX => "dfr",
            Axis::Y => "rub",
            Axis::MinusY => "rdf",
            Axis::Z => "flu",
            Axis::MinusZ => "frd",
        }
    }
}

/// The lowest return of each square metre around the origin that has one, if up is the given
/// direction: its two coordinates across that direction and its height, metres. `reach` is how far
/// the square goes to each side, in whole metres; what is not farther than `nearest` is left out.
pub fn lowest_returns(
    cloud: &PointCloud,
    up: Axis,
    reach: usize,
    nearest: Option<f32>,
) -> Vec<[f32; 3]> {
    let ([one, other], axis, is_against) = up.parts();
    let (side, reach) = (2 * reach, reach as f32);
    let mut lowest: Vec<Option<[f32; 3]>> = vec![None; side * side];
    for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
        let position = cloud.position(point);
        let (a, b) = (position[one], position[other]);
        let height = if is_against { -position[axis] } else { position[axis] };
        let is_far = nearest.is_none_or(|nearest| a.hypot(b) > nearest);
        if a.abs() < reach && b.abs() < reach && is_far {
            let [row, column] = [a, b].map(|along| ((along + reach) as usize).min(side - 1));
            let lowest = &mut lowest[row * side + column];
            if lowest.is_none_or(|lowest| height < lowest[2]) {
                *lowest = Some([a, b, height]);
            }
        }
    }
    lowest.into_iter().flatten().collect()
}

/// Square metres of a level surface that has nothing beneath it, if up is the given direction:
/// cells of a metre around the sensor whose lowest return lies at the height that most do, less
/// those with a return beneath.
pub fn ground_area(cloud: &PointCloud, up: Axis) -> f32 {
    /// Metres around the sensor, and what is too near to count: a mount, a desk.
    const REACH: usize = 20;
    const MOUNT: f32 = 1.5;
    /// Thickness of a surface, metres, and how far beneath it a return speaks against it.
    const LAYER: f32 = 0.3;
    const BENEATH: f32 = 1.5 * LAYER;
    let lowest = lowest_returns(cloud, up, REACH, Some(MOUNT));
    let mut heights: Vec<f32> = lowest.into_iter().map(|[.., height]| height).collect();
    heights.sort_unstable_by(f32::total_cmp);
    let within = |from: f32, to: f32| {
        heights.partition_point(|&h| h <= to) - heights.partition_point(|&h| h < from)
    };
    let area = |&height: &f32| {
        let on = within(height - LAYER, height + LAYER) as f32;
        let beneath = within(f32::NEG_INFINITY, height - BENEATH) as f32;
        on - beneath
    };
    heights.iter().filter(|&&height| height < 0.0).map(area).fold(0.0, f32::max)
}

/// The direction that is up if it clearly is not z: of the surfaces that lie under everything the
/// largest is several times that which lies under it along z, or above. A camera that looks along z
/// has y down, where any floor lies under it so: what it sees ahead are walls.
pub fn unusual_up(cloud: &PointCloud) -> Option<Axis> {
    /// Square metres that a ground has at least, and the part of a floor that a camera sees.
    const LEAST: f32 = 32.0;
    const LEAST_OF_CAMERA: f32 = 4.0;
    const TIMES: f32 = 3.0;
    if looks_along_z(cloud) && ground_area(cloud, Axis::MinusY) > LEAST_OF_CAMERA {
        return Some(Axis::MinusY);
    }
    let usual = ground_area(cloud, Axis::Z).max(ground_area(cloud, Axis::MinusZ));
    let others = Axis::ALL.into_iter().filter(|axis| !matches!(axis, Axis::Z | Axis::MinusZ));
    let areas = others.map(|axis| (axis, ground_area(cloud, axis)));
    let (axis, area) = areas.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (area > LEAST && area > TIMES * usual).then_some(axis)
}

/// Whether all returns but some stray ones lie in the view of a camera that looks along z.
fn looks_along_z(cloud: &PointCloud) -> bool {
    /// Cosine of half the diagonal of a wide view, 50 degrees.
    const WIDEST: f32 = 0.64;
    const STRAY: f64 = 0.01;
    let returns = sample(cloud).filter(|&point| cloud.is_return(point));
    let (mut all, mut outside) = (0, 0);
    for [x, y, z] in returns.map(|point| cloud.position(point)) {
        all += 1;
        outside += usize::from(z < WIDEST * Vector3::new(x, y, z).norm());
    }
    all > 0 && outside as f64 <= STRAY * f64::from(all)
}

#[cfg(test)]
mod tests {
    use super::super::point_cloud::PointColumns;
    use super::*;

    /// A floor 1.5 m under the sensor and a wall to its left, in a frame whose axes look so.
    fn room(axes: [usize; 3], signs: [f32; 3]) -> PointCloud {
        let floor = (0..900).map(|i| [(i % 30) as f32 - 15.0, (i / 30) as f32 - 15.0, -1.5]);
        let wall = (0..90).map(|i| [(i % 30) as f32 - 15.0, 15.0, (i / 30) as f32 - 1.0]);
        let points: Vec<[f32; 3]> = floor.chain(wall).collect();
        let column = |axis: usize| {
            let along = |at: &[f32; 3]| signs[axis] * at[axes[axis]];
            points.iter().map(along).collect::<Vec<f32>>()
        };
        PointCloud::new(column(0), column(1), column(2)).unwrap()
    }

    /// What a camera 1 m over a floor sees of it and of a wall 4 m ahead, in steps of a degree; x
    /// to the right, y down and z ahead.
    fn camera() -> PointCloud {
        let degrees = |count: i32| (-count..=count).map(|at| (at as f32).to_radians().tan());
        let rays = degrees(21).flat_map(|down| degrees(34).map(move |right| (right, down)));
        let seen = rays.map(|(right, down)| {
            let range = if down > 0.0 { (1.0 / down).min(4.0) } else { 4.0 };
            [right * range, down * range, range]
        });
        let seen: Vec<[f32; 3]> = seen.collect();
        let column = |axis: usize| seen.iter().map(|at| at[axis]).collect::<Vec<f32>>();
        PointCloud::new(column(0), column(1), column(2)).unwrap()
    }

    #[test]
    fn a_camera_looks_ahead_along_z() {
        let cloud = camera();
        assert!(ground_area(&cloud, Axis::MinusY) < 32.0, "a small part of a floor");
        assert_eq!(unusual_up(&cloud), Some(Axis::MinusY));
        let PointColumns { x, y, z, .. } = cloud.into_columns();
        let upright = PointCloud::new(z, x, y.into_iter().map(|down| -down).collect()).unwrap();
        assert_eq!(unusual_up(&upright), None, "the same with z up");
    }

    #[test]
    fn up_is_away_from_the_floor() {
        assert_eq!(unusual_up(&room([0, 1, 2], [1.0; 3])), None, "z is up");
        assert_eq!(unusual_up(&room([0, 1, 2], [1.0, -1.0, -1.0])), None, "z is down");
        // x to the right, y down, z ahead.
        assert_eq!(unusual_up(&room([1, 2, 0], [-1.0, -1.0, 1.0])), Some(Axis::MinusY));
        assert_eq!(unusual_up(&room([2, 0, 1], [1.0; 3])), Some(Axis::X));
        let frames = Axis::ALL.map(Axis::sensor_frame);
        for (axis, frame) in Axis::ALL.into_iter().zip(frames) {
            let Ok(super::super::sensor_frame::SensorFrame::Turned(turn)) = frame.parse() else {
                panic!("{frame}");
            };
            assert!((turn * axis.direction() - Vector3::z()).norm() < 1e-9, "{frame}");
        }
    }
}
