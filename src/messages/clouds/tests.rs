//! Clouds as ROS 2 has them, and what their columns hold.

use std::borrow::Cow;

use super::*;
use crate::error::FrameError;
use crate::messages::ros::ByteOrder;

pub(crate) fn field(name: &str, offset: u32, datatype: Datatype) -> PointField {
    PointField { name: name.to_owned(), offset, datatype, count: 1 }
}

/// A cloud of one row of points of the given bytes.
pub(crate) fn cloud<'a>(
    fields: Vec<PointField>,
    point_step: u32,
    data: &'a [u8],
) -> CloudMessage<'a> {
    CloudMessage {
        stamp_sec: 1_700_000_000,
        stamp_nanosec: 5,
        frame_id: "lidar".to_owned(),
        height: 1,
        width: data.len() as u32 / point_step,
        fields,
        is_bigendian: false,
        point_step,
        row_step: data.len() as u32,
        data: Cow::Borrowed(data),
        is_dense: true,
        ..CloudMessage::default()
    }
}

pub(crate) fn xyz() -> Vec<PointField> {
    ["x", "y", "z"]
        .into_iter()
        .zip([0, 4, 8])
        .map(|(name, offset)| field(name, offset, Datatype::Float32))
        .collect()
}

fn encoded(cloud: &CloudMessage) -> Vec<u8> {
    let mut cdr = Vec::new();
    cloud.encode(&mut cdr).unwrap();
    cdr
}

fn problem(cloud: &CloudMessage) -> String {
    cloud.check().unwrap_err().to_string()
}

#[test]
fn known_bytes() {
    let data = [1.0_f32, 2.0, 3.0].map(f32::to_le_bytes).concat();
    let mut cloud = cloud(vec![field("x", 0, Datatype::Float32)], 12, &data);
    cloud.frame_id = "ab".to_owned();
    let expected = [
        [0, 1, 0, 0].as_slice(),
        &1_700_000_000_i32.to_le_bytes(),
        &[5, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0],
        &[1, 0, 0, 0, 1, 0, 0, 0], // height, width
        &[1, 0, 0, 0, 2, 0, 0, 0, b'x', 0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0],
        &[0, 0, 0, 0, 12, 0, 0, 0, 12, 0, 0, 0, 12, 0, 0, 0],
        &data,
        &[1],
    ]
    .concat();
    assert_eq!(encoded(&cloud), expected);
    assert_eq!(CloudFormat::Ros2.decode(&expected).unwrap(), cloud);
    assert_eq!(cloud.stamp_ns(), 1_700_000_000_000_000_005);
}

#[test]
fn every_datatype_in_both_orders_of_message_and_data() {
    use Datatype::*;
    let types = [Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64];
    for (message, data) in [ByteOrder::Little, ByteOrder::Big]
        .into_iter()
        .flat_map(|m| [ByteOrder::Little, ByteOrder::Big].map(|d| (m, d)))
    {
        // Unaligned on purpose: one byte in front, none between.
        let (mut fields, mut point) = (Vec::new(), vec![0xee]);
        for datatype in types {
            let offset = point.len() as u32;
            fields.push(field(&format!("{datatype:?}"), offset, datatype));
            match datatype {
                Int8 => point.extend(data.put_i8(-7)),
                UInt8 => point.extend(data.put_u8(200)),
                Int16 => point.extend(data.put_i16(-300)),
                UInt16 => point.extend(data.put_u16(60_000)),
                Int32 => point.extend(data.put_i32(-70_000)),
                UInt32 => point.extend(data.put_u32(4_000_000_000)),
                Float32 => point.extend(data.put_f32(-1.5)),
                _ => point.extend(data.put_f64(0.1)),
            }
        }
        point.push(0xee);
        let bytes = [point.as_slice(), &point].concat();
        let mut cloud = cloud(fields, point.len() as u32, &bytes);
        cloud.byte_order = message;
        cloud.is_bigendian = data == ByteOrder::Big;
        let cdr = encoded(&cloud);
        let parsed = CloudFormat::Ros2.decode(&cdr).unwrap();
        assert_eq!(parsed, cloud);
        let expected = [-7.0, 200.0, -300.0, 6e4, -7e4, 4e9, -1.5, 0.1];
        for (datatype, value) in types.into_iter().zip(expected) {
            let column = parsed.column_f64(&format!("{datatype:?}")).unwrap();
            assert_eq!(column, [value; 2]);
        }
        assert_eq!(parsed.column_u32("UInt32").unwrap(), [4_000_000_000; 2]);
        assert_eq!(parsed.column_i64("Float32").unwrap(), [-2; 2]);
    }
}

#[test]
fn coordinates_of_any_type_order_and_place() {
    let place = |x: f64, y: i16, z: f32| {
        let z = z.to_be_bytes();
        [[9].as_slice(), &z, &y.to_be_bytes(), &[9, 9, 9], &x.to_be_bytes()].concat()
    };
    let data = [place(1.25, -2, 3.5), place(-4.0, 5, 6.0)].concat();
    let fields = vec![
        field("z", 1, Datatype::Float32),
        field("y", 5, Datatype::Int16),
        field("x", 10, Datatype::Float64),
    ];
    let mut cloud = cloud(fields, 18, &data);
    cloud.is_bigendian = true;
    let points = cloud.to_cloud(None).unwrap();
    assert_eq!(points.x, [1.25, -4.0]);
    assert_eq!(points.y, [-2.0, 5.0]);
    assert_eq!(points.z, [3.5, 6.0]);
    assert_eq!((points.height, points.width), (1, 2));
}

#[test]
fn double_precision_keeps_its_millimetres_far_from_the_origin() {
    let places = [
        [500_000.123, 5_400_000.456, 300.007],
        [500_010.124, 5_400_020.457, 301.008],
        [0.0; 3],
        [f64::NAN, 5_400_000.0, 300.0],
    ];
    let data: Vec<u8> =
        places.iter().flatten().flat_map(|along: &f64| along.to_le_bytes()).collect();
    let fields = ["x", "y", "z"].into_iter().zip([0, 8, 16]);
    let fields = fields.map(|(name, at)| field(name, at, Datatype::Float64)).collect();
    let points = cloud(fields, 24, &data).to_cloud(None).unwrap();
    for (point, expected) in places.iter().enumerate().take(2) {
        let recorded = points.recorded(points.position(point).map(f64::from));
        let off = (0..3).map(|axis| (recorded[axis] - expected[axis]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-5, "{recorded:?}");
        let back = points.from_recorded(*expected);
        assert!((back[0] - f64::from(points.x[point])).abs() < 1e-5);
    }
    assert!(!points.is_return(2) && !points.is_return(3), "the origin is no return");
}

/// 2 rows of 3 points of 13 bytes, and 5 bytes behind each row.
fn padded_rows() -> Vec<u8> {
    let mut data = Vec::new();
    for row in 0..2_u8 {
        for column in 0..3_u8 {
            for value in [f32::from(row), f32::from(column), 1.0] {
                data.extend(value.to_le_bytes());
            }
            data.push(row * 3 + column);
        }
        data.extend([0xee; 5]);
    }
    data
}

#[test]
fn organised_with_padded_rows() {
    let data = padded_rows();
    let mut fields = xyz();
    fields.push(field("ring", 12, Datatype::UInt8));
    let mut cloud = cloud(fields, 13, &data);
    (cloud.height, cloud.width, cloud.row_step) = (2, 3, 44);
    let cdr = encoded(&cloud);
    let points = CloudFormat::Ros2.decode(&cdr).unwrap().to_cloud(None).unwrap();
    assert!(points.is_organised());
    assert_eq!(points.x, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(points.y, [0.0, 1.0, 2.0, 0.0, 1.0, 2.0]);
    assert_eq!(points.ring, Some(vec![0, 1, 2, 3, 4, 5]));
}

#[test]
fn packed_rows_whatever_the_row_step_says() {
    let data = vec![0; 2 * 3 * 12];
    for row_step in [0, 7, 36, 1000, u32::MAX] {
        let mut cloud = cloud(xyz(), 12, &data);
        (cloud.height, cloud.width, cloud.row_step) = (2, 3, row_step);
        let cdr = encoded(&cloud);
        let parsed = CloudFormat::Ros2.decode(&cdr).unwrap();
        assert_eq!(parsed.row_stride(), 36);
        assert_eq!(parsed.to_cloud(None).unwrap().len(), 6);
    }
}

#[test]
fn sizes_that_lie_are_told_with_their_numbers() {
    let data = padded_rows();
    let honest = CloudMessage { height: 2, width: 3, row_step: 44, ..cloud(xyz(), 13, &data) };
    assert!(honest.check().is_ok());
    let lies: [fn(&mut CloudMessage); 7] = [
        |cloud| cloud.height = 3,
        |cloud| cloud.width = 4,
        |cloud| cloud.width = u32::MAX,
        |cloud| (cloud.height, cloud.width, cloud.point_step) = (u32::MAX, u32::MAX, u32::MAX),
        |cloud| cloud.point_step = 0,
        |cloud| cloud.row_step = 38,
        |cloud| cloud.data.to_mut().truncate(1),
    ];
    for lie in lies {
        let mut cloud = honest.clone();
        lie(&mut cloud);
        let problem = problem(&cloud);
        assert!(problem.contains(&format!("{} bytes of data", cloud.data.len())), "{problem}");
        assert!(cloud.encode(&mut Vec::new()).is_err());
    }
    for offset in [2, 9, 10, u32::MAX] {
        let mut cloud = honest.clone();
        cloud.fields[2].offset = offset;
        assert_eq!(cloud.to_cloud(None).is_ok(), offset <= 9, "{offset}");
    }
}

#[test]
fn no_points_are_fine() {
    for (height, width, row_step) in [(0, 0, 0), (1, 0, 0), (0, u32::MAX, 0), (1, 0, 16)] {
        for data in [&[][..], &[0; 16][..row_step as usize]] {
            let mut cloud = cloud(Vec::new(), 16, data);
            (cloud.height, cloud.width, cloud.row_step) = (height, width, row_step);
            let cdr = encoded(&cloud);
            let points = CloudFormat::Ros2.decode(&cdr).unwrap().to_cloud(Some("label")).unwrap();
            assert!(points.is_empty());
            assert_eq!(points.class, Some(vec![]));
        }
    }
}

#[test]
fn classes_are_the_low_bits_of_words() {
    let label = |value: u32| [[0; 12].as_slice(), &value.to_le_bytes()].concat();
    let data = [label(40), label(0x0012_00fc), label(65_535)].concat();
    let mut fields = xyz();
    fields.push(field("label", 12, Datatype::UInt32));
    let mut cloud = cloud(fields, 16, &data);
    assert_eq!(cloud.semantic_field(), Some("label"));
    let points = cloud.to_cloud(Some("label")).unwrap();
    assert_eq!(points.class, Some(vec![40, 252, 65_535]));
    assert!(matches!(
        cloud.to_cloud(Some("semantic")),
        Err(FrameError::MissingField { name, present })
            if name == "semantic" && present == "x, y, z, label"
    ));
    let data = [[0; 12].as_slice(), &39.6_f32.to_le_bytes()].concat();
    (cloud.data, cloud.width) = (Cow::Borrowed(data.as_slice()), 1);
    cloud.fields[3].datatype = Datatype::Float32;
    assert_eq!(cloud.semantic_field(), None);
    assert_eq!(cloud.to_cloud(Some("label")).unwrap().class, Some(vec![40]));
}

#[test]
fn beam_numbers_that_do_not_fit_are_absent() {
    let ring = |value: i32| [[0; 12].as_slice(), &value.to_le_bytes()].concat();
    for (second, expected) in [(63, Some(vec![3, 63])), (70_000, None), (-1, None)] {
        let data = [ring(3), ring(second)].concat();
        let mut fields = xyz();
        fields.push(field("channel", 12, Datatype::Int32));
        let points = cloud(fields, 16, &data).to_cloud(None).unwrap();
        assert_eq!(points.ring, expected);
    }
}

#[test]
fn fields_of_unknown_type_are_kept_but_not_read() {
    let mut fields = xyz();
    fields.push(field("odd", 0, Datatype::Unknown(77)));
    let data = [0; 12];
    let cdr = encoded(&cloud(fields, 12, &data));
    let parsed = CloudFormat::Ros2.decode(&cdr).unwrap();
    assert_eq!(parsed.field("odd").unwrap().datatype, Datatype::Unknown(77));
    assert!(parsed.to_cloud(None).is_ok());
    assert!(matches!(parsed.column_f64("odd"), Err(FrameError::Malformed { .. })));
}

#[test]
fn cut_messages_are_errors() {
    let data = padded_rows();
    let cdr = encoded(&cloud(xyz(), 1, &data));
    for length in 0..cdr.len() {
        assert!(CloudFormat::Ros2.decode(&cdr[..length]).is_err(), "{length}");
    }
}

proptest::proptest! {
    #[test]
    fn changed_bytes_never_panic(
        changes in proptest::collection::vec((0_usize..400, proptest::num::u8::ANY), 1..6)
    ) {
        let data = padded_rows();
        let mut fields = xyz();
        fields.push(field("ring", 12, Datatype::UInt8));
        let mut cloud = cloud(fields, 13, &data);
        (cloud.height, cloud.width, cloud.row_step) = (2, 3, 44);
        let mut cdr = encoded(&cloud);
        for (at, value) in changes {
            let at = at % cdr.len();
            cdr[at] = value;
        }
        if let Ok(cloud) = CloudFormat::Ros2.decode(&cdr) {
            let _ = cloud.to_cloud(Some("ring"));
        }
    }
}
