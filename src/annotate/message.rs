//! One cloud message: decoded, clustered, and written as the two messages that annotate it.

use std::borrow::Cow;
use std::time::Instant;

use nalgebra::Isometry3;

use super::report::FrameTimes;
use super::types::MessageTypes;
use crate::cloud::PointCloud;
use crate::error::{Error, Result};
use crate::instances::Detection;
use crate::io::boxes::AskedCloud;
use crate::io::{
    self, Certainty, CloudFormat, CloudNumber, FrameBoxes, FrameDetections, LabelledFrame,
    PackedCloud, PointAnnotation,
};
use crate::pipeline::{self, Config, Stages};
use crate::semantics::{GroundParams, MaskSource};
use crate::sensor_frame::{SensorFrame, Transforms};
use crate::taxonomy::Taxonomy;

/// Where the object mask of a recording's clouds comes from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Semantics {
    /// A field `label`, `semantic`, `class_id` or `class_ids` if the cloud has one, else ground removal.
    #[default]
    Auto,
    /// The field of that name.
    Field(String),
    /// Ground removal.
    Ground,
    /// Every return is an object.
    All,
}

/// What is done to each cloud.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Method {
    /// Where objects come from.
    pub semantics: Semantics,
    /// What the ids of a semantic field mean.
    pub taxonomy: Taxonomy,
    /// Ground removal.
    pub ground: GroundParams,
    /// Projection and clustering.
    pub config: Config,
    /// What a detector found in each cloud, for methods that want to know. Clouds with boxes are not turned.
    pub boxes: FrameBoxes,
    /// How the frames of the clouds stand.
    pub sensor_frame: SensorFrame,
    /// What the recording says of that.
    pub transforms: Transforms,
}

/// A cloud as the method sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded<'a> {
    /// The cloud, with classes if they are asked for, turned so that z is up ([`SensorFrame`]).
    pub cloud: PointCloud,
    /// Where its object mask comes from.
    pub mask: MaskSource<'a>,
    /// The same in words, as in `field:label`.
    pub semantics: String,
}

impl Method {
    /// Where the object mask of a cloud comes from that has been decoded, with its classes if it has some.
    pub fn mask(&self, cloud: &PointCloud) -> MaskSource<'_> {
        match self.semantics {
            Semantics::All => MaskSource::All,
            Semantics::Auto | Semantics::Field(_) if cloud.class.is_some() => {
                MaskSource::Classes(&self.taxonomy)
            }
            _ => MaskSource::NotGround(&self.ground),
        }
    }

    /// What a detector found in a cloud with truth, if that is asked for.
    ///
    /// # Errors
    /// Those of [`FrameBoxes::of`].
    pub fn detections(&self, frame: &LabelledFrame) -> Result<Cow<'_, [Detection]>> {
        let which = CloudNumber { topic: &frame.source, number: frame.number };
        let asked = AskedCloud { which, stamp_ns: frame.stamp_ns, frame_id: &frame.frame_id };
        Ok(self.boxes.of(&asked)?.detections)
    }

    /// Turns a cloud as its frame stands, unless boxes in that frame are asked for.
    ///
    /// # Errors
    /// Those of [`SensorFrame::turn`].
    pub fn turn(&self, cloud: &mut PointCloud, frame_id: &str) -> Result<()> {
        if self.boxes == FrameBoxes::Nothing {
            cloud.turn(self.sensor_frame.turn(frame_id, &self.transforms)?);
        }
        Ok(())
    }

    /// The cloud in a message, upright, and where its object mask comes from.
    ///
    /// # Errors
    /// Those of [`PackedCloud::to_cloud`] and [`SensorFrame::turn`]; [`crate::Error::MissingField`] if the field that
    /// should hold the classes is not there.
    pub fn decode(&self, wire: &PackedCloud) -> Result<Decoded<'_>> {
        let field = match &self.semantics {
            Semantics::Auto => wire.semantic_field(),
            Semantics::Field(name) => Some(name.as_str()),
            Semantics::Ground | Semantics::All => None,
        };
        let mut cloud = wire.to_cloud(field)?;
        self.turn(&mut cloud, &wire.frame_id)?;
        let semantics = match (&self.semantics, field) {
            (Semantics::All, _) => "all".to_owned(),
            (_, Some(field)) => format!("field:{field}"),
            (_, None) => "ground".to_owned(),
        };
        Ok(Decoded { mask: self.mask(&cloud), cloud, semantics })
    }
}

/// One annotated cloud.
#[derive(Debug, Clone, Default)]
pub struct Annotated {
    /// The message of `T/instances`.
    pub cloud: Vec<u8>,
    /// The message of `T/objects`; empty where the format has none.
    pub objects: Vec<u8>,
    /// Coordinate frame of the cloud.
    pub frame_id: String,
    /// Stamp of the cloud's header, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Where objects came from, as in `field:label`.
    pub semantics: String,
    /// Milliseconds.
    pub times: FrameTimes,
}

/// A cloud out of a message, clustered.
#[derive(Debug, Clone, PartialEq)]
pub struct Clustered {
    /// The cloud.
    pub cloud: PointCloud,
    /// Every intermediate of its run.
    pub stages: Stages,
    /// Where objects came from, as in `field:label`.
    pub semantics: String,
    /// Why the source of boxes says nothing about the cloud, where that is so.
    pub missing_boxes: Option<String>,
    /// A name that several fields of the message have, of which the first was read.
    pub repeated_field: Option<String>,
    /// Milliseconds from message to cloud, its boxes included.
    pub decode_ms: f64,
}

/// Clusters the cloud in a message.
///
/// # Errors
/// Those of [`PackedCloud::to_cloud`]; [`crate::Error::MissingField`] if the field that should hold the classes
/// is not there; those of [`FrameBoxes::of`].
pub fn cluster(wire: &PackedCloud, which: CloudNumber, method: &Method) -> Result<Clustered> {
    let started = Instant::now();
    let Decoded { cloud, mask, semantics } = method.decode(wire)?;
    refuse_moved_boxes(wire, method)?;
    let asked = AskedCloud { which, stamp_ns: wire.stamp_ns(), frame_id: &wire.frame_id };
    let FrameDetections { detections, missing: missing_boxes } = method.boxes.of(&asked)?;
    let decode_ms = started.elapsed().as_secs_f64() * 1e3;
    let stages = pipeline::run_with(&cloud, mask, &detections, &method.config);
    let repeated_field = wire.repeated_field().map(str::to_owned);
    Ok(Clustered { cloud, stages, semantics, missing_boxes, repeated_field, decode_ms })
}

/// Boxes are in the cloud's coordinate frame; they are not taken to points that have a pose of their own in it.
fn refuse_moved_boxes(wire: &PackedCloud, method: &Method) -> Result<()> {
    if method.boxes.describe().is_none() || wire.isometry() == Isometry3::identity() {
        return Ok(());
    }
    let problem =
        "its points have a pose in their frame, to which boxes are not transformed".to_owned();
    Err(Error::Unsupported { message: wire.format.type_name(), problem })
}

/// Clusters the cloud in a message of a format and writes the messages that annotate it into `annotated`, whose memory
/// is used again.
///
/// # Errors
/// Those of [`CloudFormat::decode`], [`PackedCloud::reformatted`], [`MessageTypes::objects`] and [`cluster`].
pub fn annotate_message(
    message: &[u8],
    format: CloudFormat,
    which: CloudNumber,
    method: &Method,
    types: &MessageTypes,
    annotated: &mut Annotated,
) -> Result<Clustered> {
    let started = Instant::now();
    let wire = format.decode(message)?;
    let written = wire.reformatted(types.format(format))?;
    let parse_ms = started.elapsed().as_secs_f64() * 1e3;
    let clustered = cluster(&wire, which, method)?;

    let started = Instant::now();
    let stages = &clustered.stages;
    let reason: Vec<u8> = stages.labels.reason.iter().map(|&reason| reason as u8).collect();
    let ground = stages.mask.ground.as_deref().map(bytes);
    let cloud = &clustered.cloud;
    let certain = cloud.confidence.as_deref().zip(cloud.entropy.as_deref());
    let certain = certain.map(|(confidence, entropy)| (bytes(confidence), bytes(entropy)));
    let annotation = PointAnnotation {
        instance: &stages.labels.instance,
        component: &stages.labels.component,
        semantic: &stages.labels.semantic,
        reason: &reason,
        ground: ground.as_deref(),
        certainty: certain.as_ref().map(|(confidence, entropy)| Certainty { confidence, entropy }),
    };
    io::annotated_cloud(&written, &annotation, &mut annotated.cloud)?;
    types.write_objects(&written, &clustered, &mut annotated.objects)?;
    annotated.frame_id.clone_from(&wire.frame_id);
    annotated.stamp_ns = wire.stamp_ns();
    annotated.semantics.clone_from(&clustered.semantics);
    annotated.times = FrameTimes {
        decode_ms: parse_ms + clustered.decode_ms,
        stages: stages.times,
        encode_ms: started.elapsed().as_secs_f64() * 1e3,
    };
    Ok(clustered)
}

/// Shares of 0 to 1 as 0 to 255.
fn bytes(shares: &[f32]) -> Vec<u8> {
    shares.iter().map(|share| (share * 255.0).round() as u8).collect()
}
