//! What follows the merge on votes, and what it knew when it decided.

use serde::Serialize;

use super::divide_and_merge::regions::InstanceRegion;
use super::fragments::group::Group;
use super::tree::merge_tree::MergeTree;

/// The instances after the last merge, with what explains them. Which of the lists are filled
/// depends on the method; those of the steps that did not run are empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PostMerge {
    /// For each instance of the merge step (instance k at k - 1) the one that it belongs to in the
    /// end, numbered from 1; in the order of their first members but for objects without classes,
    /// which come before what is none.
    pub instance: Vec<u32>,
    /// Joins by size in the order in which they were made; pieces are the instances of
    /// the merge step.
    pub joins: Vec<Join>,
    /// Merge by size: the last outline of each instance; instance k at k - 1.
    pub groups: Vec<Group>,
    /// Objects without classes: the tree of merges and its cut.
    pub tree: Option<MergeTree>,
    /// Bird's-eye merge: the class of each instance of the merge step; instance k at k - 1.
    pub classes: Vec<u16>,
    /// Bird's-eye merge: the region of each instance of the merge step; instance k at k - 1.
    pub regions: Vec<Option<InstanceRegion>>,
}

impl PostMerge {
    /// Nothing follows the merge step, which made so many instances.
    pub fn unchanged(count: u32) -> Self {
        PostMerge { instance: (1..=count).collect(), ..PostMerge::default() }
    }
}

/// Two groups of pieces became one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Join {
    /// First piece (from 1) of the group that stays.
    pub target: u32,
    /// First piece (from 1) of the group that joined it.
    pub query: u32,
    /// Distance between their outlines in metres.
    pub gap: f64,
    /// Why they became one.
    pub evidence: Evidence,
}

/// Why two groups of pieces became one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// They all but touch.
    Touching,
    /// The rectangle around both fits an object of their class.
    Fits {
        /// Its sides in metres, the longer first.
        union: [f64; 2],
        /// The longest sides that are accepted across their gap, metres.
        limit: [f64; 2],
    },
}
