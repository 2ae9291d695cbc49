//! Messages of a frame's objects: a box, a class and a number for each instance, in the types that
//! viewers draw and that other programs read.

mod autoware;
mod detections;
mod markers;
mod object_box;
mod scene;

use serde::{Deserialize, Serialize};

use crate::error::frame::{FrameError, Result, Unsupported};
use crate::messages::definitions::{self, MessageSchema, ros1};
use crate::messages::ros::{Layout, RosWriter};

pub use object_box::ObjectBox;

/// Types of messages that hold boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ObjectKind {
    /// `visualization_msgs/MarkerArray`: a cube and a text each, for RViz, Foxglove and Lichtblick.
    Markers,
    /// `vision_msgs/Detection3DArray`: a box with a class each, for programs.
    Detection3d,
    /// `autoware_perception_msgs/DetectedObjects`: a box with one of Autoware's classes each, for
    /// its tracker.
    Autoware,
    /// `foxglove.SceneUpdate`: a cube and a text each, for Foxglove and Lichtblick.
    Scene,
}

/// Encoding of a message of objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObjectEncoding {
    /// That of ROS.
    Ros(Layout),
    /// Protocol buffers.
    Protobuf,
    /// JSON.
    Json,
}

impl ObjectKind {
    /// Its schema.
    ///
    /// # Errors
    /// [`FrameError::Unsupported`] if the type does not exist in that encoding.
    pub fn schema(self, encoding: ObjectEncoding) -> Result<MessageSchema> {
        use ObjectEncoding::{Json, Protobuf, Ros};
        use ObjectKind::{Autoware, Detection3d, Markers, Scene};
        match (self, encoding) {
            (Markers, Ros(Layout::Cdr(_))) => Ok(definitions::MARKER_ARRAY),
            (Markers, Ros(Layout::Ros1)) => Ok(ros1::MARKER_ARRAY),
            (Detection3d, Ros(Layout::Cdr(_))) => Ok(definitions::DETECTION_ARRAY),
            (Detection3d, Ros(Layout::Ros1)) => Ok(ros1::DETECTION_ARRAY),
            (Autoware, Ros(Layout::Cdr(_))) => Ok(definitions::DETECTED_OBJECTS),
            (Scene, Protobuf) => Ok(scene::protobuf_schema()),
            (Scene, Json) => Ok(scene::json_schema()),
            _ => Err(self.missing_in(encoding)),
        }
    }

    /// Writes a frame's objects, replacing what is in `out`: seconds and nanoseconds of the stamp,
    /// coordinate frame, boxes.
    ///
    /// # Errors
    /// Those of [`ObjectKind::schema`].
    pub fn write(
        self,
        encoding: ObjectEncoding,
        header: (i32, u32, &str),
        boxes: &[ObjectBox],
        out: &mut Vec<u8>,
    ) -> Result<()> {
        use ObjectEncoding::{Json, Protobuf, Ros};
        use ObjectKind::{Autoware, Detection3d, Markers, Scene};
        match (self, encoding) {
            (Markers, Ros(layout)) => {
                markers::write(layout, header, boxes, &mut RosWriter::new(layout, out));
            }
            (Detection3d, Ros(layout)) => {
                detections::write(layout, header, boxes, &mut RosWriter::new(layout, out));
            }
            (Autoware, Ros(layout @ Layout::Cdr(_))) => {
                autoware::write(header, boxes, &mut RosWriter::new(layout, out));
            }
            (Scene, Protobuf) => scene::write_protobuf(header, boxes, out),
            (Scene, Json) => scene::write_json(header, boxes, out),
            _ => return Err(self.missing_in(encoding)),
        }
        Ok(())
    }

    fn missing_in(self, encoding: ObjectEncoding) -> FrameError {
        FrameError::Unsupported {
            message: self.describe(),
            problem: Unsupported::NoSuchType { encoding: encoding.describe() },
        }
    }

    fn describe(self) -> &'static str {
        match self {
            ObjectKind::Markers => "MarkerArray",
            ObjectKind::Detection3d => "Detection3DArray",
            ObjectKind::Autoware => "DetectedObjects",
            ObjectKind::Scene => "SceneUpdate",
        }
    }
}

impl ObjectEncoding {
    fn describe(self) -> &'static str {
        match self {
            ObjectEncoding::Ros(Layout::Cdr(_)) => "ROS 2",
            ObjectEncoding::Ros(Layout::Ros1) => "ROS 1",
            ObjectEncoding::Protobuf => "protocol buffers",
            ObjectEncoding::Json => "JSON",
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::messages::ros::ByteOrder;
    use divmerge_core::cloud::UprightBox;

    /// A car's box that stands upright.
    pub(crate) fn upright(id: u32, centre: [f64; 3], size: [f64; 3], yaw: f64) -> ObjectBox {
        ObjectBox {
            id,
            is_track: false,
            velocity: None,
            pose: UprightBox { centre, size, yaw }.pose(),
            size,
            class: 10,
            name: "car".to_owned(),
            probability: 1.0,
            title: format!("{id} car"),
            points: 99,
            is_object: true,
        }
    }

    #[test]
    fn a_type_that_an_encoding_does_not_have_is_refused() {
        let ros = [Layout::Cdr(ByteOrder::Little), Layout::Ros1].map(ObjectEncoding::Ros);
        for encoding in ros {
            assert!(ObjectKind::Markers.schema(encoding).is_ok());
            assert!(ObjectKind::Detection3d.schema(encoding).is_ok());
            assert!(ObjectKind::Scene.schema(encoding).is_err());
        }
        let error = ObjectKind::Autoware.schema(ros[1]).unwrap_err().to_string();
        assert!(error.contains("ROS 1") && error.contains("DetectedObjects"), "{error}");
        for encoding in [ObjectEncoding::Protobuf, ObjectEncoding::Json] {
            assert!(ObjectKind::Scene.schema(encoding).is_ok());
            let write = ObjectKind::Markers.write(encoding, (0, 0, ""), &[], &mut Vec::new());
            assert!(write.is_err());
        }
    }
}
