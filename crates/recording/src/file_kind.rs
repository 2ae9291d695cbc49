//! What a file is that is not an MCAP.

/// What a file is that starts with these bytes, and what to do.
pub(crate) fn not_a_recording(start: &[u8]) -> String {
    const PACKETS: &str = "a capture of network packets; play it through the sensor's ROS 2 \
                           driver (or its maker's tools) and record the clouds: `ros2 bag record \
                           -s mcap -a`";
    const KINDS: [(&[u8], &str); 12] = [
        (b"#ROSBAG", "a ROS 1 bag; convert it to MCAP first (`mcap convert IN.bag OUT.mcap`)"),
        (
            b"SQLite format 3",
            "a rosbag2 database (.db3); convert it to MCAP first (`mcap convert IN.db3 OUT.mcap`, \
             or `ros2 bag convert`)",
        ),
        (b"\xd4\xc3\xb2\xa1", PACKETS),
        (b"\xa1\xb2\xc3\xd4", PACKETS),
        (b"\x4d\x3c\xb2\xa1", PACKETS),
        (b"\x0a\x0d\x0d\x0a", PACKETS),
        (b"\x1f\x8b", "compressed with gzip; decompress it first"),
        (b"\x28\xb5\x2f\xfd", "compressed with zstd; decompress it first"),
        (b"\x04\x22\x4d\x18", "compressed with lz4; decompress it first"),
        (b"BZh", "compressed with bzip2; decompress it first"),
        (b"\xfd7zXZ", "compressed with xz; decompress it first"),
        (b"PK\x03\x04", "a zip archive; unpack it first"),
    ];
    if start.is_empty() {
        return "the file is empty".to_owned();
    }
    if mcap::MAGIC.starts_with(start) {
        return "the file is cut off within the eight bytes that an MCAP starts with".to_owned();
    }
    if start.starts_with(&mcap::MAGIC[..5]) {
        return format!(
            "an MCAP of version {:?}; only version '0' can be read",
            char::from(start[5])
        );
    }
    match KINDS.iter().find(|(magic, _)| start.starts_with(magic)) {
        Some((_, kind)) => format!("not an MCAP but {kind}"),
        None => {
            let bytes: Vec<String> = start.iter().take(8).map(|b| format!("{b:02x}")).collect();
            format!("not an MCAP: it starts with {}", bytes.join(" "))
        }
    }
}
