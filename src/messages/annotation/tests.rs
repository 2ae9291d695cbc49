use super::super::clouds::tests::{cloud, field, xyz};
use super::*;
use crate::error::FrameError;

const ANNOTATION: PointAnnotation = PointAnnotation {
    instance: &[0, 1, 70_000, 0],
    track: None,
    component: &[0, 9, 8, 7],
    semantic: &[40, 10, 65_535, 0],
    reason: &[3, 0, 0, 6],
    ground: None,
    certainty: None,
};

/// 4 points of 13 bytes in 2 rows with 3 bytes behind each.
fn data() -> Vec<u8> {
    (0..2 * (2 * 13 + 3)).map(|i| i as u8 ^ 0x5a).collect()
}

fn input(data: &[u8]) -> CloudMessage<'_> {
    CloudMessage { height: 2, width: 2, row_step: 29, is_dense: false, ..cloud(xyz(), 13, data) }
}

#[test]
fn how_sure_classes_are_stands_behind_the_colours() {
    let data = data();
    let certainty = Certainty { confidence: &[255, 128, 0, 7], entropy: &[0, 40, 255, 9] };
    for format in [CloudFormat::Ros2, CloudFormat::FoxgloveProtobuf] {
        let input = CloudMessage { format, ..input(&data) };
        let known = PointAnnotation { certainty: Some(certainty), ..ANNOTATION };
        let decoded = |annotation| {
            let mut message = Vec::new();
            annotated_cloud(&input, annotation, &mut message).unwrap();
            message
        };
        let (with, without) = (decoded(&known), decoded(&ANNOTATION));
        let (with, without) = (format.decode(&with).unwrap(), format.decode(&without).unwrap());
        assert_eq!(with.point_step, without.point_step + 4);
        assert_eq!(with.column_u32("confidence").unwrap(), [255, 128, 0, 7]);
        assert_eq!(with.column_u32("entropy").unwrap(), [0, 40, 255, 9]);
        for (with, without) in with.points().zip(without.points()) {
            assert_eq!(with[..without.len()], *without);
            assert_eq!(with[with.len() - 2..], [0, 0]);
        }
        let short = Certainty { entropy: &[0; 3], ..certainty };
        let short = PointAnnotation { certainty: Some(short), ..ANNOTATION };
        assert!(annotated_cloud(&input, &short, &mut Vec::new()).is_err());
    }
}

#[test]
fn the_points_are_unchanged_and_the_labels_come_back() {
    let data = data();
    for (order, is_bigendian) in [
        (ByteOrder::Little, false),
        (ByteOrder::Little, true),
        (ByteOrder::Big, false),
        (ByteOrder::Big, true),
    ] {
        let input = CloudMessage { byte_order: order, is_bigendian, ..input(&data) };
        let mut cdr = Vec::new();
        annotated_cloud(&input, &ANNOTATION, &mut cdr).unwrap();
        let output = CloudFormat::Ros2.decode(&cdr).unwrap();
        assert_eq!((output.point_step, output.row_step), (33, 66));
        assert_eq!(&output.fields[..3], &input.fields[..]);
        let head = |cloud: &CloudMessage| {
            let shape = (cloud.height, cloud.width, cloud.is_bigendian, cloud.is_dense);
            (cloud.byte_order, cloud.stamp_ns(), cloud.frame_id.clone(), shape)
        };
        assert_eq!(head(&output), head(&input));
        for (before, after) in input.points().zip(output.points()) {
            assert_eq!(after[..13], *before);
            assert_eq!(after[13 + 11], 0);
        }
        let column = |name| output.column_u32(name).unwrap();
        assert_eq!(column("instance"), ANNOTATION.instance);
        assert_eq!(column("component"), ANNOTATION.component);
        assert_eq!(column("semantic"), [40, 10, 65_535, 0]);
        assert_eq!(column("reason"), [3, 0, 0, 6]);
    }
}

#[test]
fn known_bytes_of_one_point() {
    let data = data();
    let mut cdr = Vec::new();
    annotated_cloud(&input(&data), &ANNOTATION, &mut cdr).unwrap();
    let output = CloudFormat::Ros2.decode(&cdr).unwrap();
    let [red, green, blue] = instance_colour(70_000);
    let point = output.points().nth(2).unwrap();
    let expected = [
        [0x70, 0x11, 1, 0, 8, 0, 0, 0, 0xff, 0xff, 0, 0].as_slice(),
        &[blue, green, red, 0xff],
        &[0xff, blue, green, red],
    ];
    assert_eq!(point[13..], expected.concat());
    let [red, green, blue] = reason_colour(3);
    let point = output.points().next().unwrap();
    assert_eq!(point[13 + 12..][..4], [blue, green, red, 0xff]);
}

#[test]
fn ground_takes_the_padding_and_only_where_it_is_known() {
    let data = data();
    let mut cdr = Vec::new();
    let known = PointAnnotation { ground: Some(&[255, 0, 127, 3]), ..ANNOTATION };
    annotated_cloud(&input(&data), &known, &mut cdr).unwrap();
    let output = CloudFormat::Ros2.decode(&cdr).unwrap();
    assert_eq!(output.point_step, 33);
    assert_eq!(output.column_u32("ground").unwrap(), [255, 0, 127, 3]);
    assert_eq!(output.column_u32("reason").unwrap(), [3, 0, 0, 6]);
    annotated_cloud(&input(&data), &ANNOTATION, &mut cdr).unwrap();
    let output = CloudFormat::Ros2.decode(&cdr).unwrap();
    assert!(output.fields.iter().all(|field| field.name != "ground"));
    let short = PointAnnotation { ground: Some(&[0; 3]), ..ANNOTATION };
    assert!(matches!(
        annotated_cloud(&input(&data), &short, &mut Vec::new()),
        Err(FrameError::Cloud(CloudError::ColumnLength {
            column: "ground",
            expected: 4,
            found: 3
        }))
    ));
}

#[test]
fn names_that_clash_get_a_prefix() {
    let data = data();
    let mut input = input(&data);
    input.fields.push(field("rgb", 0, Datatype::Float32));
    input.fields.push(field("instance", 0, Datatype::UInt8));
    input.fields.push(field("divmerge_instance", 0, Datatype::UInt8));
    let mut cdr = Vec::new();
    annotated_cloud(&input, &ANNOTATION, &mut cdr).unwrap();
    let output = CloudFormat::Ros2.decode(&cdr).unwrap();
    let names: Vec<_> = output.fields[6..].iter().map(|f| f.name.as_str()).collect();
    assert_eq!(
        names,
        ["divmerge_divmerge_instance", "component", "semantic", "reason", "divmerge_rgb", "colors"]
    );
}

#[test]
fn the_buffer_is_allocated_once_and_reused() {
    let data = data();
    let mut cdr = Vec::new();
    annotated_cloud(&input(&data), &ANNOTATION, &mut cdr).unwrap();
    let (first, place) = (cdr.clone(), cdr.as_ptr());
    assert!(cdr.capacity() < cdr.len() + 200);
    annotated_cloud(&input(&data), &ANNOTATION, &mut cdr).unwrap();
    assert_eq!((cdr.as_ptr(), &cdr), (place, &first));
}

#[test]
fn columns_must_fit_the_cloud() {
    let data = data();
    let short = PointAnnotation { reason: &[0; 3], ..ANNOTATION };
    assert!(matches!(
        annotated_cloud(&input(&data), &short, &mut Vec::new()),
        Err(FrameError::Cloud(CloudError::ColumnLength {
            column: "reason",
            expected: 4,
            found: 3
        }))
    ));
    let mut huge = input(&[]);
    (huge.height, huge.width, huge.point_step) = (0, 1 << 20, 1 << 20);
    let nothing = PointAnnotation {
        instance: &[],
        track: None,
        component: &[],
        semantic: &[],
        reason: &[],
        ground: None,
        certainty: None,
    };
    assert!(matches!(
        annotated_cloud(&huge, &nothing, &mut Vec::new()),
        Err(FrameError::Malformed { .. })
    ));
}
