//! Reading and writing recordings: MCAP, the ROS 2 messages in it, and the messages added to it.
//!
//! Nothing here knows of clustering. A recording is read record by record ([`recording`]), a cloud
//! message becomes a [`crate::PointCloud`] ([`point_cloud2`]), and results become messages
//! ([`annotation`], [`markers`]). [`bag`] knows the folders that rosbag2 makes of recordings.

pub mod annotation;
pub mod bag;
pub mod boxes;
pub mod camera_info;
pub mod cloud_recording;
pub mod definitions;
pub mod diagnostics;
pub mod drive;
pub mod frames;
pub mod labelled;
pub mod markers;
pub mod point_cloud2;
pub mod problems;
pub mod qos;
pub mod recording;
pub mod ros;
pub mod scans;
pub mod semantic_kitti;

pub use annotation::{PointAnnotation, annotated_cloud};
pub use bag::Bag;
pub use boxes::{BoxSource, FrameBoxes, FrameDetections};
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
pub use point_cloud2::{Datatype, PointCloud2, PointField};
pub use recording::{
    AttachmentHeader, Channel, Compression, FrameRange, Item, MessageHeader, Metadata, Overview,
    Part, PartialFile, Position, ReadTimes, Record, RecordingReader, RecordingWriter,
    STANDARD_STREAM, Schema, SharedBytes, SourceChunk, Wanted, WriteOptions, WriteTimes, checksum,
    is_stream, write_file,
};
pub use ros::{ByteOrder, Layout};
