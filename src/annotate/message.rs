//! One cloud message: decoded, clustered, and written as the two messages that annotate it.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;

use nalgebra::Isometry3;

use super::report::FrameTimes;
use super::types::MessageTypes;
use crate::cloud::PointCloud;
use crate::error::{Error, Result};
use crate::instances::Detection;
use crate::io::{
    self, AskedCloud, Certainty, CloudFormat, CloudNumber, FrameBoxes, FrameClasses,
    FrameDetections, LabelledFrame, PackedCloud, PointAnnotation,
};
use crate::network::Network;
use crate::pipeline::{self, Config, Stages};
use crate::semantics::{GroundParams, MaskSource};
use crate::sensor_frame::{SensorFrame, Transforms};
use crate::stopwatch::ms_since;
use crate::taxonomy::Taxonomy;

/// Where the object mask of a recording's clouds comes from.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Semantics {
    /// A field `label`, `semantic`, `class_id` or `class_ids` if the cloud has one, else ground
    /// removal.
    #[default]
    Auto,
    /// The field of that name.
    Field(String),
    /// Ground removal.
    Ground,
    /// Every return is an object.
    All,
    /// A network that classifies points.
    Network(Arc<Network>),
    /// Classes that someone else found: files, or a topic beside the clouds.
    Given(Arc<FrameClasses>),
}

impl Semantics {
    /// In a few words that name no file, as in `field:label`; of a cloud with the field that `auto`
    /// found.
    pub(super) fn describe(&self, field: Option<&str>) -> String {
        match (self, field) {
            (Semantics::All, _) => "all".to_owned(),
            (Semantics::Network(_), _) => "onnx".to_owned(),
            (Semantics::Given(given), _) => given.describe(),
            (_, Some(field)) => format!("field:{field}"),
            (Semantics::Field(field), None) => format!("field:{field}"),
            (_, None) => "ground".to_owned(),
        }
    }
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
    /// What a detector found in each cloud, for methods that want to know. Clouds with boxes are
    /// not turned.
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
    /// Milliseconds from message to cloud.
    pub decode_ms: f64,
    /// Milliseconds for classes that do not stand in the cloud itself.
    pub semantics_ms: f64,
}

impl Method {
    /// Where the object mask of a cloud comes from that has been decoded, with its classes if it
    /// has some.
    pub fn mask(&self, cloud: &PointCloud) -> MaskSource<'_> {
        match self.semantics {
            Semantics::All => MaskSource::All,
            Semantics::Ground => MaskSource::NotGround(&self.ground),
            _ if cloud.class.is_some() => MaskSource::Classes(&self.taxonomy),
            _ => MaskSource::NotGround(&self.ground),
        }
    }

    /// The topic of the recording that classes are taken from, if one is.
    pub fn class_topic(&self) -> Option<&str> {
        match &self.semantics {
            Semantics::Given(given) => given.topic(),
            _ => None,
        }
    }

    /// Whether clouds are looked at with how much light came back.
    pub fn wants_remission(&self) -> bool {
        matches!(&self.semantics, Semantics::Network(network) if network.wants_remission())
    }

    /// Gives the points of an upright cloud the classes that do not stand in the cloud itself, if
    /// such are asked for.
    ///
    /// # Errors
    /// Those of [`Network::classes`] and [`FrameClasses::of`].
    pub fn classify(&self, cloud: PointCloud, asked: &AskedCloud) -> Result<PointCloud> {
        let classes = match &self.semantics {
            Semantics::Network(network) => network.classes(&cloud, &self.config.projection)?,
            Semantics::Given(given) => given.of(asked, [cloud.height, cloud.width])?,
            _ => return Ok(cloud),
        };
        Ok(cloud.with_classes(classes)?)
    }

    /// What a detector found in a cloud with truth, if that is asked for.
    ///
    /// # Errors
    /// Those of [`FrameBoxes::of`].
    pub fn detections(&self, frame: &LabelledFrame) -> Result<Cow<'_, [Detection]>> {
        Ok(self.boxes.of(&frame.asked())?.detections)
    }

    /// Turns a cloud with truth as its frame stands, and gives it the classes that are asked for.
    ///
    /// # Errors
    /// Those of [`turn`](Self::turn) and [`classify`](Self::classify).
    pub fn prepare(&self, frame: &mut LabelledFrame) -> Result<()> {
        let mut cloud = std::mem::take(&mut frame.cloud);
        self.turn(&mut cloud, &frame.frame_id)?;
        frame.cloud = self.classify(cloud, &frame.asked())?;
        Ok(())
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
    /// Those of [`PackedCloud::to_cloud`], [`SensorFrame::turn`] and [`classify`](Self::classify);
    /// [`crate::Error::MissingField`] if the field that should hold the classes is not there.
    pub fn decode(&self, wire: &PackedCloud, which: CloudNumber) -> Result<Decoded<'_>> {
        let started = Instant::now();
        let (mut cloud, field) = self.unclassified(wire)?;
        let semantics = self.semantics.describe(field);
        let decode_ms = ms_since(started);
        let started = Instant::now();
        let is_outside = matches!(self.semantics, Semantics::Network(_) | Semantics::Given(_));
        cloud = self.classify(cloud, &asked(wire, which))?;
        let semantics_ms = if is_outside { ms_since(started) } else { 0.0 };
        Ok(Decoded { mask: self.mask(&cloud), cloud, semantics, decode_ms, semantics_ms })
    }

    /// The cloud in a message, upright, with the classes that stand in it if those are asked for,
    /// and their field.
    fn unclassified<'w>(&'w self, wire: &'w PackedCloud) -> Result<(PointCloud, Option<&'w str>)> {
        let field = match &self.semantics {
            Semantics::Auto => wire.semantic_field(),
            Semantics::Field(name) => Some(name.as_str()),
            _ => None,
        };
        let mut cloud = wire.to_cloud(field)?;
        if self.wants_remission() {
            let remission = wire.remission()?;
            cloud = cloud.with(|columns| columns.remission = remission)?;
        }
        self.turn(&mut cloud, &wire.frame_id)?;
        Ok((cloud, field))
    }
}

/// A message's cloud, as those know it who have something to say of it.
fn asked<'a>(wire: &'a PackedCloud, which: CloudNumber<'a>) -> AskedCloud<'a> {
    AskedCloud { which, stamp_ns: wire.stamp_ns(), frame_id: &wire.frame_id }
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
    /// Whether a network asked for remission, and the message has none.
    pub lacks_remission: bool,
    /// A name that several fields of the message have, of which the first was read.
    pub repeated_field: Option<String>,
    /// Milliseconds from message to cloud, its boxes included.
    pub decode_ms: f64,
    /// Milliseconds for classes that do not stand in the cloud itself.
    pub semantics_ms: f64,
}

/// Clusters the cloud in a message.
///
/// # Errors
/// Those of [`Method::decode`] and [`FrameBoxes::of`].
pub fn cluster(wire: &PackedCloud, which: CloudNumber, method: &Method) -> Result<Clustered> {
    cluster_decoded(wire, which, method, method.decode(wire, which)?)
}

fn cluster_decoded(
    wire: &PackedCloud,
    which: CloudNumber,
    method: &Method,
    decoded: Decoded,
) -> Result<Clustered> {
    refuse_moved_boxes(wire, method)?;
    let Decoded { cloud, mask, semantics, decode_ms, semantics_ms } = decoded;
    let started = Instant::now();
    let FrameDetections { detections, missing: missing_boxes } =
        method.boxes.of(&asked(wire, which))?;
    let decode_ms = decode_ms + ms_since(started);
    let stages = pipeline::run_with(&cloud, mask, &detections, &method.config);
    let repeated_field = wire.repeated_field().map(str::to_owned);
    let lacks_remission =
        method.wants_remission() && cloud.remission.is_none() && !cloud.is_empty();
    Ok(Clustered {
        cloud,
        stages,
        semantics,
        missing_boxes,
        lacks_remission,
        repeated_field,
        decode_ms,
        semantics_ms,
    })
}

/// Boxes are in the cloud's coordinate frame; they are not taken to points that have a pose of
/// their own in it.
fn refuse_moved_boxes(wire: &PackedCloud, method: &Method) -> Result<()> {
    if method.boxes.describe().is_none() || wire.isometry() == Isometry3::identity() {
        return Ok(());
    }
    let problem =
        "its points have a pose in their frame, to which boxes are not transformed".to_owned();
    Err(Error::Unsupported { message: wire.format.type_name(), problem })
}

/// Clusters the cloud in a message of a format and writes the messages that annotate it into
/// `annotated`, whose memory is used again.
///
/// # Errors
/// Those of [`CloudFormat::decode`], [`PackedCloud::reformatted`], [`MessageTypes::objects`] and
/// [`cluster`].
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
    let parse_ms = ms_since(started);
    let decoded = method.decode(&wire, which)?;
    let decoded = Decoded { decode_ms: parse_ms + decoded.decode_ms, ..decoded };
    annotate_decoded(&wire, which, method, types, decoded, annotated)
}

/// A message of several that are annotated together.
pub(super) struct OneOfSeveral<'a> {
    pub message: &'a [u8],
    pub format: CloudFormat,
    pub which: CloudNumber<'a>,
}

/// Annotates several messages whose clouds go through a network together; each has a result of its
/// own.
///
/// # Errors
/// Those of [`Network::classes_of`], which concern all of them.
pub(super) fn annotate_messages(
    messages: &[OneOfSeveral],
    network: &Network,
    method: &Method,
    types: &MessageTypes,
) -> Result<Vec<Result<(Clustered, Annotated)>>> {
    let started = Instant::now();
    let opened = messages.iter().map(|one| {
        let wire = one.format.decode(one.message)?;
        let (cloud, _) = method.unclassified(&wire)?;
        Ok((wire, cloud))
    });
    let opened: Vec<Result<(PackedCloud, PointCloud)>> = opened.collect();
    let decode_ms = ms_since(started) / messages.len() as f64;

    let started = Instant::now();
    let readable: Vec<&PointCloud> = opened.iter().flatten().map(|(_, cloud)| cloud).collect();
    let mut classes = network.classes_of(&readable, &method.config.projection)?.into_iter();
    let semantics_ms = ms_since(started) / messages.len() as f64;

    let annotate = |(one, opened): (&OneOfSeveral<'_>, Result<(PackedCloud, PointCloud)>)| {
        let (wire, cloud) = opened?;
        let cloud = cloud.with_classes(classes.next().unwrap_or_default())?;
        let mut annotated = Annotated::default();
        let semantics = method.semantics.describe(None);
        let decoded =
            Decoded { mask: method.mask(&cloud), cloud, semantics, decode_ms, semantics_ms };
        let clustered = annotate_decoded(&wire, one.which, method, types, decoded, &mut annotated)?;
        Ok((clustered, annotated))
    };
    Ok(messages.iter().zip(opened).map(annotate).collect())
}

fn annotate_decoded(
    wire: &PackedCloud,
    which: CloudNumber,
    method: &Method,
    types: &MessageTypes,
    decoded: Decoded,
    annotated: &mut Annotated,
) -> Result<Clustered> {
    let started = Instant::now();
    let written = wire.reformatted(types.format(wire.format))?;
    let reformat_ms = ms_since(started);
    let clustered = cluster_decoded(wire, which, method, decoded)?;

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
        decode_ms: clustered.decode_ms,
        semantics_ms: clustered.semantics_ms,
        stages: stages.times,
        encode_ms: reformat_ms + ms_since(started),
    };
    Ok(clustered)
}

/// Shares of 0 to 1 as 0 to 255.
fn bytes(shares: &[f32]) -> Vec<u8> {
    shares.iter().map(|share| (share * 255.0).round() as u8).collect()
}
