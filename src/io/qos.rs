//! Quality of service as rosbag2 writes it into the metadata of a channel.

/// Key of a channel's metadata.
pub const QOS_KEY: &str = "offered_qos_profiles";

/// How long messages are kept for those who come late.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// Not at all.
    Volatile,
    /// For as long as the publisher lives.
    TransientLocal,
}

/// A profile in YAML: reliable, the last `depth` messages kept, no deadline, no lease. Every key is there, since readers of
/// bags want every key.
pub fn qos_profile(depth: u32, durability: Durability) -> String {
    let durability = match durability {
        Durability::TransientLocal => 1,
        Durability::Volatile => 2,
    };
    let duration = |name: &str| format!("  {name}:\n    sec: 9223372036\n    nsec: 854775807\n");
    let [deadline, lifespan, lease] =
        ["deadline", "lifespan", "liveliness_lease_duration"].map(duration);
    format!(
        "- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n{deadline}{lifespan}  \
         liveliness: 1\n{lease}  avoid_ros_namespace_conventions: false\n"
    )
}
