//! Where the sensor of a cloud stands, in whatever frame the cloud was brought into: the
//! vehicle's, a level one, a map's.
//!
//! The frame's origin is believed where the rows of the image say that the beams leave from there.
//! Else it is looked for: with rows that are known, as the point whose cones they are ([`cones`]);
//! without, as the point from which the positions look like a sweep ([`search`]), which then has to
//! show beams. Where neither says anything, a frame that lies on the ground is looked at from the
//! height of a roof.

mod cones;
mod lines;
mod search;

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;

use super::coverage;
use super::image::{NOWHERE, RangeImage};
use super::projection::Projection;
use super::sweep::Sweep;
use crate::cloud::point_cloud::{PointCloud, wide};
use crate::geometry::statistics::median;
use cones::{RingReturn, View, disagreement, refined};

/// How it is known where a sensor stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// It is taken to stand at the origin of the cloud's frame, and nothing speaks against that.
    Origin,
    /// The user says so.
    Given,
    /// The beams are cones around that point.
    Beams,
    /// The recording's transforms say so, and nothing in the points does.
    Recorded,
    /// Nothing says where it stands. The frame lies on the ground, so it is looked at from above.
    Assumed,
}

/// Where a sensor stands in the cloud's frame, z its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Viewpoint {
    pub sensor: Isometry3<f64>,
    pub evidence: Evidence,
}

/// Rows are beams where their returns lie within this share of a quarter of the distance to the
/// next beam ([`disagreement`]). Beams of simulated and recorded sensors have 0.02 to 0.25, other
/// rows 0.6 to 1.
const BEAMS: f64 = 0.4;
/// Rows that fit so well are not fitted again from elsewhere.
const CLEARLY_BEAMS: f64 = 0.2;

/// Whether the rows of an image are beams that leave from the origin.
pub(super) fn is_origin(cloud: &PointCloud, image: &RangeImage) -> bool {
    const RETURNS: usize = 2048;
    match image.projection {
        Projection::ScanOrder | Projection::Elevations => true,
        Projection::UniformElevation => false,
        _ => {
            let returns = returns_by_row(cloud, image, RETURNS);
            disagreement(&returns, &View::upright(Vector3::zeros())) < BEAMS
        }
    }
}

/// Where the sensor stands of a cloud whose image from the origin shows no beams. `None` if for all
/// that is known it is the origin.
pub(super) fn find(cloud: &PointCloud, image: &RangeImage) -> Option<Viewpoint> {
    const RETURNS: usize = 3000;
    const POSITIONS: usize = 6000;
    let has_rows = image.projection != Projection::UniformElevation;
    let by_rows = match has_rows {
        true => returns_by_row(cloud, image, RETURNS),
        false => returns_by_ring(cloud, RETURNS),
    };
    let of_beams = |view: View| Viewpoint { sensor: view.pose(), evidence: Evidence::Beams };
    if has_rows && let Some(view) = of_beams_nearby(cloud, &by_rows) {
        return Some(of_beams(view));
    }
    let positions = positions(cloud, POSITIONS);
    let elsewhere = Elsewhere::of(cloud, &positions)?;
    let searched = || {
        search::search(&positions).find_map(|place| {
            let view = View::upright(place.cast());
            let lines = || lines::returns_by_line(&positions, &place);
            checked(view, &by_rows).or_else(|| checked(view, &lines()))
        })
    };
    match of_beams_nearby(cloud, &by_rows).or_else(searched) {
        Some(view) => Some(of_beams(view)),
        None if has_rows => None,
        None => elsewhere.assumed(&cloud.recorded_sensors),
    }
}

/// Why the sensor may not stand at the origin.
enum Elsewhere {
    /// The frame lies on the ground, where no sensor could see it.
    OverGround,
    /// Nothing was measured near the origin; the returns are most even from this place.
    Far(Vector3<f32>),
    /// From there the returns crowd in some directions.
    Uneven,
}

impl Elsewhere {
    /// `None` where nothing speaks against the origin.
    fn of(cloud: &PointCloud, positions: &[Vector3<f32>]) -> Option<Elsewhere> {
        /// A sweep has returns in the directions that it covers about as many as in others, nats.
        /// From the origin of their own frames simulated sensors that look all round have up to
        /// 0.3 less than from the best place, for objects near by.
        const UNEVEN: f32 = 0.35;
        /// Distance across the ground within which a sensor has returns, metres, and their share.
        const NEAR: f32 = 10.0;
        const SHARE: f32 = 0.01;
        if is_on_ground(cloud) {
            return Some(Elsewhere::OverGround);
        }
        let near = positions.iter().filter(|at| at.xy().norm() < NEAR).count();
        if (near as f32) < SHARE * positions.len() as f32 {
            return search::start(positions).map(Elsewhere::Far);
        }
        let azimuths = positions.iter().map(|at| at.y.atan2(at.x));
        let closes = coverage::covered(azimuths).1 >= std::f64::consts::TAU;
        let is_uneven = || Some(search::unevenness(positions, &search::start(positions)?) > UNEVEN);
        (closes && is_uneven()?).then_some(Elsewhere::Uneven)
    }

    /// Where to look from, for want of better: where the recording has its only sensor, a car's roof
    /// over a frame on the ground, or the place from which the returns are even. `None` for the
    /// origin, against which too little speaks.
    fn assumed(&self, recorded: &[Vector3<f64>]) -> Option<Viewpoint> {
        const ROOF: f64 = 1.8;
        let (origin, evidence) = match (recorded, self) {
            ([only], _) => (*only, Evidence::Recorded),
            (_, Elsewhere::OverGround) => (Vector3::z() * ROOF, Evidence::Assumed),
            (_, Elsewhere::Far(place)) => (place.cast(), Evidence::Assumed),
            (_, Elsewhere::Uneven) => return None,
        };
        Some(Viewpoint { sensor: View::upright(origin).pose(), evidence })
    }
}

/// The view under which rows are beams, from where the recording has sensors and where they mostly
/// stand in the frame of a vehicle.
fn of_beams_nearby(cloud: &PointCloud, returns: &[RingReturn]) -> Option<View> {
    let usual = [0.0, 1.0, 2.0].map(|height| Vector3::z() * height);
    let starts = cloud.recorded_sensors.iter().chain(&usual);
    let views = starts.map(|&start| refined(returns, View::upright(start)));
    let scored = views.map(|view| (view, disagreement(returns, &view)));
    let (view, misfit) = scored.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (misfit < CLEARLY_BEAMS).then_some(view)
}

/// The view near a first one under which rows are beams, if there is one.
fn checked(start: View, returns: &[RingReturn]) -> Option<View> {
    let view = refined(returns, start);
    (disagreement(returns, &view) < BEAMS).then_some(view)
}

/// At most so many returns with their rows in an image, evenly spread over it.
fn returns_by_row(cloud: &PointCloud, image: &RangeImage, count: usize) -> Vec<RingReturn> {
    let every = (image.rows() * image.columns()).div_ceil(count).max(1);
    let of_row = |ring: usize| {
        // A shift of its own for each row, lest a narrow gap in the columns hide from the sample.
        let pixels = image.point_of_pixel.row(ring).iter().skip(ring % every).step_by(every);
        let seen = pixels.filter(|&&point| point != NOWHERE);
        seen.map(move |&point| RingReturn { position: position(cloud, point as usize), ring })
    };
    (0..image.rows()).flat_map(of_row).collect()
}

/// About so many returns with the rings that the cloud gives them.
fn returns_by_ring(cloud: &PointCloud, count: usize) -> Vec<RingReturn> {
    let Some(ring) = &cloud.ring else {
        return Vec::new();
    };
    let of = |point: usize| RingReturn {
        position: position(cloud, point),
        ring: usize::from(ring[point]),
    };
    sample(cloud, count).map(of).collect()
}

/// About so many returns.
fn positions(cloud: &PointCloud, count: usize) -> Vec<Vector3<f32>> {
    sample(cloud, count).map(|point| Vector3::from(cloud.position(point))).collect()
}

/// About so many returns, the same ones whatever the order of the points.
fn sample(cloud: &PointCloud, count: usize) -> impl Iterator<Item = usize> {
    let sweep = Sweep::new(cloud);
    let all = sweep.sample;
    let every = all.len().div_ceil(count).max(1);
    all.into_iter().step_by(every).map(|point| point as usize)
}

fn position(cloud: &PointCloud, point: usize) -> Vector3<f64> {
    Vector3::from(wide(cloud.position(point)))
}

/// Whether the origin of a cloud's frame lies on the ground, as those of vehicles do: in most
/// cells around it the lowest return lies at its height, where no sensor could see it.
fn is_on_ground(cloud: &PointCloud) -> bool {
    /// Metres around the origin; farther where a sensor that looks up sees no ground so near.
    const AROUND: [f32; 2] = [16.0, 40.0];
    const FEWEST_CELLS: usize = 32;
    const ON_GROUND: f64 = 0.3;
    let of = |around: f32| Some(lowest(cloud, around)).filter(|cells| cells.len() >= FEWEST_CELLS);
    let heights = AROUND.into_iter().find_map(of);
    heights.is_some_and(|mut heights| median(&mut heights).is_some_and(|h| h.abs() < ON_GROUND))
}

/// The lowest return of each cell of a square that reaches so many metres around the origin.
fn lowest(cloud: &PointCloud, around: f32) -> Vec<f64> {
    const SIDE: usize = 32;
    let mut lowest = [f64::INFINITY; SIDE * SIDE];
    let cell = 2.0 * around / SIDE as f32;
    for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
        let [x, y, z] = cloud.position(point);
        if x.abs() < around && y.abs() < around {
            let [row, column] = [x, y].map(|along| ((along + around) / cell) as usize);
            let lowest = &mut lowest[row.min(SIDE - 1) * SIDE + column.min(SIDE - 1)];
            *lowest = lowest.min(f64::from(z));
        }
    }
    lowest.into_iter().filter(|z| z.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use divmerge_simulate::{Drive, Mount, Scene, Sensor};
    use nalgebra::Point3;

    /// A sweep in the frame of the vehicle's foot.
    fn swept(sensor: Sensor, mount: Mount) -> PointCloud {
        let mut drive = Drive::new(sensor, Scene::Street, 4);
        drive.mount = mount;
        let cloud = drive.frame(2).cloud;
        let to_vehicle = |point: usize| {
            let at = Point3::from(cloud.position(point).map(f64::from));
            mount.vehicle_from_sensor() * at
        };
        let moved: Vec<Point3<f64>> = (0..cloud.len()).map(to_vehicle).collect();
        let column = |axis: usize| moved.iter().map(|at| at[axis] as f32).collect();
        let moved = PointCloud::new(column(0), column(1), column(2)).unwrap();
        moved.with_ring(cloud.ring.clone().unwrap()).unwrap()
    }

    fn found(cloud: &PointCloud) -> Option<Viewpoint> {
        let image = super::super::one_sensor::from_origin(cloud, &Default::default());
        match is_origin(cloud, &image) {
            true => None,
            false => find(cloud, &image),
        }
    }

    #[test]
    fn finds_a_sensor_by_its_rings() {
        let corner =
            Mount { ahead: 2.0, left: 0.9, yaw: 0.8, pitch: 0.05, roll: -0.1, ..Mount::level(1.0) };
        for sensor in [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Vls128] {
            for mount in [Mount { ahead: 0.3, ..Mount::level(2.0) }, corner] {
                let cloud = swept(sensor, mount);
                let found = found(&cloud).expect("a pose").sensor;
                let expected = mount.vehicle_from_sensor();
                let off = (found.translation.vector - expected.translation.vector).norm();
                let leaning = (found * Vector3::z()).angle(&(expected * Vector3::z()));
                assert!(off < 0.05 && leaning < 0.005, "{sensor}: {off} m, {leaning} rad");
            }
        }
    }

    /// The drive's third cloud in its vehicle's frame, or in the sensor's own.
    fn swept_all(drive: &Drive, own: bool) -> PointCloud {
        let cloud = drive.frame(2).cloud;
        let mount = drive.mount;
        let column = |axis: usize| {
            (0..cloud.len())
                .map(|p| {
                    let here = cloud.position(p);
                    if !cloud.is_return(p) || own {
                        return here[axis];
                    }
                    let at = mount.vehicle_from_sensor() * Point3::from(here.map(f64::from));
                    at[axis] as f32
                })
                .collect()
        };
        let moved = PointCloud::new(column(0), column(1), column(2)).unwrap();
        let moved = match &cloud.ring {
            Some(r) => moved.with_ring(r.clone()).unwrap(),
            None => moved,
        };
        moved.organised(cloud.height, cloud.width).unwrap()
    }
    #[test]
    fn survey3() {
        for sensor in Sensor::ALL {
            for scene in [Scene::Street, Scene::Hills, Scene::Yard] {
                let mut drive = Drive::new(sensor, scene, 4);
                drive.mount = Mount { ahead: 0.3, ..Mount::level(2.0) };
                let moved = swept_all(&drive, false).with(|c| c.ring = None).unwrap();
                let positions = positions(&moved, 6000);
                let image = super::super::one_sensor::from_origin(&moved, &Default::default());
                let t = std::time::Instant::now();
                let u = search::unevenness(&positions, &search::start(&positions).unwrap());
                let t1 = t.elapsed();
                let s = find(&moved, &image);
                let own = swept_all(&drive, true);
                let image1 = super::super::one_sensor::from_origin(&own, &Default::default());
                let s1 = if is_origin(&own, &image1) { None } else { find(&own, &image1) };
                println!(
                    "   own {:?} {} {:.3?}",
                    image1.projection,
                    is_origin(&own, &image1),
                    s1.map(|s| s.sensor.translation.vector.transpose())
                );
                println!(
                    "{sensor} {scene:?} {:?} unevenness {u:.2} {:?} {:?} {:.3?}",
                    image.projection,
                    t1,
                    t.elapsed(),
                    s.map(|s| s.sensor.translation.vector.transpose())
                );
            }
        }
    }

    #[test]
    fn rings_that_are_no_beams_say_nothing() {
        let cloud = swept(Sensor::M1, Mount::level(1.8));
        let found = found(&cloud).map(|found| found.evidence);
        assert_eq!(found, Some(Evidence::Assumed));
    }
}
