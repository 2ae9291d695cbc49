//! In which messages an annotation is written.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3};
use serde::{Deserialize, Serialize};

use super::form::Form;
use crate::error::{Conflict, Error, Result, frame};
use crate::messages::clouds::{CloudFormat, CloudMessage};
use crate::messages::definitions::MessageSchema;
use crate::messages::objects::{ObjectBox, ObjectEncoding, ObjectKind};
use crate::messages::ros::{ByteOrder, Layout};
use divmerge_core::cloud::{Instance, PointCloud};
use divmerge_core::over_time::ObjectVelocity;
use divmerge_recording::Overview;

/// Types of the messages that are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct MessageTypes {
    /// Of the annotated clouds.
    pub flavor: Flavor,
    /// Of the boxes; none means what viewers draw.
    pub objects: Option<ObjectKind>,
    /// Instances that have a box.
    pub boxed: BoxedInstances,
}

/// The objects of a cloud.
#[derive(Clone, Copy)]
pub(super) struct Objects<'a> {
    pub(super) instances: &'a [Instance],
    /// Where they were followed, and their ids are those of tracks: what is known of how they move,
    /// by track, in the coordinates that the cloud was clustered in.
    pub(super) velocities: Option<&'a BTreeMap<u32, ObjectVelocity>>,
}

impl<'a> Objects<'a> {
    /// Those of a cloud whose objects were not followed.
    pub(super) fn of_cloud(instances: &'a [Instance]) -> Self {
        Objects { instances, velocities: None }
    }
}

/// From the coordinates that a cloud was clustered in to those of its message.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Placement {
    /// What was turned upright is turned back, in the message's unit.
    pub(super) frame: Isometry3<f64>,
    /// How many of the message's unit there are to a metre.
    pub(super) per_metre: f64,
}

impl Placement {
    /// That of the cloud of a message, as it was clustered.
    pub(super) fn of(message: &CloudMessage, upright: &PointCloud) -> Self {
        let offset = Translation3::from(upright.offset);
        let frame = message.isometry() * offset * upright.turned.inverse();
        Placement { frame, per_metre: upright.unit.per_metre() }
    }

    /// The same in metres.
    pub(super) fn in_metres(&self) -> Isometry3<f64> {
        let Isometry3 { translation, rotation } = self.frame;
        Isometry3::from_parts((translation.vector / self.per_metre).into(), rotation)
    }
}

/// Which instances have a box. Those with classes are all objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum BoxedInstances {
    /// Objects.
    #[default]
    Objects,
    /// Objects and background.
    All,
}

/// In which messages annotated clouds are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Flavor {
    /// Each topic's as its clouds are.
    #[default]
    Auto,
    /// Foxglove's, in protobuf.
    Foxglove,
}

impl MessageTypes {
    /// Format of the annotated clouds of a topic.
    pub fn format(&self, clouds: CloudFormat) -> CloudFormat {
        match self.flavor {
            Flavor::Auto => clouds.written(),
            Flavor::Foxglove => CloudFormat::FoxgloveProtobuf,
        }
    }

    /// The type of the boxes beside annotated clouds of a format.
    ///
    /// # Errors
    /// [`FrameError::Unsupported`](crate::error::FrameError::Unsupported) if the type of the boxes
    /// does not exist beside such clouds.
    pub fn objects(&self, clouds: CloudFormat) -> frame::Result<MessageSchema> {
        let encoding = encoding(clouds, ByteOrder::Little);
        self.object_kind(encoding).schema(encoding)
    }

    /// Writes the boxes of instances beside an annotated cloud, in its coordinate frame and
    /// unit, replacing what is in `out`.
    ///
    /// # Errors
    /// Those of [`MessageTypes::objects`].
    pub(super) fn write_objects(
        &self,
        cloud: &CloudMessage,
        objects: Objects,
        placement: &Placement,
        out: &mut Vec<u8>,
    ) -> frame::Result<()> {
        let Placement { frame, per_metre } = placement;
        let Objects { instances, velocities } = objects;
        let has_all = self.boxed == BoxedInstances::All;
        let boxed = instances.iter().filter(|instance| has_all || instance.is_object());
        let boxes = boxed.map(|instance| {
            let boxed = ObjectBox::of(instance, *per_metre, frame);
            match velocities {
                Some(velocities) => boxed.of_track(velocities.get(&instance.id), *per_metre, frame),
                None => boxed,
            }
        });
        let boxes: Vec<ObjectBox> = boxes.collect();
        let encoding = encoding(cloud.format, cloud.byte_order);
        let header = (cloud.stamp_sec as i32, cloud.stamp_nanosec, cloud.frame_id.as_str());
        self.object_kind(encoding).write(encoding, header, &boxes, out)
    }

    fn object_kind(&self, encoding: ObjectEncoding) -> ObjectKind {
        self.objects.unwrap_or(match encoding {
            ObjectEncoding::Ros(_) => ObjectKind::Markers,
            ObjectEncoding::Protobuf | ObjectEncoding::Json => ObjectKind::Scene,
        })
    }

    /// Whether a recording may have such messages beside these clouds.
    ///
    /// # Errors
    /// [`Error::Conflict`] where messages of a recording of ROS would not be ROS's,
    /// others than the clouds' own in their place, or boxes of a type that does not exist beside
    /// them.
    pub(super) fn check(
        &self,
        overview: &Overview,
        clouds: impl IntoIterator<Item = CloudFormat>,
        form: Form,
    ) -> Result<()> {
        let conflict = |problem| Err(Error::Conflict { path: overview.path.clone(), problem });
        for format in clouds {
            let written = self.format(format);
            let [clouds, written_type] = [format, written].map(CloudFormat::type_name);
            if let Err(problem) = self.objects(written) {
                let problem = Box::new(problem);
                return conflict(Conflict::NoSuchBoxes { clouds: written_type, problem });
            }
            if form == Form::InPlace && written != format {
                return conflict(Conflict::OtherFormat { clouds, written: written_type });
            }
        }
        let profile = overview.profile.as_str();
        if self.flavor == Flavor::Auto || !matches!(profile, "ros1" | "ros2") {
            return Ok(());
        }
        conflict(Conflict::Profile { profile: profile.to_owned() })
    }
}

/// How messages of boxes beside clouds of a format lie in bytes.
fn encoding(clouds: CloudFormat, order: ByteOrder) -> ObjectEncoding {
    match clouds {
        CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 | CloudFormat::LivoxRos2 => {
            ObjectEncoding::Ros(Layout::Cdr(order))
        }
        CloudFormat::Ros1 | CloudFormat::LivoxRos1 => ObjectEncoding::Ros(Layout::Ros1),
        CloudFormat::FoxgloveProtobuf => ObjectEncoding::Protobuf,
        CloudFormat::FoxgloveJson => ObjectEncoding::Json,
    }
}
