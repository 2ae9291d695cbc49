//! A cloud as a message of any format has it: points packed in bytes, and what says how to read
//! them.

use std::borrow::Cow;
use std::collections::BTreeSet;

use nalgebra::Isometry3;

use super::fields::{CloudPose, PointField};
use super::format::CloudFormat;
use crate::error::frame::{FrameError, Result};
use crate::messages::ros::{ByteOrder, Layout};
use crate::messages::stamp::stamp_ns;

/// A cloud as it lies in a message. [`CloudFormat::decode`] has checked that the sizes agree.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudMessage<'a> {
    /// Format of the message.
    pub format: CloudFormat,
    /// Order of the bytes of the message's own numbers, where its format leaves that open: CDR (the
    /// numbers in `data` have an order of their own).
    pub byte_order: ByteOrder,
    /// Whole seconds of the stamp.
    pub stamp_sec: i64,
    /// Nanoseconds of the stamp beyond the seconds.
    pub stamp_nanosec: u32,
    /// Coordinate frame.
    pub frame_id: String,
    /// Pose of the points in `frame_id`, if the message has one. Clustering uses the points as they
    /// are; what is written in `frame_id`, such as boxes, has to apply the pose.
    pub pose: Option<CloudPose>,
    /// Rows; 1 if unorganised.
    pub height: u32,
    /// Points per row.
    pub width: u32,
    /// Columns.
    pub fields: Vec<PointField>,
    /// Whether the numbers in `data` are big endian.
    pub is_bigendian: bool,
    /// Bytes from point to point.
    pub point_step: u32,
    /// Bytes from row to row as declared; see [`CloudMessage::row_stride`].
    pub row_step: u32,
    /// The points.
    pub data: Cow<'a, [u8]>,
    /// Whether the writer says that every point is finite.
    pub is_dense: bool,
}

impl Default for CloudMessage<'_> {
    fn default() -> Self {
        CloudMessage {
            format: CloudFormat::Ros2,
            byte_order: ByteOrder::Little,
            stamp_sec: 0,
            stamp_nanosec: 0,
            frame_id: String::new(),
            pose: None,
            height: 1,
            width: 0,
            fields: Vec::new(),
            is_bigendian: false,
            point_step: 0,
            row_step: 0,
            data: Cow::Borrowed(&[]),
            is_dense: false,
        }
    }
}

impl CloudMessage<'_> {
    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.height as usize * self.width as usize
    }

    /// Stamp in nanoseconds; what does not fit is cut off at the ends of the range.
    pub fn stamp_ns(&self) -> i64 {
        stamp_ns(self.stamp_sec, self.stamp_nanosec)
    }

    /// Byte order of the numbers in `data`.
    pub fn data_order(&self) -> ByteOrder {
        if self.is_bigendian { ByteOrder::Big } else { ByteOrder::Little }
    }

    /// Bytes from row to row as the data has them: packed if the data is exactly that long,
    /// whatever `row_step` says.
    pub fn row_stride(&self) -> usize {
        let packed = self.width as usize * self.point_step as usize;
        if self.data.len() == packed * self.height as usize {
            packed
        } else {
            self.row_step as usize
        }
    }

    /// The layout of ROS messages beside this one; `None` if it is not a ROS message.
    pub fn layout(&self) -> Option<Layout> {
        match self.format {
            CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 | CloudFormat::LivoxRos2 => {
                Some(Layout::Cdr(self.byte_order))
            }
            CloudFormat::Ros1 | CloudFormat::LivoxRos1 => Some(Layout::Ros1),
            CloudFormat::FoxgloveProtobuf | CloudFormat::FoxgloveJson => None,
        }
    }

    /// The bytes of each point, row by row.
    pub fn points(&self) -> impl Iterator<Item = &[u8]> {
        let step = (self.point_step as usize).max(1);
        self.rows().flat_map(move |row| row.chunks_exact(step))
    }

    /// The bytes of each row's points, without what is behind them.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &[u8]> {
        let packed = self.width as usize * self.point_step as usize;
        self.data.chunks_exact(self.row_stride().max(1)).map(move |row| &row[..packed])
    }

    /// Takes coordinates of the points to `frame_id`.
    pub fn isometry(&self) -> Isometry3<f64> {
        self.pose.map_or_else(Isometry3::identity, |pose| pose.isometry())
    }

    /// A name that several fields have; of them the first is read.
    pub fn repeated_field(&self) -> Option<&str> {
        let mut seen = BTreeSet::new();
        self.fields.iter().map(|field| field.name.as_str()).find(|name| !seen.insert(*name))
    }

    /// The field of a name; of several the first.
    pub fn field(&self, name: &str) -> Option<&PointField> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// An error about this message.
    pub(in crate::messages) fn malformed(&self, problem: String) -> FrameError {
        FrameError::Malformed { message: self.format.type_name(), problem }
    }

    /// Checks that height, width, both steps and the data's length agree.
    pub(super) fn check(&self) -> Result<()> {
        let [height, width, point_step, row_step] =
            [self.height, self.width, self.point_step, self.row_step].map(u128::from);
        let length = self.data.len() as u128;
        let shape = format!(
            "{height} x {width} points of {point_step} bytes in rows of {row_step} bytes, {length} \
             bytes of data"
        );
        if point_step == 0 && height * width > 0 {
            return Err(self.malformed(format!("points without bytes: {shape}")));
        }
        if length == height * width * point_step {
            return Ok(());
        }
        if row_step < width * point_step {
            return Err(self.malformed(format!("rows shorter than their points: {shape}")));
        }
        if length != height * row_step {
            return Err(self.malformed(format!("the data is not as long as its rows: {shape}")));
        }
        Ok(())
    }
}
