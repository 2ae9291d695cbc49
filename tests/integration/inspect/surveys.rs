//! The worst of many frames, and frames of several messages.

use divmerge::annotate::AnnotateConfig;
use divmerge::frames::Assemble;
use divmerge::inspect::SessionOptions;
use serde_json::{Value, json};

use super::{Desk, options, unpacked};
use crate::parts;
use crate::recordings::drive;

#[test]
fn a_survey_lists_cases_and_a_later_one_takes_its_place() {
    let (_folder, input) = drive(4);
    let desk = Desk::of(&input);
    let begin = |frames: [u64; 2]| {
        desk.answer("api/survey", &json!({ "topic": desk.topic(), "frames": frames }))
    };
    let first = begin([0, 4])["number"].as_u64().unwrap();
    let second = begin([1, 3])["number"].as_u64().unwrap();
    assert_eq!(second, first + 1);
    let over = desk.survey();
    assert_eq!(
        (&over["done"], &over["of"], &over["problem"]),
        (&json!(2), &json!(2), &json!(null))
    );
    let cases = over["cases"].as_array().unwrap();
    assert!(!cases.is_empty() && over["is_followed"] == true);
    assert!(cases.iter().all(|case| (1..3).contains(&case["frame"].as_u64().unwrap())));
    let tracks = |more: Value| {
        let mut body = json!({ "topic": desk.topic(), "frame": 1 });
        body.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        desk.answer("api/tracks", &body)
    };
    let followed = tracks(json!({}));
    assert!(!followed.as_object().unwrap().is_empty());
    assert!(followed.as_object().unwrap().values().all(|track| track.as_u64() > Some(0)));
    assert_eq!(tracks(json!({ "setting": { "preset": "paper" } })), json!({}));
    let (status, words) =
        desk.problem("api/survey", &json!({ "topic": desk.topic(), "frames": [4, 9] }));
    assert!(status == 400 && words.contains("has 4 clouds"), "{words}");
}

#[test]
fn a_survey_that_is_stopped_keeps_what_it_found() {
    let (_folder, input) = drive(4);
    let desk = Desk::of(&input);
    desk.answer("api/survey", &json!({ "topic": desk.topic(), "frames": [0, 4] }));
    let stopped = desk.answer("api/survey-stop", &json!({}));
    assert_eq!(stopped["is_over"], true);
    // Nothing of it comes any more, and another begins as ever.
    let later = desk.answer("api/survey-state", &json!({}));
    assert_eq!(later["cases"], stopped["cases"]);
    let next = desk.answer("api/survey", &json!({ "topic": desk.topic(), "frames": [0, 1] }));
    assert!(next["number"].as_u64() > stopped["number"].as_u64());
}

#[test]
fn frames_are_the_clouds_that_messages_are_put_together_to() {
    let [_, in_parts] = parts::turns(3, 10);
    let (_folder, input) = parts::recording("sensor_msgs/msg/PointCloud2", "cdr", &in_parts);
    let config = AnnotateConfig { assemble: Some(Assemble::Auto), ..AnnotateConfig::default() };
    let desk = Desk::with(SessionOptions { config, ..options(&input) });
    let messages = |frame: u64| {
        let request = desk.frame(json!({ "frame": frame, "with_points": true }));
        let (header, _) = unpacked(&desk.asked("api/frame", Some(&request)).body, "instance");
        let heading = header["run"]["heading"].as_str().unwrap().to_owned();
        (header["cloud"]["messages"].clone(), header["cloud"]["frame"].clone(), heading)
    };
    let (first, number, heading) = messages(3);
    assert_eq!((first, number), (json!([0, 9]), json!(9)));
    assert!(heading.starts_with("frames 0 to 9"), "{heading}");
    assert_eq!(messages(10).0, json!([10, 19]));
    // A survey takes them as they are clustered, too.
    let survey = json!({ "topic": desk.topic(), "frames": [0, 20] });
    let over = desk.looked_through(&survey);
    assert_eq!((&over["done"], &over["problem"]), (&json!(20), &json!(null)));
    let frames = over["cases"].as_array().unwrap().iter().map(|case| case["frame"].as_u64());
    assert!(frames.into_iter().all(|frame| [9, 19].contains(&frame.unwrap())), "{over}");
    assert_eq!(over["is_followed"], true);
}
