//! Another flavor than the cloud's, and recordings of several formats.

use std::borrow::Cow;

use divmerge::annotate::Flavor;
use divmerge::messages::clouds::{CloudFormat, CloudMessage, Datatype, PointField};
use divmerge::recording::Overview;

use super::{channel, encoded, labels, messages, recording, run, simulated, with};
use crate::recordings::assert_passed_through;

#[test]
fn the_flavor_foxglove_is_for_recordings_without_ros() {
    let clouds = vec![simulated(CloudFormat::Ros2, 0)];
    let (_folder, input) = recording("", &[("/points", CloudFormat::Ros2, clouds.clone())]);
    let (output, report) = run(&input, &with(Flavor::Foxglove)).expect("annotated");
    assert!(report.is_complete(), "{:?}", report.warnings);
    assert_passed_through(&input, &output);
    let overview = Overview::read(&output).expect("a recording");
    let instances = channel(&overview, "/points/instances");
    let schema = overview.schema_of(instances.id).expect("a schema");
    assert_eq!(schema.name, "foxglove.PointCloud");
    assert_eq!(
        (schema.encoding.as_str(), instances.message_encoding.as_str()),
        ("protobuf", "protobuf")
    );
    assert!(!schema.data.is_empty() && instances.metadata.is_empty());
    let (cloud, annotated) = (messages(&output, "/points"), messages(&output, "/points/instances"));
    let (cloud, annotated) =
        (cloud[0].decode().expect("a cloud"), annotated[0].decode().expect("one"));
    assert_eq!(annotated.format, CloudFormat::FoxgloveProtobuf);
    assert!(cloud.points().zip(annotated.points()).all(|(from, to)| to.starts_with(from)));
    let (plain, _) = run(&input, &with(Flavor::Auto)).expect("annotated");
    let plain = messages(&plain, "/points/instances");
    assert_eq!(labels(&plain[0].decode().expect("a cloud")), labels(&annotated));

    for profile in ["ros1", "ros2"] {
        let topics = [("/points", CloudFormat::Ros2, clouds.clone())];
        let (_folder, input) = recording(profile, &topics);
        let error = run(&input, &with(Flavor::Foxglove)).expect_err("refused").to_string();
        assert!(error.contains(&format!("`{profile}`")) && error.contains("made.mcap"), "{error}");
        assert!(!input.with_extension("annotated.mcap").exists());
    }
}

#[test]
fn what_foxglove_cannot_say_is_passed_through_and_named() {
    let data = 1.0_f32.to_be_bytes().repeat(3);
    let fields = ["x", "y", "z"].into_iter().zip([0, 4, 8]).map(|(name, offset)| PointField {
        name: name.into(),
        offset,
        datatype: Datatype::Float32,
        count: 1,
    });
    let cloud = CloudMessage {
        width: 1,
        fields: fields.collect(),
        is_bigendian: true,
        point_step: 12,
        row_step: 12,
        data: Cow::Borrowed(&data),
        ..CloudMessage::default()
    };
    let topics = [("/points", CloudFormat::Ros2, vec![encoded(&cloud)])];
    let (_folder, input) = recording("", &topics);
    let (output, report) = run(&input, &with(Flavor::Foxglove)).expect("passed through");
    assert_eq!(report.topics["/points"].unreadable, 1);
    assert!(report.warnings[0].contains("big endian"), "{:?}", report.warnings);
    assert_passed_through(&input, &output);
    let (_, report) = run(&input, &with(Flavor::Auto)).expect("annotated");
    assert!(report.is_complete(), "{:?}", report.warnings);
}

#[test]
fn a_topic_may_change_its_fields_and_topics_may_differ_in_format() {
    let formats = CloudFormat::ALL.into_iter().enumerate();
    let names: Vec<String> = formats.clone().map(|(n, _)| format!("/lidar_{n}")).collect();
    let topics: Vec<_> = formats
        .map(|(number, format)| {
            let first = simulated(format, 0);
            let mut cloud = format.decode(&first).expect("a cloud");
            // Without ring, label and truth, in reverse, and with a name that comes again.
            cloud.fields.truncate(3);
            cloud.fields.reverse();
            let other = encoded(&cloud);
            cloud.fields.push(cloud.fields[0].clone());
            (names[number].as_str(), format, vec![first.clone(), other, encoded(&cloud), first])
        })
        .collect();
    let (_folder, input) = recording("", &topics);
    let (output, report) = run(&input, &with(Flavor::Auto)).expect("annotated");
    assert!(report.is_complete(), "{:?}", report.warnings);
    assert_passed_through(&input, &output);
    assert_eq!(report.warnings.len(), CloudFormat::ALL.len(), "{:?}", report.warnings);
    assert!(report.warnings.iter().all(|warning| warning.contains("several fields are named `z`")));
    for name in &names {
        assert_eq!(report.topics[name].frames, 4);
        let annotated = messages(&output, &format!("{name}/instances"));
        let fields = |at: usize| {
            let cloud = annotated[at].decode().expect("a cloud");
            cloud.fields.iter().take_while(|f| f.name != "instance").count()
        };
        assert_eq!([0, 1, 2, 3].map(fields), [8, 3, 4, 8]);
    }
}

#[test]
fn channels_of_one_topic_in_two_formats() {
    let (ros, json) = (CloudFormat::Ros2, CloudFormat::FoxgloveJson);
    let topics = [
        ("/points", ros, vec![simulated(ros, 0), simulated(ros, 1)]),
        ("/points", json, vec![simulated(json, 0)]),
    ];
    let (_folder, input) = recording("", &topics);
    let (output, report) = run(&input, &with(Flavor::Auto)).expect("annotated");
    assert!(report.is_complete(), "{:?}", report.warnings);
    assert_eq!(report.topics["/points"].frames, 3);
    let annotated = messages(&output, "/points/instances");
    assert_eq!(
        annotated.iter().map(|message| message.format).collect::<Vec<_>>(),
        [ros, json, ros]
    );
    let labels: Vec<_> =
        annotated.iter().map(|message| labels(&message.decode().expect("a cloud"))).collect();
    assert!(labels[0] == labels[1] && labels[0] != labels[2]);
}
