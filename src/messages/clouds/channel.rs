//! What a channel carries: clouds of a format, or something from which no cloud can be read, and
//! why.

use super::format::CloudFormat;

/// What a channel carries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CloudChannel {
    /// Clouds that can be read.
    Readable(CloudFormat),
    /// What a LiDAR measured, in a form that cannot be read.
    Unreadable(Unreadable),
    /// Something else.
    Other,
}

/// Why what a LiDAR measured cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unreadable {
    /// What it is, why it cannot be read, and what to do.
    pub reason: String,
    /// Whether it is clouds, rather than something from which clouds are made.
    pub is_cloud: bool,
}

impl CloudChannel {
    /// What messages of a type's name in an encoding are.
    pub fn named(type_name: &str, message_encoding: &str) -> Self {
        let parts: Vec<&str> = type_name.split(['/', '.', ':']).filter(|p| !p.is_empty()).collect();
        let (package, own) = match parts[..] {
            [] => return CloudChannel::Other,
            [own] => ("", own),
            [package, .., own] => (package, own),
        };
        let (is_foxglove, is_livox) = (is_foxglove(package), package.starts_with("livox"));
        // In DDS, names of types can end with an underscore.
        let format = match (own.trim_end_matches('_'), message_encoding) {
            ("PointCloud2", "cdr") => CloudFormat::Ros2,
            ("PointCloud2", "ros1") => CloudFormat::Ros1,
            ("PointCloud", "cdr") if package == "foxglove_msgs" => CloudFormat::FoxgloveRos2,
            ("PointCloud", "protobuf") if is_foxglove => CloudFormat::FoxgloveProtobuf,
            ("PointCloud", "json") if is_foxglove => CloudFormat::FoxgloveJson,
            ("CustomMsg", "cdr") if is_livox => CloudFormat::LivoxRos2,
            ("CustomMsg", "ros1") if is_livox => CloudFormat::LivoxRos1,
            (own, encoding) => return CloudChannel::without_format(package, own, encoding),
        };
        CloudChannel::Readable(format)
    }

    /// The format, if the channel can be read.
    pub fn format(&self) -> Option<CloudFormat> {
        match self {
            CloudChannel::Readable(format) => Some(*format),
            _ => None,
        }
    }

    fn without_format(package: &str, own: &str, encoding: &str) -> Self {
        let is_foxglove = is_foxglove(package);
        let in_encoding = |name: &str, readable: &str| {
            let reason = format!("{name} in encoding `{encoding}`; it is read in {readable}");
            Unreadable { reason, is_cloud: true }
        };
        CloudChannel::Unreadable(match own {
            "PointCloud2" => in_encoding(own, "`cdr` and `ros1`"),
            "CustomMsg" if package.starts_with("livox") => {
                in_encoding("Livox's CustomMsg", "`cdr` and `ros1`")
            }
            "PointCloud" if is_foxglove => in_encoding(
                "foxglove.PointCloud",
                "`protobuf`, `json` and, of foxglove_msgs, `cdr`",
            ),
            "PointCloud" if package == "apollo" => Unreadable {
                reason: "apollo.drivers.PointCloud is the cloud of Apollo, a protobuf message for \
                         each point: convert it to sensor_msgs/PointCloud2 or foxglove.PointCloud \
                         and record that"
                    .to_owned(),
                is_cloud: true,
            },
            _ => match UNREADABLE.iter().find(|(names, ..)| names.contains(&own)) {
                Some((_, is_cloud, reason)) => {
                    Unreadable { reason: format!("{own} {reason}"), is_cloud: *is_cloud }
                }
                None => return CloudChannel::Other,
            },
        })
    }
}

fn is_foxglove(package: &str) -> bool {
    matches!(package, "foxglove" | "foxglove_msgs")
}

/// Types of what a LiDAR measured that cannot be read: their names, whether they are clouds, and
/// why they cannot be read and what to do. The packets are those that drivers of Velodyne, Ouster,
/// Hesai, RoboSense and Nebula hand on as their sensors send them.
const UNREADABLE: [(&[&str], bool, &str); 6] = [
    (
        &["PointCloud"],
        true,
        "keeps each point's numbers apart, as ROS did before PointCloud2: record PointCloud2, or \
         convert with the node point_cloud_converter",
    ),
    (
        &["CompressedPointCloud2", "CompressedPointCloud"],
        true,
        "is compressed (Draco, Cloudini, zlib): republish it as PointCloud2 with \
         point_cloud_transport and record that",
    ),
    (
        &["PointCloudPacked"],
        true,
        "is the cloud of Gazebo: bridge it to sensor_msgs/msg/PointCloud2 with ros_gz_bridge and \
         record that",
    ),
    (
        &["SeyondScan", "InnovusionScan", "SeyondPacket", "InnovusionPacket"],
        true,
        "is what Seyond's driver hands on as its sensor sends it: play it through that driver and \
         record its PointCloud2",
    ),
    (
        &["LaserScan", "MultiEchoLaserScan"],
        false,
        "is a scan in one plane, which has no rows of beams to compare",
    ),
    (
        &[
            "VelodyneScan",
            "VelodynePacket",
            "PacketMsg",
            "HesaiScan",
            "PandarScan",
            "PandarPacket",
            "UdpFrame",
            "UdpPacket",
            "RslidarScan",
            "RslidarPacket",
            "NebulaPackets",
            "LidarPacket",
        ],
        false,
        "holds a sensor's raw packets: play them through the sensor's driver and record its \
         PointCloud2",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_format_names_itself() {
        for format in
            [&CloudFormat::ALL[..], &[CloudFormat::LivoxRos2, CloudFormat::LivoxRos1]].concat()
        {
            let found = CloudChannel::named(format.type_name(), format.message_encoding());
            assert_eq!(found.format(), Some(format));
        }
        let dds = CloudChannel::named("sensor_msgs::msg::dds_::PointCloud2_", "cdr");
        assert_eq!(dds.format(), Some(CloudFormat::Ros2));
    }

    #[test]
    fn both_drivers_of_livox_are_known() {
        for (name, encoding, format) in [
            ("livox_ros_driver/CustomMsg", "ros1", CloudFormat::LivoxRos1),
            ("livox_ros_driver2/CustomMsg", "ros1", CloudFormat::LivoxRos1),
            ("livox_ros_driver2/msg/CustomMsg", "cdr", CloudFormat::LivoxRos2),
            ("livox_interfaces/msg/CustomMsg", "cdr", CloudFormat::LivoxRos2),
        ] {
            assert_eq!(CloudChannel::named(name, encoding).format(), Some(format), "{name}");
        }
        assert_eq!(CloudChannel::named("my_msgs/msg/CustomMsg", "cdr"), CloudChannel::Other);
    }

    #[test]
    fn what_cannot_be_read_says_why() {
        for (name, encoding, word, is_cloud) in [
            ("sensor_msgs/PointCloud", "ros1", "PointCloud2", true),
            ("sensor_msgs/msg/PointCloud2", "json", "`json`", true),
            ("foxglove.PointCloud", "flatbuffer", "`flatbuffer`", true),
            ("foxglove.PointCloud", "cdr", "foxglove_msgs", true),
            ("foxglove.CompressedPointCloud", "protobuf", "Draco", true),
            ("point_cloud_interfaces/msg/CompressedPointCloud2", "cdr", "compressed", true),
            ("sensor_msgs/msg/LaserScan", "cdr", "one plane", false),
            ("apollo.drivers.PointCloud", "protobuf", "Apollo", true),
            ("gz.msgs.PointCloudPacked", "protobuf", "ros_gz_bridge", true),
            ("ignition.msgs.PointCloudPacked", "protobuf", "Gazebo", true),
            ("seyond/msg/SeyondScan", "cdr", "Seyond's driver", true),
            ("velodyne_msgs/VelodyneScan", "ros1", "packets", false),
            ("ouster_ros/PacketMsg", "ros1", "driver", false),
        ] {
            let CloudChannel::Unreadable(found) = CloudChannel::named(name, encoding) else {
                panic!("{name} in {encoding}");
            };
            assert!(found.reason.contains(word), "{}", found.reason);
            assert_eq!(found.is_cloud, is_cloud, "{name}");
        }
        for name in ["", "std_msgs/msg/String", "sensor_msgs/msg/Image", "tf2_msgs/TFMessage"] {
            assert_eq!(CloudChannel::named(name, "cdr"), CloudChannel::Other);
        }
    }
}
