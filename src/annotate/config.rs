//! What is done to each cloud of a recording.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use super::odd_field::OddField;
use crate::error::{Conflict, Error, Result, frame};
use crate::frames::{
    Assemble, CloudKey, EgoBodies, FrameBoxes, FrameClasses, LabelledFrame, Remark, SeenClasses,
};
use crate::messages::clouds::CloudMessage;
use crate::network::Network;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{CloudFrames, Crop, Detection, LengthUnit, PointCloud};
use divmerge_core::parameters::ParameterSet;
use divmerge_core::pipeline::Config;
use divmerge_core::semantics::evidence::{self, Belief};
use divmerge_core::semantics::{GroundParams, MaskSource};
use divmerge_recording::stopwatch::ms_since;

/// The field that converters and simulators keep the truth in. Classes of another field that is
/// named are a network's.
const TRUE_FIELD: &str = "label";

/// Where the object mask of a recording's clouds comes from.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Semantics {
    /// A field `label`, `semantic`, `class_id` or `class_ids` if the cloud has one whose ids are
    /// believed ([`evidence`](divmerge_core::semantics::evidence)), else ground removal.
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
    /// believes.
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
pub struct AnnotateConfig {
    /// Where objects come from.
    pub semantics: Semantics,
    /// What the ids of a semantic field mean.
    pub taxonomy: Taxonomy,
    /// Whether somebody said so. Else [`Semantics::Auto`] takes `taxonomy` for a guess, which the
    /// geometry of a cloud may disprove, and looks for a known one that agrees.
    pub is_taxonomy_given: bool,
    /// Ground removal.
    pub ground: GroundParams,
    /// Projection and clustering.
    pub pipeline: Config,
    /// What a detector found in each cloud, for methods that want to know. Clouds with boxes are
    /// not turned.
    pub boxes: FrameBoxes,
    /// How messages of a topic are put together to whole turns before they are clustered. Each is
    /// annotated by itself; the boxes stand with the last of a turn. Default: not at all.
    pub assemble: Option<Assemble>,
    /// The unit of the clouds' coordinates, if somebody said so. Else metres are assumed, and
    /// clouds that look otherwise are remarked on.
    pub unit: Option<LengthUnit>,
    /// Which returns are looked at, by their place in the clouds' own frame.
    pub crop: Crop,
    /// The bodies of the vehicles that carry the sensors, where those were looked for.
    pub ego: EgoBodies,
    /// How the frames of the clouds stand, and where sensors stand in them.
    pub frames: CloudFrames,
}

/// A cloud as the method sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded<'a> {
    /// The cloud, with its classes if the semantics have some, rotated so that z is up
    /// ([`CloudFrames`]).
    pub cloud: PointCloud,
    /// Where its object mask comes from.
    pub mask: MaskSource<'a>,
    /// The same in words, as in `field:label`.
    pub semantics: String,
    /// What `auto` found wrong with the ids of a field.
    pub odd_field: Option<OddField>,
    /// What is odd about its place: a word for the kind, and a sentence.
    pub remarks: Vec<Remark>,
    /// Milliseconds from message to cloud.
    pub decode_ms: f64,
    /// Milliseconds for classes that do not stand in the cloud itself.
    pub semantics_ms: f64,
}

impl AnnotateConfig {
    /// Where the object mask of a cloud comes from that has been decoded, with its classes if it
    /// has some.
    pub fn mask(&self, cloud: &PointCloud) -> MaskSource<'_> {
        match (&self.semantics, &cloud.class) {
            (Semantics::All, _) => MaskSource::All,
            (Semantics::Ground, _) | (_, None) => MaskSource::NotGround(&self.ground),
            (Semantics::Auto, Some(_)) => match self.belief(cloud) {
                Belief::Classes(taxonomy) => MaskSource::Classes(taxonomy),
                Belief::Doubt(_) => MaskSource::NotGround(&self.ground),
            },
            (Semantics::Field(name), _) if name == TRUE_FIELD => {
                MaskSource::Classes(&self.taxonomy)
            }
            (Semantics::Network(_) | Semantics::Given(_) | Semantics::Field(_), _) => {
                MaskSource::NetworkClasses(&self.taxonomy, &self.ground)
            }
        }
    }

    /// What `auto` believes of the classes in an upright cloud.
    fn belief(&self, cloud: &PointCloud) -> Belief<'_> {
        match self.is_taxonomy_given {
            true => evidence::judge_ids(cloud, &self.taxonomy),
            false => {
                evidence::judge(cloud, &self.taxonomy, &self.pipeline.projection, &self.ground)
            }
        }
    }

    /// Refuses what belongs to single messages where messages are put together.
    ///
    /// # Errors
    /// [`Error::Conflict`].
    pub fn refuse_with_turns(&self, input: &Path) -> Result<()> {
        let with = match self {
            _ if self.assemble.is_none() => return Ok(()),
            _ if self.boxes != FrameBoxes::Nothing => "boxes of each message",
            _ if !self.ego.is_empty() => "a vehicle that is looked for in each message",
            _ if matches!(self.semantics, Semantics::Given(_)) => "classes of each message",
            _ => return Ok(()),
        };
        Err(Error::Conflict { path: input.to_owned(), problem: Conflict::Turns { with } })
    }

    /// The parameters of the method; those over time are the usual ones.
    pub fn parameters(&self) -> ParameterSet {
        ParameterSet::of(&self.pipeline, &self.ground)
    }

    /// The same with the parameters of a set, as far as they are about single clouds.
    pub fn with_parameters(self, parameters: &ParameterSet) -> Self {
        let (pipeline, ground) = (parameters.config(), parameters.ground.clone());
        AnnotateConfig { pipeline, ground, ..self }
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
    pub fn classify(&self, cloud: PointCloud, key: &CloudKey) -> Result<PointCloud> {
        let classes = match &self.semantics {
            Semantics::Network(network) => network.classes(&cloud, &self.pipeline.projection)?,
            Semantics::Given(given) => given.of(key, [cloud.height, cloud.width])?,
            _ => return Ok(cloud),
        };
        Ok(cloud.with_classes(classes)?)
    }

    /// What a detector found in a cloud with truth, if there are boxes.
    ///
    /// # Errors
    /// Those of [`FrameBoxes::of`].
    pub fn detections(&self, frame: &LabelledFrame) -> Result<Cow<'_, [Detection]>> {
        Ok(self.boxes.of(&frame.key())?.detections)
    }

    /// Which of the classes that stand beside a truth the method gets to see.
    pub fn seen_classes(&self) -> SeenClasses {
        match &self.semantics {
            Semantics::Auto => SeenClasses::Auto,
            Semantics::Field(name) => SeenClasses::Field(name.clone()),
            _ => SeenClasses::Nothing,
        }
    }

    /// Brings a cloud with truth into the form that the method sees, and gives it the classes of
    /// the semantics.
    ///
    /// # Errors
    /// Those of [`upright`](Self::upright) and [`classify`](Self::classify).
    pub fn prepare(&self, frame: &mut LabelledFrame) -> Result<()> {
        let mut cloud = std::mem::take(&mut frame.cloud);
        cloud = self.upright(cloud, &frame.key())?.0;
        frame.cloud = self.classify(cloud, &frame.key())?;
        Ok(())
    }

    /// A recorded cloud in metres, cropped, and upright unless there are boxes in its frame; with
    /// what is odd about its place.
    ///
    /// # Errors
    /// Those of [`CloudFrames::place`].
    pub fn upright(
        &self,
        cloud: PointCloud,
        key: &CloudKey,
    ) -> frame::Result<(PointCloud, Vec<Remark>)> {
        let cloud = cloud.from_unit(self.unit.unwrap_or_default()).cropped(&self.crop);
        let (mut cloud, remark) = self.ego.leave_out(cloud, key.topic);
        let mut remarks = Vec::from_iter(remark);
        if self.boxes == FrameBoxes::Nothing {
            let CloudKey { topic, frame_id, stamp_ns, .. } = *key;
            self.frames.place(&mut cloud, topic, (frame_id, stamp_ns))?;
            remarks.extend(self.missing_transform(key));
        }
        Ok((cloud, remarks))
    }

    /// That the place of the sensor is recorded, but not for the time of a cloud.
    fn missing_transform(&self, key: &CloudKey) -> Option<Remark> {
        let CloudFrames { transforms, .. } = &self.frames;
        let is_said = self.frames.sensor_origin(key.topic).is_some();
        let is_missing = !is_said && transforms.is_missing_at(key.frame_id, key.stamp_ns);
        is_missing.then(|| {
            let problem = format!(
                "no transforms of /tf lead from `{}` to a sensor at the time of the cloud, so that \
                 they say nothing of where the sensor stands",
                key.frame_id
            );
            ("at a time without transforms", problem)
        })
    }

    /// The cloud in a message, upright, and where its object mask comes from.
    ///
    /// # Errors
    /// Those of [`CloudMessage::to_cloud`], [`CloudFrames::place`] and
    /// [`classify`](Self::classify);
    /// [`FrameError::MissingField`](crate::error::FrameError::MissingField) if the field that
    /// should hold the classes is not there.
    pub fn decode(&self, wire: &CloudMessage, key: &CloudKey) -> Result<Decoded<'_>> {
        let started = Instant::now();
        let (cloud, field, remarks) = self.unclassified(wire, key)?;
        let decode_ms = ms_since(started);
        let started = Instant::now();
        let (cloud, mask, odd_field) = match (&self.semantics, field) {
            (Semantics::Auto, Some(field)) => self.believed(cloud, field)?,
            _ => {
                let cloud = self.classify(cloud, key)?;
                let mask = self.mask(&cloud);
                (cloud, mask, None)
            }
        };
        let believed = field.filter(|_| odd_field.as_ref().is_none_or(|odd| odd.doubt.is_none()));
        let semantics = self.semantics.describe(believed);
        let semantics_ms = ms_since(started);
        Ok(Decoded { cloud, mask, semantics, odd_field, remarks, decode_ms, semantics_ms })
    }

    /// The cloud with the classes of a field if `auto` believes them, else without.
    fn believed(
        &self,
        cloud: PointCloud,
        field: &str,
    ) -> Result<(PointCloud, MaskSource<'_>, Option<OddField>)> {
        let odd = |doubt, taxonomy: &Taxonomy| OddField {
            name: field.to_owned(),
            doubt,
            taxonomy: taxonomy.name.clone(),
        };
        Ok(match self.belief(&cloud) {
            Belief::Classes(taxonomy) => {
                let is_other = taxonomy.name != self.taxonomy.name;
                let odd = is_other.then(|| odd(None, taxonomy));
                (cloud, MaskSource::Classes(taxonomy), odd)
            }
            Belief::Doubt(doubt) => {
                let cloud =
                    cloud.with(|columns| (columns.class, columns.confidence) = (None, None))?;
                (cloud, MaskSource::NotGround(&self.ground), Some(odd(Some(doubt), &self.taxonomy)))
            }
        })
    }

    /// The cloud in a message, upright, with the classes that stand in it if those are asked for;
    /// their field; and what is odd about its place.
    pub(super) fn unclassified<'w>(
        &'w self,
        wire: &'w CloudMessage,
        key: &CloudKey,
    ) -> frame::Result<(PointCloud, Option<&'w str>, Vec<Remark>)> {
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
        let (cloud, remarks) = self.upright(cloud, key)?;
        Ok((cloud, field, remarks))
    }
}
