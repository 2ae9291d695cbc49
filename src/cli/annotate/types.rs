//! In which messages an annotation is written, as the command line says it.

use crate::annotate::{BoxedInstances, Flavor, MessageTypes};
use crate::messages::objects::ObjectKind;

use crate::cli::arguments::values::NamedValue;

/// One of the words of `--objects`.
#[derive(Clone, Copy)]
pub enum ObjectChoice {
    Type(ObjectKind),
    All,
}

/// Words of `--objects`.
pub const OBJECT_CHOICES: &[NamedValue<ObjectChoice>] = &[
    (
        "markers",
        "visualization_msgs/MarkerArray: what viewers draw",
        ObjectChoice::Type(ObjectKind::Markers),
    ),
    (
        "detection3d",
        "vision_msgs/Detection3DArray: boxes with classes, for programs",
        ObjectChoice::Type(ObjectKind::Detection3d),
    ),
    (
        "autoware",
        "autoware_perception_msgs/DetectedObjects: boxes with Autoware's classes (ROS 2)",
        ObjectChoice::Type(ObjectKind::Autoware),
    ),
    ("all", "Boxes of background too, in grey", ObjectChoice::All),
];

/// The types of the added messages. Of several types of boxes the last one counts, as elsewhere at
/// the command line.
pub fn message_types(flavor: Flavor, objects: &[ObjectChoice]) -> MessageTypes {
    let mut types = MessageTypes { flavor, ..MessageTypes::default() };
    for &choice in objects {
        match choice {
            ObjectChoice::Type(kind) => types.objects = Some(kind),
            ObjectChoice::All => types.boxed = BoxedInstances::All,
        }
    }
    types
}

/// Words of `--flavor`.
pub const FLAVORS: &[NamedValue<Flavor>] = &[
    ("auto", "Those of the topic's clouds", Flavor::Auto),
    ("foxglove", "foxglove.PointCloud in protobuf", Flavor::Foxglove),
];
