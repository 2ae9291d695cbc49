//! The facts that triage uses of every instance of a frame, gathered once.

use super::suspect::{Concern, Suspect, SuspectKind, TriageParams, ramp};
use crate::diagnose::explain::ClusteredCloud;
use divmerge_core::cloud::Instance;
use divmerge_core::cloud::taxonomy::ClassSize;
use divmerge_core::cluster::params::{ClusterParams, FragmentMerge};
use divmerge_core::geometry::footprint::{PlanePoint, convex_hull};
use divmerge_core::geometry::statistics::most_frequent;

/// An instance with its pixels and its outline.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InstanceFacts<'a> {
    /// The instance.
    pub instance: &'a Instance,
    /// Number of the family of its class; 0 where there are no classes.
    pub family: u16,
    /// Number of its class; 0 where there are no classes.
    pub class: u16,
    /// Usual size of its class.
    pub size: Option<ClassSize>,
    /// Its object pixels, ascending.
    pub objects: Vec<u32>,
    /// Its outline on the bird's-eye plane, metres.
    pub hull: Vec<PlanePoint>,
}

/// A run, its instances, and which instance each object pixel belongs to.
pub(super) struct FrameFacts<'a> {
    /// The run.
    pub frame: &'a ClusteredCloud<'a>,
    /// Points of an instance from which on suspects have their full score.
    full_stake: f64,
    /// The merge by size whose limits gaps and sizes are compared with: the run's own, or that of
    /// preset `best` if the run has none.
    pub by_size: FragmentMerge,
    /// The instances; instance k at k - 1.
    pub members: Vec<InstanceFacts<'a>>,
    /// M: final instance of each object pixel, or 0.
    pub instance_of: Vec<u32>,
    /// For each instance of the merge step its final instance, or 0; piece k at k - 1.
    pub instance_of_piece: Vec<u32>,
}

impl<'a> FrameFacts<'a> {
    /// Gathers the facts. O(M log M) in the object pixels.
    pub fn of(frame: &'a ClusteredCloud<'a>, params: &TriageParams) -> Self {
        let stages = frame.stages;
        let instance_of = instance_of(frame);
        let mut objects = vec![Vec::new(); stages.instances.len()];
        let mut instance_of_piece = vec![0; stages.merge.count as usize];
        for (object, &instance) in instance_of.iter().enumerate() {
            if instance != 0 {
                objects[instance as usize - 1].push(object as u32);
                let piece = stages.merged_instance(object);
                instance_of_piece[piece as usize - 1] = instance;
            }
        }
        let members = stages.instances.iter().zip(objects);
        let own = frame.config.cluster.fragments;
        FrameFacts {
            frame,
            full_stake: params.min_points.max(1) as f64,
            by_size: own.or(ClusterParams::best().fragments).expect("best merges by size"),
            members: members
                .map(|(instance, objects)| instance_facts(frame, instance, objects))
                .collect(),
            instance_of,
            instance_of_piece,
        }
    }

    /// The score of a suspect, weighed by its kind and by the number of points at stake.
    pub fn score(&self, kind: SuspectKind, evidence: f64, stake: f64) -> f64 {
        evidence * kind.weight() * ramp(stake, 0.0, self.full_stake)
    }

    /// A suspect at one instance, its figures and words still empty.
    pub fn suspect(&self, kind: SuspectKind, evidence: f64, member: &InstanceFacts) -> Suspect {
        Suspect {
            kind,
            score: self.score(kind, evidence, f64::from(member.instance.points)),
            evidence,
            concerns: vec![Concern::whole(member.instance.id)],
            points: Vec::new(),
            position: member.instance.bounds.centre,
            measured: 0.0,
            bound: 0.0,
            unit: "",
            sentence: String::new(),
        }
    }

    /// A suspect at two instances. The share of the larger is the size of the smaller in relation
    /// to it: the smaller can spoil no more of it.
    pub fn suspect_pair(
        &self,
        kind: SuspectKind,
        evidence: f64,
        [smaller, larger]: [&InstanceFacts; 2],
    ) -> Suspect {
        let mut suspect = self.suspect(kind, evidence, smaller);
        let share = smaller.objects.len() as f64 / larger.objects.len().max(1) as f64;
        suspect.concerns.push(Concern { instance: larger.instance.id, share: share.min(1.0) });
        suspect
    }

    /// The facts of an instance, by id.
    pub fn member(&self, id: u32) -> Option<&InstanceFacts<'a>> {
        self.members.get((id as usize).wrapping_sub(1))
    }

    /// Place of an object pixel on the bird's-eye plane, metres.
    pub fn place(&self, object: u32) -> PlanePoint {
        on_plane(self.frame, object)
    }

    /// The point seen in an object pixel.
    pub fn point(&self, object: u32) -> usize {
        let stages = self.frame.stages;
        let pixel = stages.objects.pixel[object as usize] as usize;
        stages.image.point_at(pixel).expect("an object pixel has a point")
    }

    /// The object pixel, of some, that is nearest to a place on the plane.
    pub fn nearest_to(&self, objects: &[u32], [x, y]: PlanePoint) -> Option<u32> {
        let squared = |&object: &u32| {
            let [a, b] = self.place(object);
            (a - x).powi(2) + (b - y).powi(2)
        };
        objects.iter().copied().min_by(|a, b| squared(a).total_cmp(&squared(b)))
    }

    /// A point of each of two sets of object pixels, about where the sets face each other: each is
    /// the nearest of its set to the other, found in three steps from the middle of the first set.
    pub fn facing(&self, one: &[u32], other: &[u32]) -> Vec<usize> {
        let from = self.middle(one);
        let step = |objects: &[u32], to: PlanePoint| self.nearest_to(objects, to);
        let found = step(other, from).and_then(|near| {
            let facing = step(one, self.place(near))?;
            let near = step(other, self.place(facing))?;
            Some(vec![self.point(facing), self.point(near)])
        });
        found.unwrap_or_default()
    }

    /// The mean place of some object pixels.
    pub fn middle(&self, objects: &[u32]) -> PlanePoint {
        let sum = objects.iter().fold([0.0; 2], |sum, &object| {
            let [x, y] = self.place(object);
            [sum[0] + x, sum[1] + y]
        });
        sum.map(|sum| sum / objects.len().max(1) as f64)
    }
}

/// M: the final instance of each object pixel.
fn instance_of(frame: &ClusteredCloud) -> Vec<u32> {
    let stages = frame.stages;
    let seen = |&pixel: &u32| stages.image.point_at(pixel as usize);
    let instance = |pixel| seen(pixel).map_or(0, |point| stages.labels.instance[point]);
    stages.objects.pixel.iter().map(instance).collect()
}

fn on_plane(frame: &ClusteredCloud, object: u32) -> PlanePoint {
    let [x, y, _] = frame.stages.objects.position[object as usize];
    [f64::from(x), f64::from(y)]
}

fn instance_facts<'a>(
    frame: &ClusteredCloud<'a>,
    instance: &'a Instance,
    objects: Vec<u32>,
) -> InstanceFacts<'a> {
    let stages = frame.stages;
    let class =
        most_frequent(objects.iter().map(|&o| stages.objects.class[o as usize])).unwrap_or(0);
    let places: Vec<PlanePoint> = objects.iter().map(|&object| on_plane(frame, object)).collect();
    InstanceFacts {
        instance,
        family: stages.mask.families[usize::from(class)],
        class,
        size: stages.mask.sizes[usize::from(class)],
        hull: convex_hull(&places),
        objects,
    }
}
