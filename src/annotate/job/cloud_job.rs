//! What a thread does to a cloud.

use crate::annotate::config::AnnotateConfig;
use crate::annotate::options::AnnotateOptions;
use crate::annotate::tracking::TrackOptions;
use crate::annotate::types::MessageTypes;
use crate::annotate::writing::Writing;

/// What a thread does to a cloud.
#[derive(Clone)]
pub(super) struct CloudJob {
    pub(super) types: MessageTypes,
    /// How its objects are followed, if they are.
    pub(super) tracks: Option<TrackOptions>,
    /// Whether checkpoints keep what that needs.
    pub(super) keeps: bool,
    /// Whether its tracks are found when slices are joined.
    pub(super) is_of_slice: bool,
}

impl CloudJob {
    /// What is done to a cloud whose objects are followed.
    pub(super) fn new(options: &AnnotateOptions, keeps: bool) -> Self {
        CloudJob {
            types: options.types,
            tracks: Some(options.tracks.clone()),
            keeps,
            is_of_slice: options.slice.is_some(),
        }
    }

    pub(super) fn writing<'a>(&'a self, config: &'a AnnotateConfig) -> Writing<'a> {
        let CloudJob { types, tracks, keeps, .. } = self;
        Writing { config, types, tracks: tracks.as_ref(), keeps: *keeps }
    }
}
