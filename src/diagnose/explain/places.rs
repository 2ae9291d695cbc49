//! Pixels and points by their places, and the points that a question is about.

use serde::Serialize;

use super::subject::ClusteredCloud;
use crate::error::{Error, Result};
use divmerge_core::cloud::PointCloud;
use divmerge_core::pipeline::Stages;

/// A pixel of the range image and the point seen in it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Place {
    /// Row from 0.
    pub row: usize,
    /// Column from 0.
    pub column: usize,
    /// The point seen there, metres.
    pub position: [f32; 3],
}

/// The return nearest to a position in metres, if it is not farther than `within` metres from it.
///
/// # Errors
/// [`Error::NothingThere`], which says where the nearest return is.
pub fn return_at(cloud: &PointCloud, at: [f64; 3], within: f64) -> Result<usize> {
    let distance = |point: usize| distance(cloud.position(point).map(f64::from), at);
    let returns = (0..cloud.len()).filter(|&point| cloud.is_return(point));
    let nearest = returns.min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    match nearest {
        Some(point) if distance(point) <= within => Ok(point),
        _ => Err(Error::NothingThere {
            at,
            within,
            nearest: nearest.map(|point| (cloud.position(point), distance(point))),
        }),
    }
}

/// A point of each of two instances: the two that are nearest to each other, so that an explanation
/// of them is one of the instances' border.
///
/// # Errors
/// [`Error::NoInstance`] if one of them does not exist.
pub fn nearest_points(frame: &ClusteredCloud, a: u32, b: u32) -> Result<(usize, usize)> {
    let count = frame.stages.instances.len() as u32;
    if let Some(&id) = [a, b].iter().find(|&&id| id == 0 || id > count) {
        return Err(Error::NoInstance { id, count });
    }
    let labels = &frame.stages.labels.instance;
    let image = &frame.stages.image;
    let seen = |id: u32| -> Vec<usize> {
        let of_instance = (0..labels.len()).filter(|&point| labels[point] == id);
        of_instance.filter(|&point| !image.is_shadowed(point)).collect()
    };
    let position = |&point: &usize| frame.cloud.position(point).map(f64::from);
    let nearest = nearest_pair(&seen(a), &seen(b), position);
    nearest.map(|(a, b, _)| (a, b)).ok_or(Error::NoInstance { id: a, count })
}

pub(super) fn place_of_object(stages: &Stages, object: usize) -> Place {
    let (pixel, columns) = (stages.objects.pixel[object] as usize, stages.image.columns());
    let position = stages.objects.position[object];
    Place { row: pixel / columns, column: pixel % columns, position }
}

/// The two elements, one of each list, that are nearest to each other, and their distance.
pub(super) fn nearest_pair<T: Copy>(
    a: &[T],
    b: &[T],
    position: impl Fn(&T) -> [f64; 3],
) -> Option<(T, T, f64)> {
    let b: Vec<(T, [f64; 3])> = b.iter().map(|other| (*other, position(other))).collect();
    let mut best: Option<(T, T, f64)> = None;
    for one in a {
        let from = position(one);
        for &(other, to) in &b {
            let apart = distance(from, to);
            if best.is_none_or(|(_, _, least)| apart < least) {
                best = Some((*one, other, apart));
            }
        }
    }
    best
}

/// Metres between two positions.
pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}
