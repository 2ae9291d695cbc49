//! `foxglove.SceneUpdate`: a cube and a text for each instance, in protocol buffers and in JSON.
//!
//! The entities of earlier frames are deleted first. Classes and numbers also stand in the
//! entities' metadata, which viewers show for what is clicked on.

use foxglove::Encode;
use foxglove::messages::{
    Color, CubePrimitive, KeyValuePair, Pose, Quaternion, SceneEntity, SceneEntityDeletion,
    SceneUpdate, TextPrimitive, Timestamp, Vector3, scene_entity_deletion,
};
use serde_json::{Value, json};

use super::object_box::{BOX_ALPHA, ObjectBox, SHORTEST_SIDE, TEXT_HEIGHT};
use crate::messages::definitions::MessageSchema;

/// Name of the type in both encodings.
const NAME: &str = "foxglove.SceneUpdate";

/// The schema for protocol buffers: a set of file descriptors.
pub(super) fn protobuf_schema() -> MessageSchema {
    MessageSchema::protobuf::<SceneUpdate>(NAME)
}

/// The schema for JSON, of what is written here alone.
pub(super) fn json_schema() -> MessageSchema {
    MessageSchema::json(NAME, include_str!("../definitions/foxglove/SceneUpdate.json"))
}

/// Writes the message in protocol buffers, replacing what is in `out`.
pub(super) fn write_protobuf(header: (i32, u32, &str), boxes: &[ObjectBox], out: &mut Vec<u8>) {
    let update = scene_update(header, boxes);
    out.clear();
    out.reserve(update.encoded_len().unwrap_or(0));
    update.encode(out).expect("memory takes any message");
}

/// Writes the message in JSON, replacing what is in `out`.
pub(super) fn write_json(header: (i32, u32, &str), boxes: &[ObjectBox], out: &mut Vec<u8>) {
    let update = scene_update(header, boxes);
    let mut update = serde_json::to_value(update).expect("numbers and text are JSON");
    // The interface has a number where the crate writes a name, and no nothings.
    let zero = json!({"sec": 0, "nsec": 0});
    for deletion in list_in(&mut update, "deletions") {
        deletion["type"] = json!(scene_entity_deletion::Type::All as i32);
        fill_null(&mut deletion["timestamp"], &zero);
    }
    for entity in list_in(&mut update, "entities") {
        fill_null(&mut entity["timestamp"], &zero);
        fill_null(&mut entity["lifetime"], &zero);
    }
    out.clear();
    serde_json::to_writer(out, &update).expect("memory takes any message");
}

fn list_in<'a>(update: &'a mut Value, key: &str) -> impl Iterator<Item = &'a mut Value> {
    update[key].as_array_mut().into_iter().flatten()
}

/// Puts a value where there is none.
fn fill_null(place: &mut Value, value: &Value) {
    if place.is_null() {
        *place = value.clone();
    }
}

fn scene_update((sec, nanosec, frame_id): (i32, u32, &str), boxes: &[ObjectBox]) -> SceneUpdate {
    // Times before 1970 do not exist in this format.
    let timestamp = Timestamp::new_checked(sec.max(0) as u32, nanosec);
    let deletion = SceneEntityDeletion {
        timestamp,
        r#type: scene_entity_deletion::Type::All as i32,
        id: String::new(),
    };
    let entities = boxes.iter().map(|boxed| SceneEntity {
        timestamp,
        frame_id: frame_id.to_owned(),
        id: boxed.id.to_string(),
        metadata: metadata(boxed).map(|(key, value)| KeyValuePair { key, value }).collect(),
        cubes: vec![cube(boxed)],
        texts: vec![text(boxed)],
        ..SceneEntity::default()
    });
    SceneUpdate { deletions: vec![deletion], entities: entities.collect() }
}

fn metadata(boxed: &ObjectBox) -> impl Iterator<Item = (String, String)> {
    let known = [
        (if boxed.is_track { "track" } else { "instance" }, boxed.id.to_string()),
        ("class", boxed.name.clone()),
        ("probability", format!("{:.3}", boxed.probability)),
        ("points", boxed.points.to_string()),
    ];
    let speed = boxed.velocity.into_iter().flat_map(|velocity| {
        [
            ("speed", format!("{:.2}", velocity.speed())),
            ("speed_error", format!("{:.2}", velocity.error)),
            ("moving", velocity.is_moving.to_string()),
        ]
    });
    known.into_iter().chain(speed).map(|(key, value)| (key.to_owned(), value))
}

fn cube(boxed: &ObjectBox) -> CubePrimitive {
    let [r, g, b] = boxed.colour().map(f64::from);
    let [x, y, z] = boxed.pose.translation.vector.into();
    let [i, j, k, w] = boxed.pose.rotation.coords.into();
    let [length, width, height] = boxed.size.map(|side| side.max(SHORTEST_SIDE));
    CubePrimitive {
        pose: Some(Pose {
            position: Some(Vector3 { x, y, z }),
            orientation: Some(Quaternion { x: i, y: j, z: k, w }),
        }),
        size: Some(Vector3 { x: length, y: width, z: height }),
        color: Some(Color { r, g, b, a: f64::from(BOX_ALPHA) }),
    }
}

fn text(boxed: &ObjectBox) -> TextPrimitive {
    let [x, y, z] = boxed.above();
    TextPrimitive {
        pose: Some(Pose {
            position: Some(Vector3 { x, y, z }),
            orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
        }),
        billboard: true,
        font_size: TEXT_HEIGHT,
        scale_invariant: false,
        color: Some(Color { r: 1.0, g: 1.0, b: 1.0, a: 1.0 }),
        text: boxed.title.clone(),
    }
}

#[cfg(test)]
mod tests {
    use foxglove::Decode;

    use super::super::tests::upright;
    use super::super::{ObjectEncoding, ObjectKind};
    use super::*;

    fn written(encoding: ObjectEncoding, header: (i32, u32, &str)) -> Vec<u8> {
        let boxes = [upright(12, [1.0, 2.0, 3.0], [4.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2)];
        let mut message = vec![1; 9];
        ObjectKind::Scene.write(encoding, header, &boxes, &mut message).unwrap();
        message
    }

    #[test]
    fn protocol_buffers_come_back() {
        let message = written(ObjectEncoding::Protobuf, (5, 6, "lidar"));
        let update = SceneUpdate::decode(message.as_slice()).unwrap();
        assert_eq!(update.deletions[0].r#type, 1);
        assert_eq!(update.deletions[0].timestamp, Some(Timestamp::new(5, 6)));
        let [entity] = update.entities.as_slice() else { panic!("one entity") };
        assert_eq!((entity.id.as_str(), entity.frame_id.as_str()), ("12", "lidar"));
        assert_eq!(entity.cubes[0].size, Some(Vector3 { x: 4.0, y: SHORTEST_SIDE, z: 1.0 }));
        let pose = entity.cubes[0].pose.unwrap();
        assert_eq!(pose.position, Some(Vector3 { x: 1.0, y: 2.0, z: 3.0 }));
        let turn = pose.orientation.unwrap();
        assert!((turn.z - turn.w).abs() < 1e-12 && (turn.z - 0.5_f64.sqrt()).abs() < 1e-12);
        assert_eq!(entity.texts[0].text, "12 car");
        assert!(entity.metadata.iter().any(|pair| pair.key == "class" && pair.value == "car"));
    }

    #[test]
    fn json_says_the_same() {
        let message = written(ObjectEncoding::Json, (5, 6, "lidar"));
        let update: Value = serde_json::from_slice(&message).unwrap();
        assert_eq!(update["deletions"][0]["type"], 1);
        let entity = &update["entities"][0];
        assert_eq!(entity["timestamp"], json!({"sec": 5, "nsec": 6}));
        assert_eq!(entity["cubes"][0]["pose"]["position"], json!({"x": 1.0, "y": 2.0, "z": 3.0}));
        assert_eq!(entity["texts"][0]["text"], "12 car");
        assert_eq!(entity["metadata"][3], json!({"key": "points", "value": "99"}));
    }

    #[test]
    fn times_that_the_format_does_not_have_are_written_all_the_same() {
        for header in [(-3, 4, "lidar"), (5, u32::MAX, "lidar")] {
            for encoding in [ObjectEncoding::Protobuf, ObjectEncoding::Json] {
                assert!(!written(encoding, header).is_empty());
            }
        }
    }
}
