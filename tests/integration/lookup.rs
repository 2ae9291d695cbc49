//! One cloud of a long recording, looked up by number or by time.

use std::collections::BTreeMap;
use std::io::Cursor;

use divmerge::frames::{CloudAt, encoded_cloud_at};
use divmerge::recording::MessageHeader;

/// A recording of a thousand messages in many chunks, every tenth of them out of its turn.
fn long() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().chunk_size(Some(4 << 10));
    let mut writer = options.create(&mut bytes).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/PointCloud2", "ros2msg", b"").unwrap();
    let channel_id = writer.add_channel(schema, "/points", "cdr", &BTreeMap::new()).unwrap();
    for i in 0..1000_u64 {
        let log_time = 1000 * if i % 10 == 9 { i - 7 } else { i };
        let (sequence, publish_time) = (i as u32, i);
        let header = MessageHeader { channel_id, sequence, log_time, publish_time };
        writer.write_to_known_channel(&header, &[i as u8; 1000]).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

#[test]
fn a_cloud_is_found_by_number_and_by_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.mcap");
    std::fs::write(&path, long()).unwrap();
    for number in [0, 3, 402, 700, 999] {
        let cloud = encoded_cloud_at(&path, None, CloudAt::Frame(number), None).unwrap();
        assert_eq!(cloud.number, number);
        let at = CloudAt::Time(cloud.log_time_ns() + 100);
        let near = encoded_cloud_at(&path, None, at, None).unwrap();
        // Of two at one time the earlier.
        assert_eq!(near.log_time_ns(), cloud.log_time_ns());
        assert!(near.number <= cloud.number);
    }
}
