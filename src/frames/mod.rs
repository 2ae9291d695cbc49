//! The clouds of a recording, one after the other, and what the recording holds beside them.
//!
//! `Walk` is the one loop over a recording's records: it counts the clouds of each topic and reads
//! only the chunks that a [`Selection`] needs. [`EncodedClouds`] iterates over the selected clouds,
//! or the turns that they are put together to ([`Assemble`]); [`LabelledFrames`] over clouds with
//! their truth. [`FrameBoxes`], [`FrameClasses`] and [`recorded_transforms`] find what belongs to a
//! cloud, [`EgoBodies`] the vehicle that carries the sensor.

pub(crate) mod assemble;
mod boxes;
mod classes;
mod clouds;
mod counter;
mod ego_bodies;
mod encoded;
mod key;
mod labelled;
mod last_decoded;
mod metadata;
mod selection;
mod topic_boxes;
mod topic_classes;
pub(crate) mod topics;
mod transforms;
pub(crate) mod walk;

pub use assemble::{Assemble, sweeps_in_parts};
pub use boxes::{BoxSource, FrameBoxes};
pub use classes::{ClassSource, FrameClasses};
pub use clouds::{CloudAt, EncodedClouds, encoded_cloud_at};
pub(crate) use counter::CloudCounter;
pub use ego_bodies::{EgoBodies, Remark};
pub use encoded::EncodedCloud;
pub use key::CloudKey;
pub use labelled::{
    LabelledFrame, LabelledFrames, LabelledOptions, SeenClasses, Truth, TruthSource,
};
pub use last_decoded::last_decoded_cloud;
pub use metadata::find_metadata;
pub use selection::Selection;
pub use topic_boxes::FrameDetections;
pub use topic_classes::TOLERANCE_NS;
pub use topics::{CloudTopic, INSTANCES, OBJECTS, annotated_topics, choose_topics};
pub(crate) use transforms::transforms_at_rest;
pub use transforms::{recorded_transforms, transforms};
