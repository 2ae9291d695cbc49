//! What is kept of a frame to follow its instances: a few cells of each.

use serde::{Deserialize, Serialize};

use crate::cloud::taxonomy::body_of_class;
use crate::cloud::{Body, CoarseClass, Instance, PointCloud};
use crate::pipeline::Stages;

/// Most points of an instance that are looked at.
const MOST_SAMPLES: usize = 256;

/// Cells into which the sides of an object are divided, and those of background, about.
const CELLS: (f64, f64) = (48.0, 16.0);

/// Least side of a cell, metres: a few times the noise of a sensor.
const LEAST_CELL: f64 = 0.1;

/// Centimetres in a metre.
const PER_METRE: f32 = 100.0;

/// One instance of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservedInstance {
    /// Its id in the frame.
    pub id: u32,
    /// Class in the recording's ids, 0 where there are no classes.
    pub semantic: u16,
    /// What it is by its class or by its shape; `None` of background and of classes that are not
    /// known.
    pub body: Option<Body>,
    /// Number of its points.
    pub points: u32,
    /// Length, width and height of its box, metres.
    pub size: [f32; 3],
    /// Direction of the length, radians from the x axis of the cloud's frame.
    pub yaw: f32,
    /// Mean places of its points in the cells of a grid, centimetres, in the cloud's frame.
    pub cells: Vec<[i16; 3]>,
}

impl ObservedInstance {
    /// Number of the cell nearest to a place in the cloud's frame, metres; 0 without cells.
    pub(super) fn nearest_cell(&self, at: [f32; 3]) -> usize {
        let squared = |cell: [f32; 3]| (0..3).map(|k| (cell[k] - at[k]).powi(2)).sum::<f32>();
        let cells = self.cells().map(squared).enumerate();
        cells.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(cell, _)| cell)
    }

    /// The cells in metres.
    pub(super) fn cells(&self) -> impl Iterator<Item = [f32; 3]> {
        self.cells.iter().map(|cell| cell.map(|along| f32::from(along) / PER_METRE))
    }
}

/// The instances of a clustered cloud, by id.
pub fn observe(cloud: &PointCloud, stages: &Stages) -> Vec<ObservedInstance> {
    let samples = Samples::new(cloud, stages);
    let body = |instance: &Instance| match instance.coarse_class.map(|found| found.class) {
        Some(CoarseClass::Body(body)) => Some(body),
        Some(_) => None,
        None => body_of_class(&instance.class_name),
    };
    let of_instance = |instance: &Instance| ObservedInstance {
        id: instance.id,
        semantic: instance.semantic,
        body: body(instance),
        points: instance.points,
        size: instance.bounds.size.map(|along| along as f32),
        yaw: instance.bounds.yaw as f32,
        cells: cells(samples.of(instance.id), cell_side(instance.bounds.size, body(instance))),
    };
    stages.instances.iter().map(of_instance).collect()
}

/// Some points of each instance, evenly over its points in their order.
struct Samples {
    /// Where those of instance k begin, at k - 1; and where the last ones end.
    starts: Vec<usize>,
    positions: Vec<[f32; 3]>,
}

impl Samples {
    fn new(cloud: &PointCloud, stages: &Stages) -> Self {
        let count = stages.instances.last().map_or(0, |last| last.id as usize);
        let mut points = vec![0_usize; count];
        for instance in &stages.instances {
            points[instance.id as usize - 1] = instance.points as usize;
        }
        let strides: Vec<usize> =
            points.iter().map(|&points| points.div_ceil(MOST_SAMPLES).max(1)).collect();
        let mut starts = vec![0];
        for (points, stride) in points.iter().zip(&strides) {
            starts.push(starts[starts.len() - 1] + points.div_ceil(*stride));
        }
        let mut positions = vec![[0.0; 3]; starts[count]];
        let mut seen = vec![0_usize; count];
        for (point, &id) in stages.labels.instance.iter().enumerate() {
            if id == 0 {
                continue;
            }
            let instance = id as usize - 1;
            let (number, stride) = (seen[instance], strides[instance]);
            seen[instance] += 1;
            let at = starts[instance] + number / stride;
            if number % stride == 0 && at < starts[instance + 1] {
                positions[at] = cloud.position(point);
            }
        }
        Samples { starts, positions }
    }

    fn of(&self, id: u32) -> &[[f32; 3]] {
        &self.positions[self.starts[id as usize - 1]..self.starts[id as usize]]
    }
}

/// Side of a cell of an instance of some length, width and height, metres.
pub(super) fn cell_side([length, width, height]: [f64; 3], body: Option<Body>) -> f64 {
    let cells = if body.is_some() { CELLS.0 } else { CELLS.1 };
    ((length + width) * height.max(LEAST_CELL) / cells).sqrt().max(LEAST_CELL)
}

/// The mean places of points in the cells of a grid, by cell.
fn cells(points: &[[f32; 3]], side: f64) -> Vec<[i16; 3]> {
    let side = side as f32;
    let cell_of = |point: &[f32; 3]| point.map(|along| (along / side).floor() as i32);
    let mut placed: Vec<([i32; 3], [f32; 3])> =
        points.iter().map(|point| (cell_of(point), *point)).collect();
    placed.sort_unstable_by_key(|(cell, _)| *cell);
    let mean = |of_cell: &[([i32; 3], [f32; 3])]| {
        let sum = of_cell.iter().fold([0.0; 3], |sum: [f32; 3], (_, point)| {
            [sum[0] + point[0], sum[1] + point[1], sum[2] + point[2]]
        });
        sum.map(|along| (along / of_cell.len() as f32 * PER_METRE).round() as i16)
    };
    placed.chunk_by(|a, b| a.0 == b.0).map(mean).collect()
}
