//! The schema of a message type, and how a definition is put together from assets.

use std::borrow::Cow;
use std::collections::BTreeSet;

use foxglove::Encode;
use serde_json::Value;

/// The schema of a message type, as a recording stores it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessageSchema {
    /// Name of the type.
    pub name: &'static str,
    /// Encoding of the schema.
    pub encoding: &'static str,
    /// The schema.
    pub data: Cow<'static, [u8]>,
    /// Encoding of the messages.
    pub message_encoding: &'static str,
    /// ROS 1's fingerprint of the type.
    pub md5: Option<&'static str>,
}

impl MessageSchema {
    /// A type of ROS 2.
    pub(super) const fn ros2(name: &'static str, definition: &'static str) -> Self {
        MessageSchema {
            name,
            encoding: "ros2msg",
            data: Cow::Borrowed(definition.as_bytes()),
            message_encoding: "cdr",
            md5: None,
        }
    }

    /// A type of ROS 1 and its fingerprint.
    pub(super) const fn ros1(
        name: &'static str,
        definition: &'static str,
        md5: &'static str,
    ) -> Self {
        MessageSchema {
            name,
            encoding: "ros1msg",
            data: Cow::Borrowed(definition.as_bytes()),
            message_encoding: "ros1",
            md5: Some(md5),
        }
    }

    /// One of Foxglove's types in protocol buffers, with the set of file descriptors that its crate
    /// has.
    pub(crate) fn protobuf<M: Encode>(name: &'static str) -> Self {
        let data = M::get_schema().map(|schema| schema.data).unwrap_or_default();
        MessageSchema { name, encoding: "protobuf", data, message_encoding: "protobuf", md5: None }
    }

    /// Whether a schema that a recording has defines this type: it is not empty or a bare name, and
    /// a definition of ROS has those of the types in it.
    pub(crate) fn is_defined_by(&self, encoding: &str, data: &[u8]) -> bool {
        if !matches!(encoding, "ros2msg" | "ros1msg") || encoding != self.encoding {
            return data.contains(&b'{') || (encoding == "protobuf" && !data.is_empty());
        }
        let fields = |definition: &[u8]| -> BTreeSet<String> {
            let text = String::from_utf8_lossy(definition);
            let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
            let names =
                lines.filter_map(|line| match line.split_whitespace().collect::<Vec<_>>() {
                    words if words.len() < 2 || line.contains('=') => None,
                    words if words[0] == "MSG:" => words[1].rsplit('/').next().map(str::to_owned),
                    words => Some(words[1].to_owned()),
                });
            // How a time is defined differs between versions.
            let is_part_of_time = |name: &String| {
                matches!(name.as_str(), "Time" | "sec" | "nanosec" | "secs" | "nsecs" | "seq")
            };
            names.filter(|name| !is_part_of_time(name)).collect()
        };
        fields(data).is_superset(&fields(&self.data))
    }

    /// A type in JSON; white space in the text of its JSON schema does not matter.
    pub(crate) fn json(name: &'static str, schema: &str) -> Self {
        let schema: Value = serde_json::from_str(schema).expect("an asset is JSON");
        let data = schema.to_string().into_bytes().into();
        MessageSchema { name, encoding: "jsonschema", data, message_encoding: "json", md5: None }
    }
}

/// A complete definition: the fields of a type, then a line and the fields of each type in it.
/// The assets are in the folders `ros1`, `ros2` and, where they are the same, `both`.
macro_rules! definition {
    ($folder:ident $own:literal: $($from:ident $part:literal)*) => {
        concat!(
            include_str!(concat!(stringify!($folder), "/", $own, ".msg")),
            $(
                "========================================",
                "========================================\nMSG: ",
                $part,
                "\n",
                include_str!(concat!(stringify!($from), "/", $part, ".msg")),
            )*
        )
    };
}
pub(super) use definition;
