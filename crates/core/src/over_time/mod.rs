//! A drive, not a bag of frames: the motion of the sensor, and ids of objects that last.
//!
//! [`observe`] keeps a few cells of each instance of a frame. A [`Tracker`] takes these frame by
//! frame, with the pose of the sensor, and gives the track of each instance after a fixed lag. What
//! it gives depends on the observations and poses alone, in their order.

mod affinity;
mod continuation;
mod displacement;
pub mod ego_motion;
mod kinematics;
mod observation;
mod params;
mod sighting;
mod track;
mod tracked_object;
mod tracker;
mod votes;
mod window;

#[cfg(test)]
mod tests;

pub use affinity::Agreement;
pub use observation::{ObservedInstance, observe};
pub use params::TrackParams;
pub use tracked_object::{ObjectVelocity, TrackedObject};
pub use tracker::{DecidedFrame, TrackLink, Tracker, TrackerFrame};
pub use votes::InstanceTrack;
