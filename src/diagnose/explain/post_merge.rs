//! What the stages after the vote merge did: bird's-eye merge, merge by size, minimum size,
//! back-projection; and the cut of the tree of merges, which takes the place of the votes.
//!
//! Joins, outlines, regions and sizes are those that the run kept when it decided
//! ([`PostMerge`](divmerge_core::cluster::PostMerge)). Measured here are the distances between
//! regions or outlines of a pair that the merge had no need to compare.

use std::collections::{BTreeSet, VecDeque};

use serde::Serialize;

use super::cut::{self, CutEvidence};
use super::facts::{GroupFacts, PointFacts, group};
use super::places::{self, Place};
use super::subject::ClusteredCloud;
use divmerge_core::cloud::Reason;
use divmerge_core::cluster::params::{BirdsEye, FragmentMerge, Region};
use divmerge_core::cluster::{InstanceRegion, Join, SizeTest, regions};

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
    /// The nodes of the tree of merges that hold the points, there being no classes (preset
    /// `best`).
    Cut(CutEvidence),
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

/// What the stages after the vote merge did with the points.
pub(super) fn evidence(frame: &ClusteredCloud, points: &[PointFacts]) -> Vec<PostMergeStage> {
    let of_pair = match points {
        _ if frame.stages.post_merge.tree.is_some() => {
            cut::evidence(frame, points).map(PostMergeStage::Cut)
        }
        [a, b] => merge_of(frame, a, b),
        _ => None,
    };
    let numbered = || points.iter().enumerate();
    let too_small = numbered().filter_map(|(point, facts)| minimum_size(frame, point, facts));
    let taken = numbered().filter_map(|(point, facts)| back_projection(point, facts));
    of_pair.into_iter().chain(too_small).chain(taken).collect()
}

fn back_projection(point: usize, facts: &PointFacts) -> Option<PostMergeStage> {
    let from = facts.label_from?;
    let [p, q] = [facts.position, from.position].map(|position| position.map(f64::from));
    Some(PostMergeStage::BackProjection { point, from, distance: places::distance(p, q) })
}

fn minimum_size(
    frame: &ClusteredCloud,
    point: usize,
    facts: &PointFacts,
) -> Option<PostMergeStage> {
    if facts.reason != Reason::TooSmall {
        return None;
    }
    let instance = instance_of(frame, facts.group?.number);
    let pixels = frame.stages.merged_pixels[instance as usize - 1] as usize;
    let minimum = frame.config.cluster.min_pixels;
    Some(PostMergeStage::MinimumSize { point, pixels, minimum })
}

/// The instance after the last merge that a group belongs to, from 1.
fn instance_of(frame: &ClusteredCloud, group: u32) -> u32 {
    frame.stages.post_merge.instance[group as usize - 1]
}

/// What the last merge did with the groups of two points; none where they are one group.
fn merge_of(frame: &ClusteredCloud, a: &PointFacts, b: &PointFacts) -> Option<PostMergeStage> {
    let (from, to) = (a.group?.number, b.group?.number);
    if from == to {
        return None;
    }
    let params = &frame.config.cluster;
    Some(match (&params.fragments, params.birds_eye) {
        (Some(by_size), _) => by_size_of_class(frame, from, to, by_size),
        (None, Some(birds_eye)) => on_the_plane(frame, from, to, birds_eye),
        (None, None) => PostMergeStage::BirdsEye {
            joined: false,
            region: None,
            margin: 0.0,
            groups: Vec::new(),
            gaps: Vec::new(),
            classes_differ: false,
        },
    })
}

fn are_joined(frame: &ClusteredCloud, from: u32, to: u32) -> bool {
    instance_of(frame, from) == instance_of(frame, to)
}

fn by_size_of_class(
    frame: &ClusteredCloud,
    from: u32,
    to: u32,
    params: &FragmentMerge,
) -> PostMergeStage {
    let post_merge = &frame.stages.post_merge;
    if are_joined(frame, from, to) {
        let joins = joins_between(&post_merge.joins, from, to);
        return PostMergeStage::Fragments {
            joined: true,
            joins,
            test: None,
            classes_differ: false,
        };
    }
    let outline = |group: u32| post_merge.groups.get(instance_of(frame, group) as usize - 1);
    let outlines = outline(from).zip(outline(to));
    let may_be_one = outlines.is_none_or(|(one, other)| one.may_be_one_with(other));
    let test = outlines.filter(|_| may_be_one).and_then(|(one, other)| one.compare(other, params));
    let joins = Vec::new();
    PostMergeStage::Fragments { joined: false, joins, test, classes_differ: !may_be_one }
}

/// The joins up to the one that brought two pieces together, less those that had nothing to do with
/// it.
fn joins_between(joins: &[Join], from: u32, to: u32) -> Vec<Join> {
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

fn on_the_plane(frame: &ClusteredCloud, from: u32, to: u32, params: BirdsEye) -> PostMergeStage {
    let stages = frame.stages;
    let kept = &stages.post_merge.regions;
    // Without any class the merge compares no regions.
    let made = kept
        .is_empty()
        .then(|| regions(&stages.objects, &stages.components, &stages.merge, params));
    let all = made.as_ref().unwrap_or(kept);
    let beside = |group: u32| -> Vec<(u32, &InstanceRegion)> {
        let is_beside = |number: u32| instance_of(frame, number) == instance_of(frame, group);
        let members = (1..).zip(all).filter(|&(number, _)| is_beside(number));
        members.filter_map(|(number, region)| Some((number, region.as_ref()?))).collect()
    };
    let joined = are_joined(frame, from, to);
    let found = match joined {
        true => chain(&beside(from), from, to, params.margin),
        false => nearest(&beside(from), &beside(to)),
    };
    let (numbers, gaps) = found.unwrap_or_default();
    let class = |group: u32| stages.post_merge.classes.get(group as usize - 1);
    PostMergeStage::BirdsEye {
        joined,
        region: Some(params.region),
        margin: params.margin,
        groups: numbers.into_iter().map(|number| group(stages, number)).collect(),
        gaps,
        classes_differ: params.same_class && !joined && class(from) != class(to),
    }
}

/// A shortest chain of groups, each no farther from the next than the margin.
fn chain(
    members: &[(u32, &InstanceRegion)],
    from: u32,
    to: u32,
    margin: f64,
) -> Option<(Vec<u32>, Vec<f64>)> {
    let place = |number: u32| members.iter().position(|&(other, _)| other == number);
    let (first, last) = (place(from)?, place(to)?);
    let gap = |a: usize, b: usize| members[a].1.gap(members[b].1);
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
fn nearest(
    a: &[(u32, &InstanceRegion)],
    b: &[(u32, &InstanceRegion)],
) -> Option<(Vec<u32>, Vec<f64>)> {
    let pairs = a.iter().flat_map(|one| b.iter().map(move |other| (one, other)));
    let gaps = pairs.map(|(one, other)| (one.0, other.0, one.1.gap(other.1)));
    let (one, other, gap) = gaps.min_by(|x, y| x.2.total_cmp(&y.2))?;
    Some((vec![one, other], vec![gap]))
}
