//! What registration keeps of a cloud.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cloud::PointCloud;
use crate::pipeline::Stages;

/// Units of a stored coordinate in a metre. A unit of a centimetre would move a whole ring of far
/// ground up or down by the same half of it, more than the ground falls off from scan to scan.
const PER_METRE: f32 = 400.0;

/// Bytes of a stored point.
const POINT_BYTES: usize = 6;

/// How a cloud is thinned out for registration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScanParams {
    /// Side of the voxels of which each keeps one point, metres; they are half as high. 0.35: a
    /// quarter of the voxel of the map, so that it has several points after one scan. Flat voxels
    /// keep more of walls and posts, which hold the motion ahead, than of the ground.
    #[schemars(range(min = 0.1, max = 10.0), extend("unit" = "m", "slider" = [0.1, 2.0]))]
    pub voxel: f64,
    /// Points at most. 12000: of 52 pairs of labelled scans the second, where nothing came before,
    /// is off by more than 0.15 m in 12 with 3000, in two with 6000, and in none with 12000.
    #[schemars(range(min = 1, max = 1000000))]
    #[schemars(extend("unit" = "points", "slider" = [1000, 40000]))]
    pub max_points: usize,
    /// Points nearer than this are left out, metres. 2.5: the vehicle that carries the sensor moves
    /// along with it.
    #[schemars(range(min = 0.0, max = 80.0), extend("unit" = "m", "slider" = [0.0, 10.0]))]
    pub nearest: f64,
    /// Points farther than this along x or y are left out, metres; 80 at most, the greatest that is
    /// stored. 80: beyond, beams are metres apart.
    #[schemars(range(min = 1.0, max = 80.0), extend("unit" = "m", "slider" = [20.0, 80.0]))]
    pub farthest: f64,
}

impl Default for ScanParams {
    fn default() -> Self {
        ScanParams { voxel: 0.35, max_points: 12_000, nearest: 2.5, farthest: 80.0 }
    }
}

/// The points of one cloud that registration uses, in the cloud's frame (the sensor's, upright), in
/// steps of 2.5 mm: six bytes a point.
///
/// A scan and the scan read back from its bytes are equal, so that a run that is resumed registers
/// the very same values.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RegistrationScan {
    points: Vec<[i16; 3]>,
}

impl RegistrationScan {
    /// The points of a clustered cloud that stand still as far as its run can tell: no returns of
    /// things where there are classes, and of no instance with the coarse class of an object where
    /// there are none.
    pub fn new(cloud: &PointCloud, stages: &Stages, params: &ScanParams) -> Self {
        let Stages { mask, labels, instances, .. } = stages;
        let has_classes = mask.has_classes();
        Self::from_points(cloud, params, |point| match labels.instance[point] {
            0 => has_classes && mask.is_object[point],
            id => has_classes || instances[id as usize - 1].is_object(),
        })
    }

    /// The points of a cloud, less those that may move: of each voxel the first return, and of
    /// these every n-th where there are too many.
    pub fn from_points(
        cloud: &PointCloud,
        params: &ScanParams,
        may_move: impl Fn(usize) -> bool,
    ) -> Self {
        let mut voxels = VoxelSet::new(params);
        // The origin is no return.
        let nearest = params.nearest as f32;
        let squared_nearest = (nearest * nearest).max(f32::MIN_POSITIVE);
        let mut points = Vec::new();
        for point in 0..cloud.len() {
            let position @ [x, y, z] = cloud.position(point);
            let is_near = x * x + y * y + z * z < squared_nearest;
            if !is_near && !may_move(point) && voxels.insert(position) {
                points.push(position.map(|along| (along * PER_METRE).round() as i16));
            }
        }
        if points.len() > params.max_points {
            let (count, kept) = (points.len(), params.max_points);
            points = (0..kept).map(|number| points[number * count / kept]).collect();
        }
        RegistrationScan { points }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points, metres.
    pub fn positions(&self) -> impl Iterator<Item = [f64; 3]> {
        let metres = |along: i16| f64::from(along) / f64::from(PER_METRE);
        self.points.iter().map(move |point| point.map(metres))
    }

    /// The points as bytes: x, y and z of each as little-endian numbers of 16 bits.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.points.iter().flatten().flat_map(|along| along.to_le_bytes()).collect()
    }

    /// The scan that [`to_bytes`](Self::to_bytes) wrote; `None` if the bytes are no whole points.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (points, rest) = bytes.as_chunks::<POINT_BYTES>();
        let point = |&[a, b, c, d, e, f]: &[u8; POINT_BYTES]| {
            [[a, b], [c, d], [e, f]].map(i16::from_le_bytes)
        };
        rest.is_empty().then(|| RegistrationScan { points: points.iter().map(point).collect() })
    }
}

/// Which voxels around the sensor have a point: a bit for each.
struct VoxelSet {
    bits: Vec<u64>,
    per_metre: f32,
    /// Voxels from one side to the other, and from the lowest to the highest.
    across: usize,
    upright: usize,
    farthest: f32,
}

impl VoxelSet {
    /// Metres below and above the sensor that are looked at: steep hills and tall houses.
    const BELOW: f32 = 20.0;
    const ABOVE: f32 = 30.0;
    /// Metres that are looked at sideways at most: an `i16` holds 81.9.
    const LIMIT: f32 = 80.0;

    fn new(params: &ScanParams) -> Self {
        let farthest = (params.farthest as f32).clamp(1.0, Self::LIMIT);
        let per_metre = 1.0 / (params.voxel as f32).clamp(0.1, 10.0);
        let voxels = |metres: f32| (metres * per_metre) as usize + 1;
        let height = 2.0 * (Self::BELOW + Self::ABOVE);
        let (across, upright) = (voxels(2.0 * farthest), voxels(height));
        let words = (across * across * upright).div_ceil(64);
        VoxelSet { bits: vec![0; words], per_metre, across, upright, farthest }
    }

    /// Adds the voxel of a position, and says whether that is new. Positions that are no returns,
    /// or too far, have none.
    fn insert(&mut self, [x, y, z]: [f32; 3]) -> bool {
        let is_within = x.abs() < self.farthest && y.abs() < self.farthest;
        if !is_within || !(-Self::BELOW..Self::ABOVE).contains(&z) {
            return false;
        }
        let voxel = |metres: f32| (metres * self.per_metre) as usize;
        let [column, row] = [x, y].map(|along| voxel(along + self.farthest));
        let level = voxel(2.0 * (z + Self::BELOW));
        let bit = (row * self.across + column) * self.upright + level;
        let (word, mask) = (bit / 64, 1 << (bit % 64));
        let is_new = self.bits[word] & mask == 0;
        self.bits[word] |= mask;
        is_new
    }
}
