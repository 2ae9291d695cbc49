//! What a file is that is not an MCAP.

/// Bytes that tell kinds of files apart.
pub(crate) const START_LEN: usize = 64;

/// What to do with packets.
const PACKETS: &str = "a capture of network packets; play it through the sensor's ROS 2 \
                       driver (or its maker's tools) and record the clouds: `ros2 bag record \
                       -s mcap -a`";
/// What a failed download leaves.
const A_PAGE: &str = "a page of the web, perhaps one that says why the recording could not be \
                      fetched; look at it and fetch the recording again";
/// What to do with scans.
const SCAN: &str = "; `divmerge convert folder FOLDER -o OUT.mcap` makes a recording of a folder \
                    of such scans";
/// What files begin with, what they are and what to do, and what else to say.
const KINDS: [(&[u8], &str, &str); 24] = [
    (
        b"version https://git-lfs.github.com/spec/",
        "a pointer of Git LFS, which stands for the recording; fetch that with `git lfs pull`",
        "",
    ),
    (b"#ROSBAG", "a ROS 1 bag; convert it to MCAP first (`mcap convert IN.bag OUT.mcap`)", ""),
    (
        b"SQLite format 3",
        "a rosbag2 database (.db3); convert it to MCAP first (`mcap convert IN.db3 OUT.mcap`, \
         or `ros2 bag convert`)",
        "",
    ),
    (b"# .PCD", "a point cloud (.pcd)", SCAN),
    (b"VERSION .", "a point cloud (.pcd)", SCAN),
    (b"VERSION 0.", "a point cloud (.pcd)", SCAN),
    (b"\x93NUMPY", "an array of NumPy (.npy)", SCAN),
    (b"ply\n", "a point cloud (.ply); convert it to .pcd first", SCAN),
    (b"ply\r\n", "a point cloud (.ply); convert it to .pcd first", SCAN),
    (b"LASF", "a point cloud (.las, .laz); convert it to .pcd first", SCAN),
    (b"rosbag2_bagfile_information", "the description of a rosbag2 folder; name the folder", ""),
    (b"<!DOCTYPE html", A_PAGE, ""),
    (b"<html", A_PAGE, ""),
    (b"<?xml", A_PAGE, ""),
    (b"\xd4\xc3\xb2\xa1", PACKETS, ""),
    (b"\xa1\xb2\xc3\xd4", PACKETS, ""),
    (b"\x4d\x3c\xb2\xa1", PACKETS, ""),
    (b"\x0a\x0d\x0d\x0a", PACKETS, ""),
    (b"\x1f\x8b", "compressed with gzip; decompress it first (`gunzip`)", ""),
    (
        b"\x28\xb5\x2f\xfd",
        "compressed with zstd; name it FILE.mcap.zst to have it unpacked as it is read, or \
         decompress it first (`zstd -d`)",
        "",
    ),
    (b"\x04\x22\x4d\x18", "compressed with lz4; decompress it first (`lz4 -d`)", ""),
    (b"BZh", "compressed with bzip2; decompress it first (`bunzip2`)", ""),
    (b"\xfd7zXZ", "compressed with xz; decompress it first (`unxz`)", ""),
    (b"PK\x03\x04", "a zip archive; unpack it first (`unzip`)", ""),
];

/// What a file is that starts with these bytes, and what to do.
pub(crate) fn not_a_recording(start: &[u8]) -> String {
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
    match KINDS.iter().find(|(magic, ..)| start.starts_with(magic)) {
        Some((_, kind, more)) => format!("not an MCAP but {kind}{more}"),
        None => {
            let bytes: Vec<String> = start.iter().take(8).map(|b| format!("{b:02x}")).collect();
            format!("not an MCAP: it starts with {}", bytes.join(" "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_named_with_what_to_do() {
        for (start, kind, what_to_do) in [
            (&b"\x28\xb5\x2f\xfd\x04\x88"[..], "zstd", "zstd -d"),
            (b"\x1f\x8b\x08", "gzip", "gunzip"),
            (
                b"version https://git-lfs.github.com/spec/v1\noid sha256:00",
                "Git LFS",
                "git lfs pull",
            ),
            (b"# .PCD v0.7 - Point Cloud", ".pcd", "convert folder"),
            (b"VERSION .7\nFIELDS x y z", ".pcd", "convert folder"),
            (b"SQLite format 3\0", ".db3", "ros2 bag convert"),
            (b"#ROSBAG V2.0\n", "ROS 1 bag", "mcap convert"),
            (b"\xd4\xc3\xb2\xa1", "network packets", "ros2 bag record"),
        ] {
            let said = not_a_recording(start);
            assert!(said.contains(kind) && said.contains(what_to_do), "{said}");
        }
        assert!(not_a_recording(b"VERSIONS").contains("it starts with 56 45 52"));
    }
}
