//! Which points belong to objects.

use std::collections::BTreeMap;

use super::ground::{Ground, GroundParams};
use crate::cloud::Reason;
use crate::cloud::point_cloud::PointCloud;
use crate::cloud::taxonomy::{ClassSize, Taxonomy};

/// How objects are told from the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MaskSource<'a> {
    /// Points whose class (`PointColumns::class`) is a thing of the taxonomy.
    Classes(&'a Taxonomy),
    /// The same, where a network found the classes: they may bleed onto the ground
    /// ([`GroundBleed`](super::GroundBleed)).
    NetworkClasses(&'a Taxonomy, &'a GroundParams),
    /// Returns that are not ground, by geometry alone.
    NotGround(&'a GroundParams),
    /// Every return.
    All,
    /// Returns that are marked, one mark for each of N points: for what-ifs with objects known
    /// otherwise.
    Marked(&'a [bool]),
}

impl<'a> MaskSource<'a> {
    /// What the classes mean, where objects are told by their classes.
    pub fn taxonomy(&self) -> Option<&'a Taxonomy> {
        match *self {
            MaskSource::Classes(taxonomy) | MaskSource::NetworkClasses(taxonomy, _) => {
                Some(taxonomy)
            }
            MaskSource::NotGround(_) | MaskSource::All | MaskSource::Marked(_) => None,
        }
    }

    /// Name of the class of a number; empty where there are no classes.
    pub fn class_name(&self, class: u16) -> &'a str {
        self.taxonomy().map_or("", |taxonomy| &taxonomy.classes()[usize::from(class)].name)
    }
}

/// Which of N points belong to objects, and to which class.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ObjectMask {
    /// N: whether the point is a return of an object.
    pub is_object: Vec<bool>,
    /// N: class number in the taxonomy; 0 where there are no classes or the id is unknown.
    pub class: Vec<u16>,
    /// N: why a point is not an object; [`Reason::None`] for objects.
    pub reason: Vec<Reason>,
    /// Returns whose id the taxonomy does not know.
    pub unknown_ids: u64,
    /// By class number: usual size of its objects; only that of "no class", none, without classes.
    pub sizes: Vec<Option<ClassSize>>,
    /// By class number: the class that stands for it and those it is easily taken for
    /// ([`Taxonomy::families`]).
    pub families: Vec<u16>,
    /// By class number: the groups of classes that look alike ([`Taxonomy::lookalikes`]).
    pub lookalikes: Vec<u8>,
    /// Points whose class was corrected, ascending, with the raw ids they have now.
    pub corrected: Vec<(u32, u16)>,
    /// Whether the classes were found to bleed onto the ground
    /// ([`GroundBleed`](super::GroundBleed)).
    pub bleeds: bool,
    /// N: how likely the point is ground, 0 to 1
    /// ([`Ground::confidence`](super::ground::Ground::confidence)); `None` where the ground was not
    /// looked for.
    pub ground: Option<Vec<f32>>,
    /// Whether ground removal found the ground above the sensor.
    pub ground_is_overhead: bool,
    /// Whether ground was looked for and none lies around the sensor.
    pub ground_is_missing: bool,
}

impl ObjectMask {
    /// The same with the ground that was found beside it.
    pub(super) fn with_ground(self, found: Ground) -> Self {
        ObjectMask {
            ground: Some(found.confidence),
            ground_is_overhead: found.is_overhead,
            ground_is_missing: found.is_missing,
            ..self
        }
    }

    /// Notes points with the raw ids that they have now. What was noted of them before goes.
    pub fn correct(&mut self, points: Vec<(u32, u16)>) {
        let mut all: BTreeMap<u32, u16> = self.corrected.drain(..).collect();
        all.extend(points);
        self.corrected = all.into_iter().collect();
    }

    /// N: the raw ids of a cloud's points, with what was corrected; 0 where it has none.
    pub fn raw_ids(&self, cloud: &PointCloud) -> Vec<u16> {
        let mut raw = cloud.class.clone().unwrap_or_else(|| vec![0; cloud.len()]);
        for &(point, id) in &self.corrected {
            raw[point as usize] = id;
        }
        raw
    }

    /// The points of objects, ascending.
    pub fn object_points(&self) -> Vec<u32> {
        const BLOCK: usize = 64;
        let mut points = Vec::new();
        for (first, block) in (0_u32..).step_by(BLOCK).zip(self.is_object.chunks(BLOCK)) {
            if block.iter().fold(false, |any, &is_object| any | is_object) {
                let found = (first..).zip(block).filter(|&(_, &is_object)| is_object);
                points.extend(found.map(|(point, _)| point));
            }
        }
        points
    }

    /// Whether objects were told by their classes.
    pub fn has_classes(&self) -> bool {
        self.sizes.len() > 1
    }
}
