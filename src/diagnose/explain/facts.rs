//! What is known of a point: its pixel, its component, its group, its neighbours.

use serde::Serialize;

use super::border::{BorderPair, pair};
use super::places::{Place, distance, place_of_object};
use super::subject::ClusteredCloud;
use divmerge_core::cloud::Reason;
use divmerge_core::cluster::back_projection::BackProjector;
use divmerge_core::pipeline::Stages;
use divmerge_core::range_image::{NEIGHBOURS, NO_NEIGHBOUR};

/// A component of the divide step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ComponentFacts {
    /// Its label from 1.
    pub label: u32,
    /// Number of its pixels.
    pub pixels: usize,
    /// Its seed; none of a leftover that no seed reached and that became a component of its own.
    pub seed: Option<Place>,
}

/// An instance of the merge step, before the later stages.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GroupFacts {
    /// Its number from 1.
    pub number: u32,
    /// Number of its components.
    pub components: usize,
    /// Number of its pixels.
    pub pixels: usize,
}

/// What is known of one point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointFacts {
    /// Index in the cloud.
    pub index: usize,
    /// Metres. Not a number where the beam came back with nothing.
    pub position: [f32; 3],
    /// Distance from the sensor, metres.
    pub range: f64,
    /// Class in the recording's ids; 0 where there are no classes.
    pub semantic: u16,
    /// Name of the class; empty where there are no classes.
    pub class_name: String,
    /// Final instance, or 0.
    pub instance: u32,
    /// Class name of that instance (majority of its points); empty where there is none.
    pub instance_class: String,
    /// Why there is none.
    pub reason: Reason,
    /// Row and column of its pixel.
    pub pixel: Option<[usize; 2]>,
    /// The nearer point that occupies its pixel, if it is shadowed.
    pub hidden_behind: Option<Place>,
    /// The pixel whose label it takes, if it is shadowed and there is one.
    pub label_from: Option<Place>,
    /// The component of its pixel, or of the one it takes its label from.
    pub component: Option<ComponentFacts>,
    /// The group of that component.
    pub group: Option<GroupFacts>,
    /// Its pixel's neighbours with their conditions; none of a point that is not an object.
    pub neighbours: Vec<BorderPair>,
    /// Object pixel number, its own or the one it takes its label from.
    #[serde(skip)]
    pub(crate) object: Option<usize>,
}

impl PointFacts {
    /// Gathers them.
    pub(super) fn of(frame: &ClusteredCloud, point: usize) -> Self {
        let ClusteredCloud { cloud, stages, .. } = frame;
        let labels = &stages.labels;
        let image = &stages.image;
        let pixel = image.pixel_of(point);
        let is_shadowed = image.is_shadowed(point);
        let input = stages.method_input(cloud, frame.config);
        let object = BackProjector::new(&input).source(point);
        let label = object.map_or(0, |object| stages.components.label[object]);
        let instance = labels.instance[point];
        let of_instance = stages.instances.iter().find(|found| found.id == instance);
        PointFacts {
            index: point,
            position: cloud.position(point),
            range: cloud.squared_range(point).sqrt(),
            semantic: cloud.class.as_ref().map_or(0, |class| class[point]),
            class_name: frame.mask.class_name(stages.mask.class[point]).to_owned(),
            instance,
            instance_class: of_instance.map(|found| found.class_name.clone()).unwrap_or_default(),
            reason: labels.reason[point],
            pixel: pixel.map(|pixel| [pixel / image.columns(), pixel % image.columns()]),
            hidden_behind: pixel.filter(|_| is_shadowed).map(|pixel| place(frame, pixel)),
            label_from: object
                .filter(|_| is_shadowed)
                .map(|object| place_of_object(stages, object)),
            component: (label != 0).then(|| component(stages, label)),
            group: (label != 0).then(|| group(stages, group_of(stages, label))),
            neighbours: object.map(|object| neighbours(frame, object)).unwrap_or_default(),
            object,
        }
    }
}

/// Distance of each point from the position that was asked for, both in the cloud's frame, metres.
pub fn distances(points: &[PointFacts], positions: &[[f64; 3]]) -> Vec<f64> {
    let pairs = points.iter().zip(positions);
    pairs.map(|(point, &at)| distance(point.position.map(f64::from), at)).collect()
}

fn place(frame: &ClusteredCloud, pixel: usize) -> Place {
    let image = &frame.stages.image;
    Place {
        row: pixel / image.columns(),
        column: pixel % image.columns(),
        position: image.point_at(pixel).map_or([f32::NAN; 3], |point| frame.cloud.position(point)),
    }
}

/// The group of a component.
pub(super) fn group_of(stages: &Stages, label: u32) -> u32 {
    stages.merge.instance_of_component[label as usize - 1]
}

pub(super) fn component(stages: &Stages, label: u32) -> ComponentFacts {
    let seed = stages.seeds.get(label as usize - 1);
    ComponentFacts {
        label,
        pixels: stages.components.label.iter().filter(|&&other| other == label).count(),
        seed: seed.map(|&seed| place_of_object(stages, seed as usize)),
    }
}

pub(super) fn group(stages: &Stages, number: u32) -> GroupFacts {
    let groups = &stages.merge.instance_of_component;
    GroupFacts {
        number,
        components: groups.iter().filter(|&&group| group == number).count(),
        pixels: pixels_of_group(stages, number).len(),
    }
}

/// The object pixels of a group.
pub(super) fn pixels_of_group(stages: &Stages, number: u32) -> Vec<usize> {
    (0..stages.objects.len()).filter(|&object| stages.merged_instance(object) == number).collect()
}

fn neighbours(frame: &ClusteredCloud, object: usize) -> Vec<BorderPair> {
    let neighbours = frame.stages.objects.neighbours[object];
    let present = (0..NEIGHBOURS).filter(|&direction| neighbours[direction] != NO_NEIGHBOUR);
    present.map(|direction| pair(frame, object, direction)).collect()
}
