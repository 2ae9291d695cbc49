//! Each format read back as it was written, and what each makes of messages that are broken.

use std::borrow::Cow;

use super::*;
use crate::error::FrameError;

const FOXGLOVE: [CloudFormat; 3] =
    [CloudFormat::FoxgloveRos2, CloudFormat::FoxgloveProtobuf, CloudFormat::FoxgloveJson];

/// Three points of 14 bytes: x, y, z, and a class; moved where the format knows of it.
fn cloud(format: CloudFormat, data: &[u8]) -> CloudMessage<'_> {
    let mut fields = tests::xyz();
    fields.push(tests::field("label", 12, Datatype::UInt16));
    let pose = CloudPose { position: [1.0, -2.0, 0.5], orientation: [0.0, 0.0, 0.6, 0.8] };
    CloudMessage {
        format,
        stamp_sec: 1_700_000_000,
        stamp_nanosec: 5,
        frame_id: "líðar \"1\"".to_owned(),
        pose: format.is_foxglove().then_some(pose),
        width: 3,
        fields,
        point_step: 14,
        row_step: 42,
        data: Cow::Borrowed(data),
        ..CloudMessage::default()
    }
}

fn data() -> Vec<u8> {
    let point = |i: u8| {
        let i = f32::from(i);
        let place = [i, i + 0.1, -i].map(f32::to_le_bytes).concat();
        [place.as_slice(), &(40 + i as u16).to_le_bytes()].concat()
    };
    [point(1), point(2), point(3)].concat()
}

fn encoded(cloud: &CloudMessage) -> Vec<u8> {
    let mut message = Vec::new();
    cloud.encode(&mut message).unwrap();
    message
}

#[test]
fn every_format_is_read_back_as_it_was_written() {
    let data = data();
    for format in CloudFormat::ALL {
        let cloud = cloud(format, &data);
        let message = encoded(&cloud);
        let read = format.decode(&message).unwrap();
        assert_eq!(read, cloud, "{format:?}");
        assert_eq!(format.stamp_ns(&message).unwrap(), 1_700_000_000_000_000_005);
        let points = read.to_cloud(Some("label")).unwrap().into_columns();
        assert_eq!((points.x, points.class), (vec![1.0, 2.0, 3.0], Some(vec![41, 42, 43])));
    }
}

#[test]
fn data_that_lies_in_the_message_stays_there() {
    let data = data();
    for format in CloudFormat::ALL {
        let message = encoded(&cloud(format, &data));
        let is_borrowed = matches!(format.decode(&message).unwrap().data, Cow::Borrowed(_));
        assert_eq!(is_borrowed, format != CloudFormat::FoxgloveJson);
    }
}

#[test]
fn a_cloud_keeps_its_points_in_any_other_format() {
    let data = data();
    for (from, to) in CloudFormat::ALL.iter().flat_map(|&a| CloudFormat::ALL.map(|b| (a, b))) {
        let mut cloud = cloud(from, &data);
        cloud.pose = None;
        cloud.fields[3].datatype = Datatype::Unknown(99);
        let message = encoded(&cloud.reformatted(to).unwrap());
        let read = to.decode(&message).unwrap();
        assert_eq!((&read.data, read.stamp_ns()), (&cloud.data, cloud.stamp_ns()));
        assert_eq!(read.fields[..3], cloud.fields[..3]);
        let code = if from.is_foxglove() == to.is_foxglove() { 99 } else { 0 };
        assert_eq!(read.fields[3].datatype, Datatype::Unknown(code), "{from:?} to {to:?}");
    }
}

#[test]
fn what_a_format_has_no_words_for_is_refused() {
    let data = data();
    let big = CloudMessage { is_bigendian: true, ..cloud(CloudFormat::Ros2, &data) };
    assert!(big.reformatted(CloudFormat::Ros1).is_ok());
    for format in FOXGLOVE {
        let error = big.reformatted(format).unwrap_err();
        assert!(matches!(error, FrameError::Unsupported { .. }), "{error}");
        let moved = cloud(format, &data);
        assert!(moved.reformatted(CloudFormat::Ros2).is_err());
        let still = CloudMessage { pose: Some(CloudPose::default()), ..moved };
        assert!(still.reformatted(CloudFormat::Ros2).is_ok());
    }
}

#[test]
fn cut_messages_are_errors_or_other_clouds_and_never_a_panic() {
    let data = data();
    for format in CloudFormat::ALL {
        let message = encoded(&cloud(format, &data));
        for length in 0..message.len() {
            // Protobuf has no end: cut between two values it is another message.
            let read = format.decode(&message[..length]);
            assert!(
                read.is_err() || format == CloudFormat::FoxgloveProtobuf,
                "{format:?} {length}"
            );
        }
    }
}

#[test]
fn sizes_that_do_not_agree_are_told_with_their_numbers() {
    let data = data();
    for format in FOXGLOVE {
        let problem = |stride: u32, length: usize| {
            // What does not agree cannot be encoded either: so from its parts.
            let wrong = CloudMessage { point_step: stride, ..cloud(format, &data) };
            let mut message = Vec::new();
            let fill = |out: &mut Vec<u8>| out.extend_from_slice(&data[..length]);
            wrong.encode_with(length, &mut message, fill).unwrap();
            format.decode(&message).err().map(|error| error.to_string())
        };
        assert_eq!(problem(14, 42), None);
        assert_eq!(problem(0, 0), None);
        assert!(problem(0, 42).unwrap().contains("points of 0 bytes"));
        assert!(problem(14, 41).unwrap().contains("41 bytes of data"));
        assert!(problem(u32::MAX, 42).unwrap().contains("4294967295"));
    }
}

#[test]
fn of_fields_with_one_name_the_first_is_read() {
    let data = data();
    for format in CloudFormat::ALL {
        let mut twice = cloud(format, &data);
        twice.fields.push(tests::field("x", 4, Datatype::Float32));
        let message = encoded(&twice);
        let read = format.decode(&message).unwrap();
        assert_eq!(read.repeated_field(), Some("x"));
        assert_eq!(read.to_cloud(None).unwrap().x, [1.0, 2.0, 3.0]);
        assert_eq!(cloud(format, &data).repeated_field(), None);
    }
}

#[test]
fn more_fields_than_any_sensor_has_are_refused() {
    for format in CloudFormat::ALL {
        let fields = vec![tests::field("", 0, Datatype::UInt8); fields::MOST_FIELDS + 1];
        let many = CloudMessage { format, fields, ..CloudMessage::default() };
        let error = format.decode(&encoded(&many)).unwrap_err().to_string();
        assert!(error.contains("fields"), "{error}");
    }
}

#[test]
fn poses_are_isometries_whatever_they_hold() {
    let turned = CloudPose { position: [1.0, 2.0, 3.0], orientation: [0.0, 0.0, 1.0, 1.0] };
    let point = turned.isometry() * nalgebra::Point3::new(1.0, 0.0, 0.0);
    assert!((point - nalgebra::Point3::new(1.0, 3.0, 3.0)).norm() < 1e-12);
    for orientation in [[0.0; 4], [f64::NAN; 4], [f64::INFINITY, 0.0, 0.0, 1.0]] {
        let pose = CloudPose { position: [f64::NAN, 0.0, 0.0], orientation };
        assert_eq!(pose.isometry(), nalgebra::Isometry3::identity(), "{orientation:?}");
    }
    assert_eq!(CloudMessage::default().isometry(), nalgebra::Isometry3::identity());
}

#[test]
fn json_as_others_write_it() {
    let read = |text: &str| {
        CloudFormat::FoxgloveJson.decode(text.as_bytes()).map(|cloud| {
            (
                cloud.stamp_ns(),
                cloud.fields.iter().map(|field| field.datatype).collect::<Vec<_>>(),
                cloud.width,
            )
        })
    };
    let schema = r#"{"timestamp":{"sec":2,"nsec":3},"frame_id":"f","point_stride":4,
        "fields":[{"name":"x","offset":0,"type":7}],"data":"AAAAAAAAAAA="}"#;
    assert_eq!(read(schema).unwrap(), (2_000_000_003, vec![Datatype::Float32], 2));
    let protobuf = r#"{"timestamp":"1970-01-01T00:00:02.000000003Z","frameId":"f","pointStride":4,
        "new":[{}],
        "fields":[{"name":"x","type":"FLOAT32"},{"name":"y"}],"data":"AAAAAAAAAAA"}"#;
    let found = read(protobuf).unwrap();
    assert_eq!(found, (2_000_000_003, vec![Datatype::Float32, Datatype::Unknown(0)], 2));
    assert_eq!(read("{}").unwrap(), (0, vec![], 0));
    for (text, word) in [
        (r#"{"point_stride":4,"data":"AAA*"}"#, "base64"),
        (r#"{"point_stride":-1}"#, "-1"),
        (r#"{"point_stride":4294967296}"#, "4294967296"),
        (r#"{"timestamp":"yesterday"}"#, "yesterday"),
        (r#"{"timestamp":{"sec":null}}"#, "RFC 3339"),
        (r#"{"timestamp":{"sec":1,"nsec":NaN}}"#, "line 1"),
        (r#"{"fields":[{"name":"x","type":"FLOAT128"}]}"#, "FLOAT128"),
        (r#"{"data":"","data":""}"#, "duplicate"),
        ("[]", "no object"),
        (" ", "no object"),
        (r#"{"data":"#, "EOF"),
    ] {
        let problem = read(text).unwrap_err().to_string();
        assert!(problem.contains(word) && problem.contains("foxglove.PointCloud"), "{problem}");
    }
}

#[test]
fn protobuf_known_bytes() {
    // timestamp {2 s, 3 ns}, stride 4, field {x, offset 0 left out, FLOAT32}, a value of a later
    // version, 4 bytes.
    let message = [
        &[0x0a, 4, 0x08, 2, 0x10, 3, 0x25, 4, 0, 0, 0][..],
        &[0x2a, 5, 0x0a, 1, b'x', 0x18, 7, 0xf8, 0x01, 1],
        &[0x32, 4, 0, 0, 0x80, 0x3f],
    ]
    .concat();
    let cloud = CloudFormat::FoxgloveProtobuf.decode(&message).unwrap();
    assert_eq!((cloud.stamp_ns(), cloud.width, cloud.pose), (2_000_000_003, 1, None));
    assert_eq!(cloud.column_f64("x").unwrap(), [1.0]);
    for (message, word) in [
        (&[0x0a, 11, 0x10, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1][..], "-1 nano"),
        (&[0x12, 1, 0xff], "UTF-8"),
        (&[0x20, 4], "field 4"),
        (&[0x32, 200, 1], "byte 0"),
    ] {
        let problem = CloudFormat::FoxgloveProtobuf.decode(message).unwrap_err().to_string();
        assert!(problem.contains(word), "{problem}");
    }
}

#[test]
fn protobuf_agrees_with_the_crate_of_its_makers() {
    use foxglove::{Decode, Encode, messages};
    let data = data();
    let ours = cloud(CloudFormat::FoxgloveProtobuf, &data);
    let theirs = messages::PointCloud::decode(encoded(&ours).as_slice()).unwrap();
    assert_eq!(theirs.timestamp, Some(messages::Timestamp::new(1_700_000_000, 5)));
    assert_eq!((theirs.point_stride, &theirs.data[..]), (14, &data[..]));
    assert_eq!(theirs.pose.unwrap().orientation.unwrap().w, 0.8);
    let mut again = Vec::new();
    theirs.encode(&mut again).unwrap();
    assert_eq!(CloudFormat::FoxgloveProtobuf.decode(&again).unwrap(), ours);
}

proptest::proptest! {
    #[test]
    fn changed_bytes_never_panic(
        changes in proptest::collection::vec((0_usize..1000, proptest::num::u8::ANY), 1..6)
    ) {
        let data = data();
        for format in CloudFormat::ALL {
            let mut message = encoded(&cloud(format, &data));
            for (at, value) in &changes {
                let at = at % message.len();
                message[at] = *value;
            }
            let _ = format.stamp_ns(&message);
            if let Ok(cloud) = format.decode(&message) {
                let _ = cloud.to_cloud(cloud.semantic_field());
                let _ = (cloud.isometry(), cloud.repeated_field());
                for other in CloudFormat::ALL {
                    let Ok(other) = cloud.reformatted(other) else { continue };
                    let _ = other.encode(&mut Vec::new());
                }
            }
        }
    }
}
