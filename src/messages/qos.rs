//! What recorders note of a topic in its channel's metadata: rosbag2 its quality of service, ROS 1
//! the connection.

use std::collections::BTreeMap;

use super::definitions::MessageSchema;

/// Key of the metadata.
pub const QOS_KEY: &str = "offered_qos_profiles";

/// How long a subscriber that comes late gets what was sent before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// As long as the sender is there: for what is sent once.
    TransientLocal = 1,
    /// Not at all.
    Volatile = 2,
}

/// The metadata of a channel whose sender keeps the last messages and delivers each, and says
/// nothing else: for ever, in nanoseconds of 63 bits, is rosbag2's "not said". Readers such as
/// rosbags want every key.
pub fn qos_metadata(depth: u32, durability: Durability) -> BTreeMap<String, String> {
    let durability = durability as u8;
    let mut profile =
        format!("- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n");
    for (time, behind) in
        [("deadline", ""), ("lifespan", "  liveliness: 1\n"), ("liveliness_lease_duration", "")]
    {
        profile += &format!("  {time}:\n    sec: 9223372036\n    nsec: 854775807\n{behind}");
    }
    profile += "  avoid_ros_namespace_conventions: false\n";
    BTreeMap::from([(QOS_KEY.to_owned(), profile)])
}

/// What recorders of its kind of messages note of a channel of a type: ROS 2 its quality of
/// service, ROS 1 the connection.
pub fn connection_metadata(
    topic: &str,
    schema: &MessageSchema,
    qos: impl FnOnce() -> BTreeMap<String, String>,
) -> BTreeMap<String, String> {
    match (schema.message_encoding, schema.md5) {
        ("cdr", _) => qos(),
        (_, Some(md5)) => ros1_connection(topic, md5),
        _ => BTreeMap::new(),
    }
}

/// What a ROS 1 bag notes of a connection on a topic, given the sum of its type's definition.
fn ros1_connection(topic: &str, md5: &str) -> BTreeMap<String, String> {
    let entries = [("callerid", "/divmerge"), ("latching", "0"), ("md5sum", md5), ("topic", topic)];
    entries.map(|(key, value)| (key.to_owned(), value.to_owned())).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_a_profile_is_there_once() {
        let profile = &qos_metadata(7, Durability::Volatile)[QOS_KEY];
        assert!(profile.contains("  depth: 7\n") && profile.contains("  durability: 2\n"));
        for key in [
            "- history:",
            "  reliability:",
            "  deadline:",
            "  lifespan:",
            "  liveliness:",
            "  liveliness_lease_duration:",
            "  avoid_ros_namespace_conventions:",
        ] {
            assert_eq!(profile.matches(key).count(), 1, "{key}");
        }
    }
}
