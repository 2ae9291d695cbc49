//! How suspect the decisions of a frame are, without any truth.
//!
//! Triage looks through a frame's run for signs of failure: joins that only just came about or were
//! only just refused, votes that only just decided, instances that do not look like one object of
//! their class, points and beams that are missing. Each sign is a [`Suspect`] with the figure that
//! was measured, the bound it is compared with, a sentence, and points for `explain`.
//!
//! | kinds | file |
//! | --- | --- |
//! | thin joins | `joins` |
//! | close cuts, where there are no classes | `cuts` |
//! | could be one, almost touching | `pairs` |
//! | too large, two masses, leftovers | `sizes`, with `parts` and `between` |
//! | thin majorities, chains of them, refused votes | `votes` |
//! | points without an instance, mixed classes, missing returns | `points` |
//! | all clouds of a recording, and a topic with what was found | [`recording`] |
//!
//! # Scores
//!
//! Scores are comparable across kinds: a score is meant as the probability that evaluation would
//! count a failure there. It ranks better than it estimates: where it says 1/4, half as many
//! failures are found, and fewer where it says less (`examples/08_triage.rs` prints these figures).
//! It is the product of three shares:
//!
//! - the *evidence*, 0 where a kind begins to fire and 1 at its strongest, by a rule that each kind
//!   states;
//! - the kind's *weight* ([`SuspectKind::weight`]): about how often it is right at full evidence,
//!   chosen on simulated drives other than those that the example reports on;
//! - the *stake*: the points of the instance most in doubt as a share of
//!   [`TriageParams::min_points`], below which evaluation counts no failure.
//!
//! An instance that several suspects name has the score 1 - prod(1 - s), as if they were
//! independent. A second instance that a suspect names has the part of the suspect's score that the
//! first could spoil of it. A frame's score is computed in the same way from all its suspects: it
//! is the probability that anything at all is wrong with the frame.
//!
//! ```
//! use divmerge::Taxonomy;
//! use divmerge::diagnose::explain::ClusteredCloud;
//! use divmerge::pipeline::{self, Config};
//! use divmerge::semantics::MaskSource;
//! use divmerge::simulate::{Drive, Scene, Sensor};
//! use divmerge::diagnose::triage::{TriageParams, triage};
//!
//! let cloud = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0).cloud;
//! let taxonomy = Taxonomy::semantic_kitti();
//! let (mask, config) = (MaskSource::Classes(&taxonomy), Config::paper());
//! let stages = pipeline::run(&cloud, mask, &config);
//! let frame = ClusteredCloud { cloud: &cloud, mask, config: &config, stages: &stages };
//! let found = triage(&frame, &TriageParams::default());
//! assert!(found.suspects.is_sorted_by(|a, b| a.score >= b.score));
//! println!("{}", found.suspects[0].sentence);
//! ```

mod between;
mod cuts;
mod facts;
mod joins;
mod pairs;
mod parts;
mod points;
pub mod ranking;
pub mod recording;
mod score;
mod sizes;
mod suspect;
pub mod table;
#[cfg(test)]
mod tests;
mod votes;

pub use score::{Case, Triage, triage};
pub use suspect::{Concern, Suspect, SuspectKind, TriageParams};
