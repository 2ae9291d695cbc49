//! Definitions of the messages, for recordings that are written anew.

use std::borrow::Cow;

use foxglove::Encode;
use foxglove::messages::PointCloud;

use super::CloudFormat;
use crate::io::definitions::{self, MessageSchema};

impl CloudFormat {
    /// The definition of the format's messages.
    pub fn schema(self) -> MessageSchema {
        let foxglove = |encoding, data| MessageSchema {
            name: self.type_name(),
            encoding,
            data,
            message_encoding: self.message_encoding(),
            md5: None,
        };
        match self {
            CloudFormat::Ros2 => definitions::POINT_CLOUD2,
            CloudFormat::Ros1 => definitions::ros1::POINT_CLOUD2,
            CloudFormat::FoxgloveRos2 => definitions::FOXGLOVE_POINT_CLOUD,
            CloudFormat::FoxgloveProtobuf => foxglove("protobuf", descriptors::<PointCloud>()),
            CloudFormat::FoxgloveJson => foxglove("jsonschema", json_schema()),
        }
    }
}

/// The descriptor set of one of Foxglove's messages.
fn descriptors<M: Encode>() -> Cow<'static, [u8]> {
    M::get_schema().map(|schema| schema.data).unwrap_or_default()
}

/// The message in JSON schema, after the interface's published facts.
fn json_schema() -> Cow<'static, [u8]> {
    use serde_json::json;
    let object = |title: &str, properties| json!({"title": title, "type": "object", "properties": properties});
    let numbers = |names: &[&str]| {
        let property = |name: &&str| ((*name).to_owned(), json!({"type": "number"}));
        serde_json::Value::Object(names.iter().map(property).collect())
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
    let cloud = object(
        "foxglove.PointCloud",
        json!({
            "timestamp": object("time", json!({"sec": whole, "nsec": whole})),
            "frame_id": {"type": "string"},
            "pose": pose,
            "point_stride": whole,
            "fields": {"type": "array", "items": field},
            "data": {"type": "string", "contentEncoding": "base64"},
        }),
    );
    Cow::Owned(cloud.to_string().into_bytes())
}
