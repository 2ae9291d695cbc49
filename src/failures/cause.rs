//! The cause of one failure: the first step to blame, in the order of the table in [`super`].

use std::collections::BTreeMap;

use serde::Serialize;

use super::oracles::Oracles;
use super::tree::{Cut, Part, best_cut};
use super::{Case, Side, Target, nearest_pair};
use crate::cluster::Join;
use crate::evaluate::verdict::{Segment, Verdict};
use crate::explain::{Explanation, LaterStage, Link, Subject, VoteEvidence, explain};
use crate::instances::Reason;
use crate::pipeline::Stages;

/// The step that lost an object, with its numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "step", rename_all = "snake_case")]
pub enum Cause {
    /// The semantics lost or misnamed it, or ground removal did.
    Mask {
        /// Points of the object.
        points: u64,
        /// Of these: taken for no object.
        not_objects: u64,
        /// Of these: objects, but of another class.
        other_class: u64,
        /// Name of the class that most of the others were given; none where there are no classes, or no other.
        given: Option<String>,
    },
    /// Points that do not own their pixel got wrong labels or none.
    Projection {
        /// Points of the object.
        points: u64,
        /// Of these: shadowed.
        shadowed: u64,
        /// Of these: without an instance.
        unlabelled: u64,
    },
    /// No merge of the components could make it right.
    Divide(Divided),
    /// The votes joined it with something else, or left it apart.
    Merge(Merged),
    /// What follows the votes joined it with something else, left it apart or dropped it.
    Post(Box<Posted>),
    /// Another method cut the objects, which keeps no steps to look at.
    Method {
        /// Its name.
        name: &'static str,
    },
    /// No oracle makes it right, and no single decision spoils it.
    Unexplained,
}

/// How the divide step lost an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "how", rename_all = "snake_case")]
pub enum Divided {
    /// A component lies in two objects, or in one and in none.
    Straddles {
        /// Its label.
        component: u32,
        /// Its pixels in the object.
        own: u64,
        /// All its pixels.
        pixels: u64,
    },
    /// No seed reached many of its pixels.
    Unreached {
        /// So many.
        unreached: u64,
        /// Pixels of the object.
        pixels: u64,
    },
}

/// How the merge step lost an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "how", rename_all = "snake_case")]
pub enum Merged {
    /// One merge joined most of it with something else.
    Joined {
        /// The component that asked.
        target: u32,
        /// The component that joined.
        query: u32,
        /// V+ with what was inherited.
        positive: u64,
        /// V- with what was inherited.
        negative: u64,
    },
    /// The votes kept two parts apart: the weakest link of the best way between them.
    Apart(Box<Link>),
    /// No pair of neighbouring pixels links two parts, and no merge that follows is there to join parts.
    Unlinked {
        /// Pairs of pixels on their border, all of which fail the condition; 0 where they have none.
        border: usize,
        /// How far apart they are, metres.
        distance: f64,
    },
}

/// How the object was lost after the merge step.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "how", rename_all = "snake_case")]
pub enum Posted {
    /// One join, by size or by gaps, put most of it together with something else.
    Joined(Join),
    /// The bird's-eye merge put it together with something else.
    Overlapped(LaterStage),
    /// The merge by size or by gaps left two parts apart.
    Apart(LaterStage),
    /// Its instance had too few pixels.
    TooSmall {
        /// Pixels of the object that were dropped so.
        dropped: u64,
        /// Pixels of the object.
        pixels: u64,
        /// The minimum.
        minimum: usize,
    },
}

impl Cause {
    /// Names of the steps.
    pub const STEPS: [&'static str; 7] =
        ["mask", "projection", "divide", "merge", "post", "method", "unexplained"];

    /// The step.
    pub fn step(&self) -> &'static str {
        match self {
            Cause::Mask { .. } => "mask",
            Cause::Projection { .. } => "projection",
            Cause::Divide(_) => "divide",
            Cause::Merge(_) => "merge",
            Cause::Post(_) => "post",
            Cause::Method { .. } => "method",
            Cause::Unexplained => "unexplained",
        }
    }
}

/// The cause of a failure and the points to look at.
pub(super) fn cause(case: &Case, oracles: &Oracles, target: &Target) -> (Cause, Vec<usize>) {
    let search = Search { case, oracles, target, stages: case.frame.stages };
    let found = search
        .mask()
        .or_else(|| search.projection())
        .or_else(|| search.other_method())
        .or_else(|| search.divide())
        .or_else(|| search.later());
    match found {
        Some((cause, show)) if !show.is_empty() => (cause, show),
        Some((cause, _)) => (cause, search.show()),
        None => (Cause::Unexplained, search.show()),
    }
}

/// A cause and the points that show it, if it has some of its own.
type Found = Option<(Cause, Vec<usize>)>;

struct Search<'a> {
    case: &'a Case<'a>,
    oracles: &'a Oracles,
    target: &'a Target,
    stages: &'a Stages,
}

impl Search<'_> {
    fn mask(&self) -> Found {
        let mask = &self.stages.mask;
        let points = &self.target.points;
        let is_lost = |point: &&usize| !mask.is_object[**point];
        let not_objects = points.iter().filter(is_lost).count() as u64;
        let classes =
            points.iter().map(|&point| (mask.class[point], self.oracles.true_class[point]));
        let misnamed = classes.filter(|(given, truth)| mask.has_classes() && given != truth);
        let mut given: BTreeMap<u16, u64> = BTreeMap::new();
        misnamed.for_each(|(class, _)| *given.entry(class).or_default() += 1);
        let misnamed: u64 = given.values().sum();
        let wrong = if mask.has_classes() { misnamed } else { not_objects };
        let would_be_right =
            self.oracles.true_mask.as_ref().is_some_and(|ruling| ruling.is_right(self.target));
        let is_hopeless = 2 * wrong >= points.len() as u64;
        let is_spurious = self.target.judged.verdict == Verdict::Spurious;
        if !would_be_right && !is_hopeless && !is_spurious {
            return None;
        }
        let most = given.iter().max_by_key(|&(&class, &count)| (count, std::cmp::Reverse(class)));
        let name = |class: u16| self.case.taxonomy.classes()[usize::from(class)].name.clone();
        let cause = Cause::Mask {
            points: points.len() as u64,
            not_objects,
            other_class: misnamed.saturating_sub(not_objects),
            given: most.map(|(&class, _)| name(class)),
        };
        Some((cause, Vec::new()))
    }

    fn projection(&self) -> Found {
        let points = &self.target.points;
        let is_seen = |point: &usize| self.oracles.is_seen[*point];
        let shadowed: Vec<usize> = points.iter().copied().filter(|point| !is_seen(point)).collect();
        let is_right = self.oracles.seen.is_right(self.target);
        if shadowed.is_empty() || !(is_right || shadowed.len() == points.len()) {
            return None;
        }
        let labels = &self.stages.labels;
        let match_of = self.oracles.seen.verdicts.of_true(self.target.judged.object);
        let own = match_of.and_then(|judged| judged.parts.first()).map(|part| part.object.id);
        let is_wrong = |point: &&usize| Some(labels.instance[**point]) != own;
        let unlabelled = shadowed.iter().filter(|&&point| labels.instance[point] == 0).count();
        let cause = Cause::Projection {
            points: points.len() as u64,
            shadowed: shadowed.len() as u64,
            unlabelled: unlabelled as u64,
        };
        Some((cause, shadowed.iter().find(is_wrong).into_iter().copied().collect()))
    }

    fn other_method(&self) -> Found {
        let baseline = self.case.frame.config.baseline.as_ref()?;
        Some((Cause::Method { name: baseline.name() }, Vec::new()))
    }

    fn divide(&self) -> Found {
        if self.target.side == Side::Found || self.oracles.true_merge.is_right(self.target) {
            return None;
        }
        let mut own: BTreeMap<u32, u64> = BTreeMap::new();
        let own_pixels = self.own_pixels(self.target.judged.object);
        for &object in &own_pixels {
            *own.entry(self.stages.components.label[object]).or_default() += 1;
        }
        let unreached = own.remove(&0).unwrap_or(0);
        let mut all: BTreeMap<u32, u64> = BTreeMap::new();
        for &label in self.stages.components.label.iter().filter(|label| own.contains_key(label)) {
            *all.entry(label).or_default() += 1;
        }
        // What a component takes from the object or brings into it that is not its own.
        let harm = |label: u32| own[&label].min(all[&label] - own[&label]);
        let worst = own.keys().copied().max_by_key(|&label| (harm(label), label));
        let divided = match worst.filter(|&label| harm(label) > 0 && harm(label) >= unreached) {
            Some(component) => {
                let (own, pixels) = (own[&component], all[&component]);
                Divided::Straddles { component, own, pixels }
            }
            None if unreached > 0 => {
                Divided::Unreached { unreached, pixels: own_pixels.len() as u64 }
            }
            None => return Some((Cause::Unexplained, Vec::new())),
        };
        let show = match divided {
            Divided::Straddles { component, .. } => self.straddled(component),
            Divided::Unreached { .. } => self.one_with(Reason::Unreached),
        };
        Some((Cause::Divide(divided), show))
    }

    /// Votes and what follows.
    fn later(&self) -> Found {
        let object = match self.target.side {
            Side::True => self.target.judged.object,
            Side::Found => self.target.judged.parts.first()?.object,
        };
        match self.target.judged.verdict {
            Verdict::Missed => self.dropped(),
            Verdict::OverSegmented => self.apart(),
            Verdict::UnderSegmented | Verdict::WrongClass => {
                let merged = self.oracles.merged.verdicts.of_true(object)?;
                match merged.verdict {
                    Verdict::UnderSegmented | Verdict::WrongClass => self.joined_by_votes(object),
                    _ => self.joined_later(object),
                }
            }
            Verdict::Correct | Verdict::Spurious => None,
        }
    }

    fn dropped(&self) -> Found {
        let pixels = self.own_pixels(self.target.judged.object);
        let reason = |&object: &usize| self.stages.labels.reason[self.point_of(object)];
        let count = |wanted| pixels.iter().filter(|object| reason(object) == wanted).count() as u64;
        let (dropped, unreached) = (count(Reason::TooSmall), count(Reason::Unreached));
        let all = pixels.len() as u64;
        if dropped >= unreached && dropped > 0 {
            let minimum = self.case.frame.config.cluster.min_pixels;
            let cause = Posted::TooSmall { dropped, pixels: all, minimum };
            return Some((Cause::Post(Box::new(cause)), self.one_with(Reason::TooSmall)));
        }
        let cause = Cause::Divide(Divided::Unreached { unreached, pixels: all });
        (unreached > 0).then(|| (cause, self.one_with(Reason::Unreached)))
    }

    /// Two parts that are not one: the two largest of a true object, or a piece and the match beside it.
    fn apart(&self) -> Found {
        let labels = &self.stages.labels.instance;
        let parts = &self.target.judged.parts;
        let pair = match self.target.side {
            Side::True => {
                let of = |part: usize| parts.get(part).map(|part| part.object.id);
                let of_part = |id: u32| self.seen(|point| labels[point] == id);
                [of_part(of(0)?), of_part(of(1)?)]
            }
            Side::Found => {
                let whole = parts.first()?.object;
                let of_whole = self.oracles.seen.verdicts.of_true(whole)?.parts.first()?.object.id;
                let (true_id, own) = (self.case.true_id, self.target.judged.object.id);
                let is_whole = |point: usize| {
                    true_id[point] == whole.id && self.oracles.true_class[point] == whole.class
                };
                let all = || (0..labels.len()).filter(|&point| self.oracles.is_seen[point]);
                let part = |id: u32| -> Vec<usize> {
                    all().filter(|&point| labels[point] == id && is_whole(point)).collect()
                };
                [part(own), part(of_whole)]
            }
        };
        let [a, b] = nearest_pair(self.case.frame.cloud, &pair[0], &pair[1])?;
        let explanation = explain(&self.case.frame, Subject::Pair(a, b));
        self.kept_apart(explanation).map(|cause| (cause, vec![a, b]))
    }

    fn kept_apart(&self, explanation: Explanation) -> Option<Cause> {
        let (border, distance) = match explanation.votes {
            Some(VoteEvidence::Failed { mut links, weakest, .. }) => {
                return Some(Cause::Merge(Merged::Apart(Box::new(links.swap_remove(weakest)))));
            }
            Some(VoteEvidence::NoTrueCondition { border, distance, .. }) => {
                (border.len(), distance)
            }
            Some(VoteEvidence::DifferentClasses { distance, .. }) => (0, distance),
            _ => return None,
        };
        let joins_parts = |stage: &LaterStage| {
            matches!(stage, LaterStage::Fragments { .. } | LaterStage::Gaps { .. })
        };
        Some(match explanation.later.into_iter().find(joins_parts) {
            Some(stage) => Cause::Post(Box::new(Posted::Apart(stage))),
            None => Cause::Merge(Merged::Unlinked { border, distance }),
        })
    }

    /// The merge that put the object together with something else.
    fn joined_by_votes(&self, object: Segment) -> Found {
        let stages = self.stages;
        let own = self.is_own_pixel(object);
        let group = most((0..own.len()).filter(|&pixel| own[pixel]), |pixel| {
            stages.merged_instance(pixel)
        })?;
        let groups = &stages.merge.instance_of_component;
        let members: Vec<u32> =
            (1..).zip(groups).filter(|&(_, &of)| of == group).map(|(label, _)| label).collect();
        let place = |label: u32| members.binary_search(&label).ok();
        let steps: Vec<_> =
            stages.merge.steps.iter().filter(|step| place(step.target).is_some()).collect();
        let edges = steps.iter().map(|step| Some([place(step.target)?, place(step.query)?]));
        let edges: Vec<[usize; 2]> = edges.collect::<Option<_>>()?;
        let part_of = |pixel: usize| place(stages.components.label[pixel]);
        let (cut, show) = self.cut(members.len(), &edges, &own, part_of)?;
        let step = steps[cut.edge];
        let cause = Merged::Joined {
            target: step.target,
            query: step.query,
            positive: step.positive,
            negative: step.negative,
        };
        Some((Cause::Merge(cause), show))
    }

    /// What after the votes put the object together with something else.
    fn joined_later(&self, object: Segment) -> Found {
        let stages = self.stages;
        let own = self.is_own_pixel(object);
        let last = |group: u32| match group {
            0 => 0,
            group => stages.birds_eye[group as usize - 1],
        };
        let end = most((0..own.len()).filter(|&pixel| own[pixel]), |pixel| {
            last(stages.merged_instance(pixel))
        })?;
        let groups = (1..=stages.merge.count).filter(|&group| last(group) == end);
        let groups: Vec<u32> = groups.collect();
        let place = |group: u32| groups.binary_search(&group).ok();
        let part_of = |pixel: usize| place(stages.merged_instance(pixel));
        let joins: Vec<&Join> =
            stages.joins.iter().filter(|join| place(join.target).is_some()).collect();
        if !joins.is_empty() {
            let edges = joins.iter().map(|join| Some([place(join.target)?, place(join.query)?]));
            let edges: Vec<[usize; 2]> = edges.collect::<Option<_>>()?;
            let (cut, show) = self.cut(groups.len(), &edges, &own, part_of)?;
            return Some((Cause::Post(Box::new(Posted::Joined(*joins[cut.edge]))), show));
        }
        let of_part = |part: usize, is_own: bool| -> Vec<usize> {
            let pixels = (0..own.len()).filter(|&pixel| part_of(pixel) == Some(part));
            let wanted = pixels.filter(|&pixel| own[pixel] == is_own);
            wanted.map(|pixel| self.point_of(pixel)).collect()
        };
        let own_part = (0..groups.len()).max_by_key(|&part| of_part(part, true).len())?;
        let others = (0..groups.len()).filter(|&part| part != own_part);
        let other = others.max_by_key(|&part| of_part(part, false).len())?;
        let (a, b) = (of_part(own_part, true), of_part(other, false));
        let [a, b] = nearest_pair(self.case.frame.cloud, &a, &b)?;
        let later = explain(&self.case.frame, Subject::Pair(a, b)).later;
        let overlap =
            |stage: &LaterStage| matches!(stage, LaterStage::BirdsEye { joined: true, .. });
        let stage = later.into_iter().find(overlap)?;
        Some((Cause::Post(Box::new(Posted::Overlapped(stage))), vec![a, b]))
    }

    /// The edge of a tree of parts that spoils the object, and a pair of points on either side of it.
    fn cut(
        &self,
        count: usize,
        edges: &[[usize; 2]],
        own: &[bool],
        part_of: impl Fn(usize) -> Option<usize>,
    ) -> Option<(Cut, Vec<usize>)> {
        let mut parts = vec![Part::default(); count];
        for (pixel, &is_own) in own.iter().enumerate() {
            if let Some(part) = part_of(pixel) {
                parts[part].own += u64::from(is_own);
                parts[part].all += 1;
            }
        }
        let total = own.iter().filter(|&&is_own| is_own).count() as u64;
        let cut = best_cut(&parts, edges, total)?;
        let on_side = |is_own_side: bool| -> Vec<usize> {
            let pixels = (0..own.len()).filter(|&pixel| own[pixel] == is_own_side);
            let on_side = pixels
                .filter(|&pixel| part_of(pixel).map(|p| cut.is_own_side[p]) == Some(is_own_side));
            on_side.map(|pixel| self.point_of(pixel)).collect()
        };
        let pair = nearest_pair(self.case.frame.cloud, &on_side(true), &on_side(false))?;
        Some((cut, pair.to_vec()))
    }

    /// Two points of a component, one in the object and one beside it.
    fn straddled(&self, component: u32) -> Vec<usize> {
        let own = self.is_own_pixel(self.target.judged.object);
        let points = |is_own: bool| -> Vec<usize> {
            let labels = self.stages.components.label.iter().enumerate();
            let inside =
                labels.filter(|&(pixel, &label)| label == component && own[pixel] == is_own);
            inside.map(|(pixel, _)| self.point_of(pixel)).collect()
        };
        let pair = nearest_pair(self.case.frame.cloud, &points(true), &points(false));
        pair.map(Vec::from).unwrap_or_default()
    }

    fn one_with(&self, reason: Reason) -> Vec<usize> {
        let reasons = &self.stages.labels.reason;
        self.target
            .points
            .iter()
            .copied()
            .find(|&point| reasons[point] == reason)
            .into_iter()
            .collect()
    }

    /// Points to look at where the cause has none: the point nearest to the middle; for an object in parts
    /// one of each of the largest two; for one that is not alone one of it and one beside it.
    fn show(&self) -> Vec<usize> {
        let labels = &self.stages.labels.instance;
        let cloud = self.case.frame.cloud;
        let judged = &self.target.judged;
        let part = |number: usize| judged.parts.get(number).map(|part| part.object.id);
        if let (Side::True, Some(holder)) = (self.target.side, part(0)) {
            let [a, b] = match (judged.verdict, part(1)) {
                (Verdict::OverSegmented, Some(other)) => {
                    [holder, other].map(|id| self.seen(|point| labels[point] == id))
                }
                (Verdict::UnderSegmented, _) => {
                    let is_own = self.is_own_point();
                    let beside = (0..labels.len()).filter(|&point| {
                        labels[point] == holder && !is_own[point] && self.oracles.is_seen[point]
                    });
                    [self.seen(|point| labels[point] == holder), beside.collect()]
                }
                _ => Default::default(),
            };
            if let Some(pair) = nearest_pair(cloud, &a, &b) {
                return pair.to_vec();
            }
        }
        let returns = self.target.points.iter().copied().filter(|&point| cloud.is_return(point));
        let is_without = |point: usize| labels[point] == 0;
        let away = |point: usize| {
            let at = cloud.position(point).map(f64::from);
            (0..3).map(|axis| (at[axis] - judged.centre[axis]).powi(2)).sum::<f64>()
        };
        let is_missed = judged.verdict == Verdict::Missed;
        let wanted = returns.filter(|&point| !is_missed || is_without(point));
        wanted.min_by(|&a, &b| away(a).total_cmp(&away(b))).into_iter().collect()
    }

    fn is_own_point(&self) -> Vec<bool> {
        let mut is_own = vec![false; self.case.true_id.len()];
        self.target.points.iter().for_each(|&point| is_own[point] = true);
        is_own
    }

    /// The seen points of the failure that `wanted` accepts.
    fn seen(&self, wanted: impl Fn(usize) -> bool) -> Vec<usize> {
        let points = self.target.points.iter().copied();
        points.filter(|&point| self.oracles.is_seen[point] && wanted(point)).collect()
    }

    /// For each object pixel whether it shows a true object.
    fn is_own_pixel(&self, object: Segment) -> Vec<bool> {
        let is_own = |pixel: usize| {
            let point = self.point_of(pixel);
            self.case.true_id[point] == object.id && self.oracles.true_class[point] == object.class
        };
        (0..self.stages.objects.len()).map(is_own).collect()
    }

    fn own_pixels(&self, object: Segment) -> Vec<usize> {
        let is_own = self.is_own_pixel(object);
        (0..is_own.len()).filter(|&pixel| is_own[pixel]).collect()
    }

    /// The point seen in an object pixel.
    fn point_of(&self, object: usize) -> usize {
        let pixel = self.stages.objects.pixel[object] as usize;
        self.stages.image.point_of_pixel.values()[pixel] as usize
    }
}

/// The value, other than 0, that most elements have; of several the lowest.
fn most(elements: impl Iterator<Item = usize>, value: impl Fn(usize) -> u32) -> Option<u32> {
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    for value in elements.map(value).filter(|&value| value != 0) {
        *counts.entry(value).or_default() += 1;
    }
    counts.into_iter().rev().max_by_key(|&(_, count)| count).map(|(value, _)| value)
}
