//! Definitions of the messages, for recordings that are written anew.

use foxglove::messages::PointCloud;
use serde_json::{Value, json};

use super::CloudFormat;
use crate::io::definitions::{self, MessageSchema};

impl CloudFormat {
    /// The definition of the format's messages.
    pub fn schema(self) -> MessageSchema {
        match self {
            CloudFormat::Ros2 => definitions::POINT_CLOUD2,
            CloudFormat::Ros1 => definitions::ros1::POINT_CLOUD2,
            CloudFormat::FoxgloveRos2 => definitions::FOXGLOVE_POINT_CLOUD,
            CloudFormat::FoxgloveProtobuf => {
                MessageSchema::protobuf::<PointCloud>(self.type_name())
            }
            CloudFormat::FoxgloveJson => MessageSchema::json(self.type_name(), &json_schema()),
        }
    }
}

/// The message in JSON schema, after the interface's published facts.
fn json_schema() -> Value {
    let object = |title: &str, properties| json!({"title": title, "type": "object", "properties": properties});
    let numbers = |names: &[&str]| {
        let property = |name: &&str| ((*name).to_owned(), json!({"type": "number"}));
        Value::Object(names.iter().map(property).collect())
    };
    let whole = json!({"type": "integer", "minimum": 0});
    let pose = object(
        "foxglove.Pose",
        json!({
            "position": object("foxglove.Vector3", numbers(&["x", "y", "z"])),
            "orientation": object("foxglove.Quaternion", numbers(&["x", "y", "z", "w"])),
        }),
    );
    let field = object(
        "foxglove.PackedElementField",
        json!({"name": {"type": "string"}, "offset": whole, "type": {"type": "integer"}}),
    );
    object(
        "foxglove.PointCloud",
        json!({
            "timestamp": object("time", json!({"sec": whole, "nsec": whole})),
            "frame_id": {"type": "string"},
            "pose": pose,
            "point_stride": whole,
            "fields": {"type": "array", "items": field},
            "data": {"type": "string", "contentEncoding": "base64"},
        }),
    )
}
