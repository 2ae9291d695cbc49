//! What the stages after the vote merge did: bird's-eye merge, minimum size, back-projection.
//!
//! Whether these stages joined two groups is read off the run; how near the groups' regions are on
//! the bird's-eye plane is measured here again where the run does not keep it.

use std::collections::{BTreeSet, VecDeque};

use serde::Serialize;

use super::facts::{GroupFacts, PointFacts, group, pixels_of_group};
use super::frame::Frame;
use super::places::{self, Place};
use crate::cluster::Join;
use crate::cluster::params::{BirdsEye, FragmentMerge, GapMerge, Region};
use crate::footprint::{PlanePoint, convex_hull, distance, minimum_area_rectangle};
use crate::instances::Reason;
use crate::pipeline::Stages;
use crate::statistics::most_frequent;

/// Something that a stage after the vote merge did, or left undone.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "stage", rename_all = "snake_case")]
pub enum PostMergeStage {
    /// The groups of the two points on the bird's-eye plane.
    BirdsEye {
        /// Whether the stages after the vote merge made them one.
        joined: bool,
        /// The region that stands for a group; none where this merge is off.
        region: Option<Region>,
        /// Regions count as overlapping up to this far apart, metres.
        margin: f64,
        /// Joined: the groups that led from one to the other, each overlapping the next, if such a
        /// chain is found. Apart: the two nearest groups of the two.
        groups: Vec<GroupFacts>,
        /// Metres between the regions of each two groups that follow each other.
        gaps: Vec<f64>,
        /// Apart: whether only groups of one class merge, and theirs differ.
        classes_differ: bool,
    },
    /// The groups of the two points as fragments of an object of known size (preset `best`).
    Fragments {
        /// Whether the stages after the vote merge made them one.
        joined: bool,
        /// Joined: the joins that led to the one which brought the two points together, it being
        /// the last; pieces are groups.
        joins: Vec<Join>,
        /// Apart: how their last outlines compare; none where their class is of no known size.
        test: Option<SizeTest>,
        /// Apart: whether their classes differ and are not easily taken for each other.
        classes_differ: bool,
    },
    /// The groups of the two points by the gaps between pieces, there being no classes (preset
    /// `best`).
    Gaps {
        /// Whether the stages after the vote merge made them one.
        joined: bool,
        /// Joined: the joins that led to the one which brought the two points together, it being
        /// the last; pieces are groups.
        joins: Vec<Join>,
        /// Apart: how near their instances come to one another.
        test: Option<GapTest>,
    },
    /// A point's instance was under the minimum size and was dropped.
    MinimumSize {
        /// Which of the points asked about, from 0.
        point: usize,
        /// Pixels of its instance.
        pixels: usize,
        /// The minimum.
        minimum: usize,
    },
    /// A point is shadowed and took its label from a pixel nearby.
    BackProjection {
        /// Which of the points asked about, from 0.
        point: usize,
        /// The pixel it took its label from.
        from: Place,
        /// Distance from the point to it, metres.
        distance: f64,
    },
}

/// Two outlines that stayed apart, against the size of their class.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizeTest {
    /// Distance between the outlines, metres.
    pub gap: f64,
    /// Up to so far apart they are one unless the rectangle is too wide, metres.
    pub touching: f64,
    /// From this far apart on they are never compared, metres.
    pub too_far: f64,
    /// The widest rectangle around outlines that touch, metres; what is wider are two side by side.
    pub widest: f64,
    /// Sides of the rectangle around both, metres, the longer first.
    pub union: [f64; 2],
    /// The longest sides accepted across that gap, metres.
    pub limit: [f64; 2],
}

/// Two instances without a class that stayed apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GapTest {
    /// Distance between the two pixels nearest to one another, metres.
    pub gap: f64,
    /// The same as a share of the reach of touching.
    pub separation: f64,
    /// Pixels of the smaller instance.
    pub pixels: usize,
    /// An instance of fewer pixels is a leftover ...
    pub leftover: usize,
    /// ... and joins what is nearest within this many times the reach of touching.
    pub leftover_reach: f64,
}

/// What the later stages did with the points.
pub(super) fn evidence(frame: &Frame, points: &[PointFacts]) -> Vec<PostMergeStage> {
    let on_the_plane = match points {
        [a, b] => on_the_plane(frame, a, b),
        _ => None,
    };
    let numbered = || points.iter().enumerate();
    let too_small = numbered().filter_map(|(point, facts)| minimum_size(frame, point, facts));
    let taken = numbered().filter_map(|(point, facts)| back_projection(point, facts));
    on_the_plane.into_iter().chain(too_small).chain(taken).collect()
}

fn back_projection(point: usize, facts: &PointFacts) -> Option<PostMergeStage> {
    let from = facts.label_from?;
    let [p, q] = [facts.position, from.position].map(|position| position.map(f64::from));
    Some(PostMergeStage::BackProjection { point, from, distance: places::distance(p, q) })
}

fn minimum_size(frame: &Frame, point: usize, facts: &PointFacts) -> Option<PostMergeStage> {
    if facts.reason != Reason::TooSmall {
        return None;
    }
    let stages = frame.stages;
    let last = |group: u32| stages.birds_eye[group as usize - 1];
    let own = last(facts.group?.number);
    let pixels = (0..stages.objects.len()).filter(|&object| {
        let group = stages.merged_instance(object);
        group != 0 && last(group) == own
    });
    let minimum = frame.config.cluster.min_pixels;
    Some(PostMergeStage::MinimumSize { point, pixels: pixels.count(), minimum })
}

/// The most frequent class of a group's pixels; ties go to the lower class.
fn class_of_group(stages: &Stages, number: u32) -> u16 {
    let classes =
        pixels_of_group(stages, number).into_iter().map(|object| stages.objects.class[object]);
    most_frequent(classes).unwrap_or(0)
}

fn on_the_plane(frame: &Frame, a: &PointFacts, b: &PointFacts) -> Option<PostMergeStage> {
    let (from, to) = (a.group?.number, b.group?.number);
    if from == to {
        return None;
    }
    let last = &frame.stages.birds_eye;
    let joined = last[from as usize - 1] == last[to as usize - 1];
    let gaps = frame.config.cluster.gaps.filter(|_| !frame.stages.mask.has_classes());
    if let Some(params) = gaps {
        return Some(PostMergeStage::Gaps {
            joined,
            joins: if joined { joins(&frame.stages.joins, from, to) } else { Vec::new() },
            test: if joined { None } else { gap_test(frame, from, to, params) },
        });
    }
    let [of_a, of_b] = [from, to].map(|group| class_of_group(frame.stages, group));
    let mask = &frame.stages.mask;
    let may_be_one = |a: usize, b: usize| {
        mask.families[a] == mask.families[b] || mask.lookalikes[a] & mask.lookalikes[b] != 0
    };
    let differ = !joined
        && match frame.config.cluster.fragments {
            Some(_) => !may_be_one(usize::from(of_a), usize::from(of_b)),
            None => of_a != of_b,
        };
    Some(match frame.config.cluster.fragments {
        Some(params) => PostMergeStage::Fragments {
            joined,
            joins: if joined { joins(&frame.stages.joins, from, to) } else { Vec::new() },
            test: if joined || differ { None } else { size_test(frame, from, to, params) },
            classes_differ: differ,
        },
        None => birds_eye(frame, from, to, joined, differ),
    })
}

/// The joins up to the one that brought two pieces together, less those that had nothing to do with
/// it.
fn joins(joins: &[Join], from: u32, to: u32) -> Vec<Join> {
    let mut sets: Vec<(BTreeSet<u32>, Vec<Join>)> = Vec::new();
    for join in joins {
        let mut united = (BTreeSet::from([join.target, join.query]), Vec::new());
        sets.retain_mut(|(members, made)| {
            let is_part = members.contains(&join.target) || members.contains(&join.query);
            if is_part {
                united.0.append(members);
                united.1.append(made);
            }
            !is_part
        });
        united.1.push(*join);
        if united.0.contains(&from) && united.0.contains(&to) {
            return united.1;
        }
        sets.push(united);
    }
    Vec::new()
}

fn gap_test(frame: &Frame, from: u32, to: u32, params: GapMerge) -> Option<GapTest> {
    let stages = frame.stages;
    let members = |piece: u32| {
        let end = stages.birds_eye[piece as usize - 1];
        let in_group = |group: u32| group != 0 && stages.birds_eye[group as usize - 1] == end;
        (0..stages.objects.len())
            .filter(|&object| in_group(stages.merged_instance(object)))
            .collect::<Vec<_>>()
    };
    let (one, other) = (members(from), members(to));
    let pairs = one.iter().flat_map(|&a| other.iter().map(move |&b| (a, b)));
    let apart = pairs.map(|(a, b)| (stages.objects.separation(a, b), a, b));
    let (separation, a, b) = apart.min_by(|x, y| x.0.total_cmp(&y.0))?;
    let [p, q] = [a, b].map(|object| stages.objects.position[object].map(f64::from));
    Some(GapTest {
        gap: places::distance(p, q),
        separation,
        pixels: one.len().min(other.len()),
        leftover: params.leftover,
        leftover_reach: params.leftover_reach,
    })
}

fn size_test(frame: &Frame, from: u32, to: u32, params: FragmentMerge) -> Option<SizeTest> {
    let stages = frame.stages;
    let last = &stages.birds_eye;
    let members = |piece: u32| {
        let end = last[piece as usize - 1];
        let in_group = |group: u32| group != 0 && last[group as usize - 1] == end;
        let objects = 0..stages.objects.len();
        objects.filter(|&object| in_group(stages.merged_instance(object))).collect::<Vec<_>>()
    };
    let hull = |objects: &[usize]| {
        let on_plane = objects.iter().map(|&object| {
            let [x, y, _] = stages.objects.position[object];
            [f64::from(x), f64::from(y)]
        });
        convex_hull(&on_plane.collect::<Vec<_>>())
    };
    let (in_one, in_other) = (members(from), members(to));
    let larger = if in_other.len() > in_one.len() { to } else { from };
    let size = stages.mask.sizes[usize::from(class_of_group(stages, larger))]?;
    let (one, other) = (hull(&in_one), hull(&in_other));
    let gap = distance(&one, &other);
    let union = minimum_area_rectangle(&convex_hull(&[&one[..], &other].concat()))?.size;
    Some(SizeTest {
        gap,
        touching: params.touching_gap(size),
        too_far: params.bridged_gap(size),
        widest: params.widest(size),
        union,
        limit: params.longest_sides(size, gap),
    })
}

fn birds_eye(frame: &Frame, from: u32, to: u32, joined: bool, differ: bool) -> PostMergeStage {
    let last = &frame.stages.birds_eye;
    let Some(params) = frame.config.cluster.birds_eye else {
        let (groups, gaps) = (Vec::new(), Vec::new());
        let (region, margin, classes_differ) = (None, 0.0, false);
        return PostMergeStage::BirdsEye { joined, region, margin, groups, gaps, classes_differ };
    };
    let beside = |group: u32| -> Vec<(u32, Outline)> {
        let members = (1..).zip(last).filter(|&(_, &end)| end == last[group as usize - 1]);
        members
            .filter_map(|(number, _)| Some((number, Outline::of_group(frame, number, params)?)))
            .collect()
    };
    let (numbers, gaps) = if joined {
        chain(&beside(from), from, to, params.margin).unwrap_or_default()
    } else {
        nearest(&beside(from), &beside(to)).unwrap_or_default()
    };
    PostMergeStage::BirdsEye {
        joined,
        region: Some(params.region),
        margin: params.margin,
        groups: numbers.into_iter().map(|number| group(frame.stages, number)).collect(),
        gaps,
        classes_differ: params.same_class && differ,
    }
}

/// A region on the plane.
struct Outline {
    region: Region,
    corners: Vec<PlanePoint>,
}

impl Outline {
    fn of_group(frame: &Frame, number: u32, params: BirdsEye) -> Option<Self> {
        let stages = frame.stages;
        let in_group = |label: u32| {
            label != 0 && stages.merge.instance_of_component[label as usize - 1] == number
        };
        let labels =
            (0_u32..).zip(&stages.components.label).map(|(object, &label)| (object, label));
        let objects: Vec<u32> = if params.grown_pixels_only {
            let grown = stages.components.grown.iter().copied();
            grown.filter(|&(_, label)| in_group(label)).map(|(object, _)| object).collect()
        } else {
            labels.filter(|&(_, label)| in_group(label)).map(|(object, _)| object).collect()
        };
        let on_plane = |object: u32| {
            let [x, y, _] = stages.objects.position[object as usize];
            [f64::from(x), f64::from(y)]
        };
        let hull = convex_hull(&objects.into_iter().map(on_plane).collect::<Vec<_>>());
        let corners = match (params.region, minimum_area_rectangle(&hull)?) {
            (Region::Rectangle, rectangle) => rectangle.corners().to_vec(),
            _ => hull,
        };
        Some(Outline { region: params.region, corners })
    }

    /// Metres between two regions; of boxes the greater of the gaps along the axes.
    fn gap(&self, other: &Outline) -> f64 {
        if self.region != Region::Box {
            return distance(&self.corners, &other.corners);
        }
        let span = |corners: &[PlanePoint], axis: usize| {
            corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), corner| {
                (low.min(corner[axis]), high.max(corner[axis]))
            })
        };
        let along = |axis: usize| {
            let (a, b) = (span(&self.corners, axis), span(&other.corners, axis));
            a.0.max(b.0) - a.1.min(b.1)
        };
        along(0).max(along(1)).max(0.0)
    }
}

/// A shortest chain of groups, each no farther from the next than the margin.
fn chain(
    members: &[(u32, Outline)],
    from: u32,
    to: u32,
    margin: f64,
) -> Option<(Vec<u32>, Vec<f64>)> {
    let place = |number: u32| members.iter().position(|&(other, _)| other == number);
    let (first, last) = (place(from)?, place(to)?);
    let gap = |a: usize, b: usize| members[a].1.gap(&members[b].1);
    let mut before: Vec<Option<usize>> = vec![None; members.len()];
    before[first] = Some(first);
    let mut queue = VecDeque::from([first]);
    while let Some(member) = queue.pop_front() {
        let is_next = |&next: &usize| before[next].is_none() && gap(member, next) <= margin;
        let found: Vec<usize> = (0..members.len()).filter(is_next).collect();
        for next in found {
            before[next] = Some(member);
            queue.push_back(next);
        }
    }
    before[last]?;
    let step = |&member: &usize| before[member].filter(|_| member != first);
    let mut path: Vec<usize> = std::iter::successors(Some(last), step).collect();
    path.reverse();
    let gaps = path.windows(2).map(|step| gap(step[0], step[1])).collect();
    Some((path.into_iter().map(|member| members[member].0).collect(), gaps))
}

/// The nearest two groups, one of each list.
fn nearest(a: &[(u32, Outline)], b: &[(u32, Outline)]) -> Option<(Vec<u32>, Vec<f64>)> {
    let pairs = a.iter().flat_map(|one| b.iter().map(move |other| (one, other)));
    let gaps = pairs.map(|(one, other)| (one.0, other.0, one.1.gap(&other.1)));
    let (one, other, gap) = gaps.min_by(|x, y| x.2.total_cmp(&y.2))?;
    Some((vec![one, other], vec![gap]))
}
