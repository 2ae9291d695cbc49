//! The merge step by step: the instance that is opened, the components that join it, and those that
//! it asked in vain.

use super::options::FigureOptions;
use super::scene::FrameScene;
use crate::error::Result;
use divmerge_core::cluster::{MergeStep, Vote};

/// A state of the merge while an instance is gathered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FigureStep {
    /// Number of the instance in the merge.
    pub instance: u32,
    /// The component that opened it.
    pub opener: u32,
    /// The merges into it so far, in order.
    pub joined: Vec<MergeStep>,
    /// Whether all its components have been asked.
    pub is_complete: bool,
}

/// Steps for the instances that share votes with later ones, in the order in which they were
/// opened; of a crop, those with a pixel in it. With `by_decision` a step for each merge, else one
/// for each instance.
///
/// # Errors
/// [`Error::Figure`](crate::error::Error::Figure) if the crop lies outside of the range image.
pub fn steps(
    scene: &FrameScene,
    options: &FigureOptions,
    by_decision: bool,
) -> Result<Vec<FigureStep>> {
    let merge = &scene.stages.merge;
    let image = &scene.stages.image;
    let window = options.crop.within(image.rows(), image.columns())?;
    let mut instances = vec![Gathered::default(); merge.count as usize];
    let place = |label: u32| merge.instance_of_component[label as usize - 1] as usize - 1;
    for vote in &scene.stages.votes.pairs {
        // Instances opened before are not asked.
        instances[place(vote.a).min(place(vote.b))].has_votes = true;
    }
    for (row, column, label) in scene.object_pixels() {
        if label != 0 && window.contains(row, column) {
            instances[place(label)].is_seen = true;
        }
    }
    for label in 1..=merge.instance_of_component.len() as u32 {
        instances[place(label)].opener.get_or_insert(label);
    }
    for step in &merge.steps {
        instances[place(step.query)].joined.push(*step);
    }
    let shown = (1..).zip(instances).filter(|(_, found)| found.has_votes && found.is_seen);
    Ok(shown.flat_map(|(instance, found)| found.steps(instance, by_decision)).collect())
}

/// What the merge gathered for one instance.
#[derive(Debug, Clone, Default)]
struct Gathered {
    opener: Option<u32>,
    joined: Vec<MergeStep>,
    has_votes: bool,
    is_seen: bool,
}

impl Gathered {
    fn steps(self, instance: u32, by_decision: bool) -> impl Iterator<Item = FigureStep> {
        let all = self.joined.len();
        let first = if by_decision { all.min(1) } else { all };
        (first..=all).map(move |decided| FigureStep {
            instance,
            opener: self.opener.unwrap_or(0),
            joined: self.joined[..decided].to_vec(),
            is_complete: decided == all,
        })
    }
}

/// What a component is in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Part of the instance.
    Member,
    /// The member that joined last.
    Newest,
    /// Asked by a member, and kept apart.
    KeptApart,
    /// Part of an instance opened before.
    Earlier,
    /// Not yet asked.
    Waiting,
}

impl Role {
    /// Whether the component is part of the instance.
    pub fn is_member(self) -> bool {
        matches!(self, Role::Member | Role::Newest)
    }

    /// Whether the step is about the component.
    pub fn is_in_focus(self) -> bool {
        self.is_member() || self == Role::KeptApart
    }
}

/// The role of each component, component k at k - 1.
pub fn roles(scene: &FrameScene, step: &FigureStep) -> Vec<Role> {
    let instances = &scene.stages.merge.instance_of_component;
    let before = |&instance: &u32| match instance < step.instance {
        true => Role::Earlier,
        false => Role::Waiting,
    };
    let mut roles: Vec<Role> = instances.iter().map(before).collect();
    roles[step.opener as usize - 1] = Role::Member;
    for joined in &step.joined {
        roles[joined.query as usize - 1] = Role::Member;
    }
    for (member, other, _) in asked(scene) {
        let [member, other] = [member, other].map(|label| label as usize - 1);
        let is_apart = instances[other] != step.instance;
        if roles[member] == Role::Member && roles[other] == Role::Waiting && is_apart {
            roles[other] = Role::KeptApart;
        }
    }
    if let Some(last) = step.joined.last().filter(|_| !step.is_complete) {
        roles[last.query as usize - 1] = Role::Newest;
    }
    roles
}

/// Pairs of a member and a component that it asked in vain, those with most votes first.
pub fn kept_apart(scene: &FrameScene, roles: &[Role]) -> Vec<(u32, u32, Vote)> {
    let role = |label: u32| roles[label as usize - 1];
    let mut pairs: Vec<(u32, u32, Vote)> = asked(scene)
        .filter(|&(a, b, _)| role(a).is_member() && role(b) == Role::KeptApart)
        .map(|(a, b, vote)| (a, b, *vote))
        .collect();
    pairs.sort_by_key(|&(a, b, vote)| (std::cmp::Reverse(vote.positive + vote.negative), a, b));
    pairs
}

/// Each pair of components with votes, both ways round.
fn asked<'a>(scene: &FrameScene<'a>) -> impl Iterator<Item = (u32, u32, &'a Vote)> {
    let pairs = scene.stages.votes.pairs.iter();
    pairs.flat_map(|vote| [(vote.a, vote.b, vote), (vote.b, vote.a, vote)])
}
