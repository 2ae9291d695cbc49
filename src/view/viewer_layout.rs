//! A layout for Lichtblick and Foxglove that shows an annotated recording in colour at once.
//! Without it, those viewers hide clouds and boxes until somebody switches them on.

use serde_json::{Map, Value, json};

/// One annotated cloud topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShownTopic {
    /// The cloud topic, which is hidden.
    pub cloud: String,
    /// The annotated clouds.
    pub instances: String,
    /// The boxes.
    pub objects: String,
    /// Whether the annotated clouds have their colours in one field `rgb` (ROS) and not in four.
    pub has_packed_colours: bool,
    /// Coordinate frame of the clouds.
    pub frame_id: String,
}

/// The layout as JSON: a 3D panel that follows the first topic's coordinate frame, with the clouds
/// coloured by instance and their boxes, beside a panel with the messages of the boxes.
pub fn viewer_layout(topics: &[ShownTopic]) -> String {
    let layout = json!({
        "configById": {SCENE: scene(topics), MESSAGES: messages(topics)},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"direction": "row", "first": SCENE, "second": MESSAGES, "splitPercentage": 75},
    });
    format!("{layout:#}\n")
}

/// Ids of the panels: the kind, then a name.
const SCENE: &str = "3D!divmerge";
const MESSAGES: &str = "RawMessages!divmerge";

fn scene(topics: &[ShownTopic]) -> Value {
    let mut shown = Map::new();
    for topic in topics {
        let mut cloud = json!({
            "visible": true, "pointSize": 3, "explicitAlpha": 1, "colorMode": "rgba-fields",
        });
        if topic.has_packed_colours {
            cloud["colorMode"] = "rgb".into();
            cloud["colorField"] = "rgb".into();
        }
        // A cloud that is annotated in place is one topic; the second insertion shows it.
        shown.insert(topic.cloud.clone(), json!({"visible": false}));
        shown.insert(topic.instances.clone(), cloud);
        shown.insert(topic.objects.clone(), json!({"visible": true}));
    }
    json!({
        "cameraState": {
            "perspective": true, "distance": 60, "phi": 50, "thetaOffset": 90,
            "target": [0, 0, 0], "targetOffset": [0, 0, 0], "targetOrientation": [0, 0, 0, 1],
            "fovy": 45, "near": 0.5, "far": 5000,
        },
        "followMode": "follow-pose",
        "followTf": topics.first().map(|topic| topic.frame_id.as_str()),
        "scene": {},
        "transforms": {},
        "topics": shown,
        "layers": {"grid": {
            "visible": true, "layerId": "foxglove.Grid", "instanceId": "grid", "label": "Grid",
            "size": 100, "divisions": 10, "lineWidth": 1, "color": "#80808080",
            "position": [0, 0, 0], "rotation": [0, 0, 0], "order": 1,
        }},
        "imageMode": {},
    })
}

fn messages(topics: &[ShownTopic]) -> Value {
    let path = topics.first().map_or("", |topic| topic.objects.as_str());
    json!({
        "topicPath": path,
        "diffEnabled": false,
        "diffMethod": "custom",
        "showFullMessageForDiff": false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(cloud: &str, has_packed_colours: bool) -> ShownTopic {
        ShownTopic {
            cloud: cloud.to_owned(),
            instances: format!("{cloud}/instances"),
            objects: format!("{cloud}/objects"),
            has_packed_colours,
            frame_id: "lidar".to_owned(),
        }
    }

    #[test]
    fn clouds_are_coloured_and_boxes_shown() {
        let text = viewer_layout(&[topic("/a", true), topic("/b", false)]);
        let layout: Value = serde_json::from_str(&text).unwrap();
        let scene = &layout["configById"][layout["layout"]["first"].as_str().unwrap()];
        assert_eq!(scene["followTf"], "lidar");
        assert_eq!(scene["topics"]["/a"]["visible"], false);
        assert_eq!(scene["topics"]["/a/instances"]["colorField"], "rgb");
        assert_eq!(scene["topics"]["/b/instances"]["colorMode"], "rgba-fields");
        assert_eq!(scene["topics"]["/b/objects"]["visible"], true);
    }

    #[test]
    fn a_cloud_annotated_in_place_is_shown() {
        let in_place = ShownTopic { instances: "/a".to_owned(), ..topic("/a", true) };
        let layout: Value = serde_json::from_str(&viewer_layout(&[in_place])).unwrap();
        assert_eq!(layout["configById"][SCENE]["topics"]["/a"]["visible"], true);
    }
}
