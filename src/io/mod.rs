//! Reading and writing recordings: MCAP, the messages in it, and the messages added to it.
//!
//! Nothing here knows of clustering. A recording is read record by record ([`recording`]), a cloud
//! message becomes a [`crate::PointCloud`] ([`clouds`]), and results become messages
//! ([`annotation`], [`objects`]). [`bag`] knows the folders that rosbag2 makes of recordings.

pub use crate::datasets::{bag, cloud_recording, drive, problems, scans, semantic_kitti};
pub use crate::messages::{
    annotation, camera_info, clouds, definitions, diagnostics, objects, qos, ros, transforms,
};

pub use annotation::{Certainty, PointAnnotation, annotated_cloud};
pub use bag::Bag;
pub use clouds::{CloudChannel, CloudFormat, CloudPose, Datatype, PackedCloud, PointField};
pub use definitions::{DIAGNOSTIC_ARRAY, MARKER_ARRAY, MessageSchema, POINT_CLOUD2};
pub use diagnostics::{Diagnostic, Level, diagnostic_array, diagnostic_schema};
pub use divmerge_recording as recording;
pub use divmerge_recording::address;
pub use divmerge_recording::{
    AttachmentHeader, Channel, ChunkPlace, Compression, Fetched, Item, MessageHeader,
    MessageRange as FrameRange, Metadata, Overview, Part, PartialFile, Position, ReadFilter,
    ReadTimes, Record, RecordingReader, RecordingWriter, STANDARD_STREAM, Schema, SharedBytes,
    SourceChunk, WriteOptions, WriteTimes, abandon_partial_files, checksum, is_remote, is_stream,
    write_file,
};
pub use objects::{ObjectBox, ObjectEncoding, ObjectKind};
pub use ros::{ByteOrder, Layout};
