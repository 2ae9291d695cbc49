//! Objects followed over the clouds of a recording: each cloud is observed where it is clustered,
//! the observations of a topic go through one tracker in their order, and the messages of a cloud
//! are written when its tracks are decided.
//!
//! What the tracker gives depends on the observations alone. So a run that is resumed and slices
//! that are joined keep those, and come to the same tracks.

mod drive;
mod driven_way;
mod follower;
mod frame_follower;
mod observation;
mod options;
mod recorded_motion;
mod sensor_motion;
mod summary;
mod tracked;

pub use drive::{FollowProgress, FollowedCloud, FollowedDrive, FollowedInstance, follow_drive};
pub(super) use follower::{Decided, TopicFollower};
pub(super) use frame_follower::FrameFollower;
pub(super) use observation::{Stored, observe_cloud};
pub use options::{EgoMotionSource, TrackMode, TrackOptions};
pub(super) use recorded_motion::RecordedMotion;
pub use sensor_motion::MotionReport;
pub use summary::TrackSummary;
pub(super) use tracked::{Untracked, stored_cloud};
