//! The geometry of a cloud as its image shows it, for people.

use serde::Serialize;

use super::angles::elevation_of;
use super::azimuth::azimuths;
use super::band::Band;
use super::beams::RingFlaw;
use super::evidence::Evidence;
use super::image::{NOWHERE, RangeImage};
use super::projection::Projection;
use super::sweep::Sweep;
use super::{beams, coverage};
use crate::cloud::PointCloud;
use crate::geometry::statistics::median;

/// What a cloud looks like from its sensors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Geometry {
    /// How the image was made.
    pub projection: Projection,
    /// What is wrong with the ring field, where it is left aside for that.
    pub ring_flaw: Option<RingFlaw>,
    /// Rows of the image.
    pub rows: usize,
    /// Columns of the image.
    pub columns: usize,
    /// Whether the first and the last column are neighbours.
    pub wraps: bool,
    /// By how many columns the rows of an organised cloud were turned against each other.
    pub stagger: usize,
    /// Points of the cloud.
    pub points: usize,
    /// Points that are returns.
    pub returns: usize,
    /// Returns behind a nearer one in their pixel.
    pub shadowed: usize,
    /// Share of the returns that are one of two or more of one shot.
    pub multiple_returns: f64,
    /// Each sensor.
    pub sensors: Vec<BandGeometry>,
}

/// What one sensor looks like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BandGeometry {
    /// Its number in the cloud.
    pub source: Option<u16>,
    /// How its rows were found.
    pub projection: Projection,
    /// Rows with a return.
    pub beams: usize,
    /// Least and most angle between neighbouring rows, degrees; `None` of fewer than two.
    pub beam_spacing_degrees: Option<[f64; 2]>,
    /// Angle of a column, degrees.
    pub column_degrees: f64,
    /// Elevation of the highest and the lowest row, degrees.
    pub elevation_degrees: [f64; 2],
    /// Azimuth at which the scan begins, counter-clockwise, and its width; degrees.
    pub azimuth_degrees: [f64; 2],
    /// Whether it looks all round.
    pub closes: bool,
    /// Where it stands in the cloud's frame, metres, and how its axis leans from the frame's z,
    /// degrees; `None` at the origin and along z.
    pub stands: Option<[f64; 4]>,
    /// How it is known where it stands.
    pub evidence: Evidence,
}

impl Geometry {
    /// The geometry of a cloud and its image.
    pub fn new(cloud: &PointCloud, image: &RangeImage) -> Self {
        let returns = image.return_count();
        Geometry {
            projection: image.projection,
            ring_flaw: ring_flaw(cloud, image),
            rows: image.rows(),
            columns: image.columns(),
            wraps: image.wraps,
            stagger: image.stagger,
            points: cloud.len(),
            returns,
            shadowed: image.shadowed_count(),
            multiple_returns: multiple_returns(cloud, image) as f64 / returns.max(1) as f64,
            sensors: image.bands.iter().map(|band| BandGeometry::new(cloud, image, band)).collect(),
        }
    }
}

/// What is wrong with the ring numbers of a cloud that they are not used for.
fn ring_flaw(cloud: &PointCloud, image: &RangeImage) -> Option<RingFlaw> {
    let ring = cloud.ring.as_ref()?;
    let is_used = image.bands.iter().any(|band| band.projection == Projection::Ring);
    if is_used { None } else { beams::ring_flaw(&Sweep::new(cloud), ring) }
}

/// Returns that lie on the ray of the nearest return of their pixel or have another one on theirs.
fn multiple_returns(cloud: &PointCloud, image: &RangeImage) -> usize {
    // A millimetre in 30 m: far below a column, above the rounding of the coordinates.
    const ONE_RAY: f64 = 3e-5;
    let mut is_leader = vec![false; cloud.len()];
    let mut behind = 0;
    for point in (0..cloud.len()).filter(|&point| image.is_shadowed(point)) {
        let pixel = image.pixel_of_point[point] as usize;
        let band = image.band_of(pixel);
        let leader = image.point_of_pixel.values()[pixel] as usize;
        let [a, b] = [point, leader]
            .map(|p| nalgebra::Vector3::from(band.in_sensor(cloud.position(p))).normalize());
        if (a - b).norm() < ONE_RAY {
            behind += 1;
            is_leader[leader] = true;
        }
    }
    behind + is_leader.into_iter().filter(|&is_leader| is_leader).count()
}

impl BandGeometry {
    fn new(cloud: &PointCloud, image: &RangeImage, band: &Band) -> Self {
        let mut elevations: Vec<f64> =
            band.rows.clone().filter_map(|row| row_elevation(cloud, image, band, row)).collect();
        elevations.sort_by(|a, b| b.total_cmp(a));
        let steps = elevations.windows(2).map(|pair| pair[0] - pair[1]);
        let spacing = steps.fold(None, |limits: Option<[f64; 2]>, step| match limits {
            None => Some([step; 2]),
            Some([least, most]) => Some([least.min(step), most.max(step)]),
        });
        let (start, width) = coverage::covered(band_azimuths(cloud, image, band).into_iter());
        let limits = [elevations.first(), elevations.last()].map(|e| e.copied().unwrap_or(0.0));
        let origin = band.sensor.translation.vector;
        let lean = (band.sensor * nalgebra::Vector3::z()).angle(&nalgebra::Vector3::z());
        BandGeometry {
            source: band.source,
            projection: band.projection,
            beams: elevations.len(),
            beam_spacing_degrees: spacing.map(|limits| limits.map(f64::to_degrees)),
            column_degrees: band.column_step.to_degrees(),
            elevation_degrees: limits.map(f64::to_degrees),
            azimuth_degrees: [start, width].map(f64::to_degrees),
            closes: width >= std::f64::consts::TAU,
            stands: (!band.is_at_origin() || band.evidence != Evidence::Origin)
                .then(|| [origin.x, origin.y, origin.z, lean.to_degrees()]),
            evidence: band.evidence,
        }
    }
}

/// Median elevation of the returns seen in a row, radians.
fn row_elevation(cloud: &PointCloud, image: &RangeImage, band: &Band, row: usize) -> Option<f64> {
    let seen = image.point_of_pixel.row(row).iter().filter(|&&point| point != NOWHERE);
    let elevation = |&point: &u32| elevation_of(band.in_sensor(cloud.position(point as usize)));
    median(&mut seen.map(elevation).collect::<Vec<f64>>())
}

/// Azimuths of the returns of a band, radians in its sensor's frame.
fn band_azimuths(cloud: &PointCloud, image: &RangeImage, band: &Band) -> Vec<f32> {
    if image.is_plain() {
        return azimuths(cloud);
    }
    let of = |row: usize| image.point_of_pixel.row(row).iter();
    let seen = band.rows.clone().flat_map(of).filter(|&&point| point != NOWHERE);
    let azimuth = |&point: &u32| {
        let [x, y, _] = band.in_sensor(cloud.position(point as usize));
        y.atan2(x) as f32
    };
    seen.map(azimuth).collect()
}
