//! Reading and writing recordings: MCAP, the messages in it, and the messages added to it.
//!
//! Nothing here knows of clustering. A recording is read record by record ([`recording`]), a cloud
//! message becomes a [`crate::PointCloud`] ([`clouds`]), and results become messages
//! ([`annotation`], [`markers`]).

pub mod annotation;
pub mod boxes;
pub mod camera_info;
pub mod cloud_recording;
pub mod clouds;
pub mod definitions;
pub mod diagnostics;
pub mod drive;
pub mod frames;
pub mod labelled;
pub mod markers;
pub mod problems;
pub mod qos;
pub mod recording;
pub mod ros;
pub mod scans;
pub mod semantic_kitti;
pub mod transforms;

pub use annotation::{PointAnnotation, annotated_cloud};
pub use boxes::{BoxSource, FrameBoxes, FrameDetections};
pub use clouds::{
    CloudChannel, CloudFormat, CloudPose, Datatype, MessageSchema, PackedCloud, PointField,
};
pub use definitions::{
    DIAGNOSTIC_ARRAY_NAME, DIAGNOSTIC_ARRAY_SCHEMA, MARKER_ARRAY_NAME, MARKER_ARRAY_SCHEMA,
    POINT_CLOUD2_NAME, POINT_CLOUD2_SCHEMA,
};
pub use diagnostics::{Diagnostic, Level, diagnostic_array};
pub use frames::{CloudMessage, CloudMessages, CloudNumber, Which, cloud_message_at};
pub use labelled::{
    LabelledFrame, LabelledFrames, LabelledOptions, SeenClasses, Truth, TruthSource,
};
pub use markers::{MarkerBox, marker_array};
pub use recording::{
    AttachmentHeader, Channel, Compression, Item, MessageHeader, Metadata, Overview, Part,
    PartialFile, Position, ReadTimes, Record, RecordingReader, RecordingWriter, Schema,
    SharedBytes, SourceChunk, WriteOptions, WriteTimes, write_file,
};
pub use ros::{ByteOrder, Layout};
