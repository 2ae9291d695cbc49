//! The chain of merges between two components, or where the votes on the way failed (Alg. 2).
//!
//! Everything is read off the votes and the recorded merges. What a component had inherited when it
//! asked another follows from them: with [`Accumulation::IntoQuery`] the votes of all components
//! above it in the tree of merges; with [`Accumulation::IntoOpener`] the opener has those of the
//! components that it had taken in before, and all others have their own alone.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use rustc_hash::FxHashMap;
use serde::Serialize;

use super::border::{BorderPair, border};
use super::facts::{GroupFacts, PointFacts, group, group_of, pixels_of_group};
use super::places::{Place, nearest_pair, place_of_object};
use super::subject::ClusteredCloud;
use divmerge_core::cluster::params::Accumulation;
use divmerge_core::pipeline::Stages;

/// Votes that a component had inherited from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Donor {
    /// The component on whose border they were cast.
    pub component: u32,
    /// Its V+ towards the query.
    pub positive: u64,
    /// Its V- towards the query.
    pub negative: u64,
}

/// One component asks another to join. Each pair of border pixels counts twice, as in Alg. 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Link {
    /// The component that asks.
    pub target: u32,
    /// The component that is asked.
    pub query: u32,
    /// V+ with everything inherited.
    pub positive: u64,
    /// V- with everything inherited.
    pub negative: u64,
    /// V+ on the border of these two alone.
    pub own_positive: u64,
    /// V- on the border of these two alone.
    pub own_negative: u64,
    /// Where the rest was inherited from.
    pub inherited: Vec<Donor>,
    /// The pairs of pixels that voted, own and inherited; nearest to the other verdict first.
    pub pairs: Vec<BorderPair>,
}

impl Link {
    /// V+ / (V+ + V-), 0 without votes.
    pub fn share(&self) -> f64 {
        share(self.positive, self.negative)
    }

    /// The least number of further votes in favour with which V+ / (V+ + V-) exceeds the ratio: 0
    /// if it does already, none if no number would do.
    pub fn short_by(&self, ratio: f64) -> Option<u64> {
        if self.positive > 0 && self.share() > ratio {
            return Some(0);
        }
        let (positive, total) = (self.positive as f64, (self.positive + self.negative) as f64);
        (ratio < 1.0)
            .then(|| ((ratio * total - positive) / (1.0 - ratio)).floor().max(0.0) as u64 + 1)
    }
}

fn share(positive: u64, negative: u64) -> f64 {
    if positive == 0 { 0.0 } else { positive as f64 / (positive + negative) as f64 }
}

/// What the merge step has to say on two points.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum VoteEvidence {
    /// Both lie in one component.
    OneComponent {
        /// Its label.
        component: u32,
    },
    /// The merges that joined their components, from the first point's to the second's.
    Chain {
        /// A path in the tree of merges.
        links: Vec<Link>,
    },
    /// The best way from one group to the other, all of whose links failed: best is where the least
    /// share of votes in favour on the way is greatest, then the fewest links.
    Failed {
        /// The groups on the way, the first point's first.
        groups: Vec<GroupFacts>,
        /// The best attempt between each two groups that follow each other.
        links: Vec<Link>,
        /// The link with the least share of votes in favour.
        weakest: usize,
        /// By how many votes in favour that link failed; none if no number would do.
        short_by: Option<u64>,
    },
    /// No chain of true conditions between their groups.
    NoTrueCondition {
        /// The border between the two groups: all pairs false.
        border: Vec<BorderPair>,
        /// If they have no border: the groups on the shortest way over borders, if it takes few ...
        groups: Vec<GroupFacts>,
        /// ... and the best attempt between each two that follow each other.
        links: Vec<Link>,
        /// The two nearest pixels of the groups ...
        nearest: [Place; 2],
        /// ... and their distance in metres.
        distance: f64,
    },
    /// Only pixels of one class are neighbours, and their classes differ.
    DifferentClasses {
        /// Names of their classes.
        classes: [String; 2],
        /// Distance between the nearest pixels of their groups, metres.
        distance: f64,
    },
}

/// The evidence on two points; none if one of them has no component.
pub(super) fn evidence(
    frame: &ClusteredCloud,
    a: &PointFacts,
    b: &PointFacts,
) -> Option<VoteEvidence> {
    let stages = frame.stages;
    let (from, to) = (a.component?.label, b.component?.label);
    if from == to {
        return Some(VoteEvidence::OneComponent { component: from });
    }
    let ledger = Ledger::new(frame);
    let (group_a, group_b) = (group_of(stages, from), group_of(stages, to));
    if group_a == group_b {
        return Some(VoteEvidence::Chain { links: ledger.chain(from, to) });
    }
    let family = |facts: &PointFacts| facts.object.map(|object| stages.objects.family[object]);
    let differ = frame.config.cluster.same_class_neighbours && family(a) != family(b);
    let attempts = if differ { BTreeMap::new() } else { ledger.attempts() };
    if let Some(failed) = ledger.failed(&attempts, group_a, group_b) {
        return Some(failed);
    }
    let position = |&object: &usize| stages.objects.position[object].map(f64::from);
    let [pixels_a, pixels_b] = [group_a, group_b].map(|group| pixels_of_group(stages, group));
    let (one, other, distance) = nearest_pair(&pixels_a, &pixels_b, position)?;
    if differ {
        let classes = [a.class_name.clone(), b.class_name.clone()];
        return Some(VoteEvidence::DifferentClasses { classes, distance });
    }
    let border = border(
        frame,
        |label| group_of(stages, label) == group_a,
        |label| group_of(stages, label) == group_b,
    );
    let way = path(&attempts, group_a, group_b, 0.0);
    let way = way.filter(|way| border.is_empty() && way.len() <= LONGEST_WAY).unwrap_or_default();
    Some(VoteEvidence::NoTrueCondition {
        border,
        groups: way.iter().map(|&number| group(stages, number)).collect(),
        links: ledger.links(&attempts, &way),
        nearest: [one, other].map(|object| place_of_object(stages, object)),
        distance,
    })
}

/// Groups on a way over borders beyond which it explains nothing.
const LONGEST_WAY: usize = 4;

/// The votes and the tree of merges.
struct Ledger<'a> {
    frame: &'a ClusteredCloud<'a>,
    stages: &'a Stages,
    /// For each component that joined another, that other.
    parent: FxHashMap<u32, u32>,
    /// Components that joined a component directly.
    children: FxHashMap<u32, Vec<u32>>,
}

impl<'a> Ledger<'a> {
    fn new(frame: &'a ClusteredCloud<'a>) -> Self {
        let mut children: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
        let mut parent = FxHashMap::default();
        for step in &frame.stages.merge.steps {
            parent.insert(step.query, step.target);
            children.entry(step.target).or_default().push(step.query);
        }
        Ledger { frame, stages: frame.stages, parent, children }
    }

    /// V+ and V- on the border of two components alone.
    fn own(&self, a: u32, b: u32) -> (u64, u64) {
        let pairs = &self.stages.votes.pairs;
        let key = (a.min(b), a.max(b));
        let found = pairs.binary_search_by_key(&key, |vote| (vote.a, vote.b));
        found.map_or((0, 0), |place| {
            (u64::from(pairs[place].positive), u64::from(pairs[place].negative))
        })
    }

    /// A component, the one it joined, and so on to the one that opened the group.
    fn ancestors(&self, component: u32) -> Vec<u32> {
        std::iter::successors(Some(component), |label| self.parent.get(label).copied()).collect()
    }

    /// What `target` had inherited towards `query` when it asked.
    fn inherited(&self, target: u32, query: u32) -> Vec<Donor> {
        let donors = match self.frame.config.cluster.accumulation {
            Accumulation::IntoQuery => self.ancestors(target).split_off(1),
            Accumulation::IntoOpener if self.parent.contains_key(&target) => Vec::new(),
            Accumulation::IntoOpener => {
                let children = self.children.get(&target).into_iter().flatten();
                children.copied().filter(|&child| child < query).collect()
            }
        };
        let votes = donors.into_iter().map(|component| {
            let (positive, negative) = self.own(component, query);
            Donor { component, positive, negative }
        });
        votes.filter(|donor| donor.positive + donor.negative > 0).collect()
    }

    /// V+ and V- with what was inherited.
    fn total(&self, target: u32, query: u32) -> (u64, u64) {
        let inherited = self.inherited(target, query);
        inherited.iter().fold(self.own(target, query), |(positive, negative), donor| {
            (positive + donor.positive, negative + donor.negative)
        })
    }

    fn link(&self, target: u32, query: u32) -> Link {
        let (own_positive, own_negative) = self.own(target, query);
        let (positive, negative) = self.total(target, query);
        let inherited = self.inherited(target, query);
        let voters: BTreeSet<u32> =
            inherited.iter().map(|donor| donor.component).chain([target]).collect();
        let pairs = border(self.frame, |label| voters.contains(&label), |label| label == query);
        Link { target, query, positive, negative, own_positive, own_negative, inherited, pairs }
    }

    /// The path in the tree of merges between two components of one group.
    fn chain(&self, from: u32, to: u32) -> Vec<Link> {
        let (mut up, mut down) = (self.ancestors(from), self.ancestors(to));
        // Both end in the group's opener; what they have in common is left out but for its nearest.
        while up.len() > 1 && down.len() > 1 && up[up.len() - 2] == down[down.len() - 2] {
            up.pop();
            down.pop();
        }
        let climb = up.windows(2).map(|step| self.link(step[1], step[0]));
        let descend = down.windows(2).rev().map(|step| self.link(step[1], step[0]));
        climb.chain(descend).collect()
    }

    /// The best way between two groups along attempts with votes in favour, if there is one.
    fn failed(&self, attempts: &Attempts, from: u32, to: u32) -> Option<VoteEvidence> {
        let shares = attempts.values().map(|attempt| attempt.share);
        let mut shares: Vec<f64> = shares.filter(|&share| share > 0.0).collect();
        shares.sort_by(f64::total_cmp);
        shares.dedup();
        // The greatest share at which the two groups hang together: reachability falls with it.
        let reachable = shares.partition_point(|&least| path(attempts, from, to, least).is_some());
        let least = *shares.get(reachable.checked_sub(1)?)?;
        let numbers = path(attempts, from, to, least)?;
        let links = self.links(attempts, &numbers);
        let weakest = (0..links.len())
            .min_by(|&a, &b| links[a].share().total_cmp(&links[b].share()))
            .expect("two groups are at least one link apart");
        let short_by = links[weakest].short_by(self.frame.config.cluster.merge_ratio);
        let groups = numbers.iter().map(|&number| group(self.stages, number)).collect();
        Some(VoteEvidence::Failed { groups, links, weakest, short_by })
    }

    /// The attempts between groups that follow each other.
    fn links(&self, attempts: &Attempts, groups: &[u32]) -> Vec<Link> {
        let steps = groups.windows(2);
        let attempts = steps.map(|step| &attempts[&(step[0].min(step[1]), step[0].max(step[1]))]);
        attempts.map(|attempt| self.link(attempt.target, attempt.query)).collect()
    }

    /// For each two groups with votes between them, the attempt that came nearest to a merge.
    /// The group opened first asked; the other's components were all unassigned then.
    fn attempts(&self) -> Attempts {
        let mut opener: FxHashMap<u32, u32> = FxHashMap::default();
        for (label, &group) in (1..).zip(&self.stages.merge.instance_of_component) {
            opener.entry(group).or_insert(label);
        }
        let mut attempts = Attempts::new();
        for vote in &self.stages.votes.pairs {
            let [a, b] = [vote.a, vote.b].map(|label| group_of(self.stages, label));
            if a == b {
                continue;
            }
            let (target, query) = if a < b { (vote.a, vote.b) } else { (vote.b, vote.a) };
            for target in [target, opener[&a.min(b)]] {
                let (positive, negative) = self.total(target, query);
                let share = share(positive, negative);
                let best = attempts.get(&(a.min(b), a.max(b)));
                if best.is_none_or(|best| share > best.share) {
                    attempts.insert((a.min(b), a.max(b)), Attempt { target, query, share });
                }
            }
        }
        attempts
    }
}

/// By the numbers of two groups, the lower first.
type Attempts = BTreeMap<(u32, u32), Attempt>;

/// A component asked another, of another group, and failed.
struct Attempt {
    target: u32,
    query: u32,
    share: f64,
}

/// The groups on a shortest way along attempts with at least that share of votes in favour.
fn path(attempts: &Attempts, from: u32, to: u32, least: f64) -> Option<Vec<u32>> {
    let mut beside: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (&(a, b), _) in attempts.iter().filter(|(_, attempt)| attempt.share >= least) {
        beside.entry(a).or_default().push(b);
        beside.entry(b).or_default().push(a);
    }
    let mut before = BTreeMap::from([(from, from)]);
    let mut queue = VecDeque::from([from]);
    while let Some(group) = queue.pop_front() {
        for &next in beside.get(&group).into_iter().flatten() {
            before.entry(next).or_insert_with(|| {
                queue.push_back(next);
                group
            });
        }
    }
    before.contains_key(&to).then(|| {
        let step = |group: &u32| Some(before[group]).filter(|_| *group != from);
        let mut path: Vec<u32> = std::iter::successors(Some(to), step).collect();
        path.reverse();
        path
    })
}
