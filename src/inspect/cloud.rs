//! A cloud of the recording, read and decoded, with what stands beside it.

use std::borrow::Cow;
use std::sync::OnceLock;

use crate::annotate::{AnnotateConfig, Decoded, refuse_moved_boxes};
use crate::error::{Error, FrameError, Result};
use crate::frames::{EncodedCloud, FrameDetections, Truth, TruthSource};
use crate::view::intensity;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{Detection, PointCloud};
use divmerge_core::range_image::ProjectionParams;
use divmerge_core::semantics::{GroundParams, MaskSource};

/// Where the objects of a cloud come from.
#[derive(Debug, Clone, PartialEq)]
enum Objects {
    Classes(Box<Taxonomy>),
    NetworkClasses(Box<Taxonomy>),
    NotGround,
    All,
}

/// The parameters that decoding itself depends on: classes are believed or not by the geometry of
/// the image and the ground.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DecodedBy {
    projection: ProjectionParams,
    ground: GroundParams,
}

impl DecodedBy {
    pub fn of(config: &AnnotateConfig) -> Self {
        DecodedBy { projection: config.pipeline.projection.clone(), ground: config.ground.clone() }
    }
}

/// A cloud of N points.
#[derive(Debug)]
pub(super) struct InspectedCloud {
    /// Its message.
    pub message: EncodedCloud,
    /// The cloud as the method sees it.
    pub cloud: PointCloud,
    /// Where its objects come from, in words.
    pub semantics: String,
    /// What is odd about it.
    pub remarks: Vec<String>,
    /// Its coordinate frame.
    pub frame_id: String,
    /// N: intensity, if it has a field for it.
    pub intensity: Option<Vec<f32>>,
    /// What is true of it, if that is known.
    pub truth: Option<Truth>,
    /// What a detector found in it.
    pub detections: Vec<Detection>,
    /// What decoding depended on.
    pub decoded_by: DecodedBy,
    objects: Objects,
    /// Where the ramp of its ranges ends, once that is known.
    far: OnceLock<f64>,
}

impl InspectedCloud {
    /// Decodes a message. `truth` says where its truth is, and whether somebody said so: else a
    /// cloud without it has none.
    ///
    /// # Errors
    /// Those of [`AnnotateConfig::decode`], of the boxes and of the truth.
    pub fn decode(
        message: EncodedCloud,
        config: &AnnotateConfig,
        (truth, is_said): (&TruthSource, bool),
    ) -> Result<Self> {
        let wire = message.decode()?;
        refuse_moved_boxes(&wire, config)?;
        let key = message.key(&wire);
        let Decoded { cloud, mask, semantics, remarks, odd_field, .. } =
            config.decode(&wire, &key)?;
        let FrameDetections { detections, missing } = config.boxes.of(&key)?;
        let truth = match truth.of(&message, &wire) {
            Ok(truth) => Some(truth),
            Err(Error::Frame(FrameError::MissingField { .. })) if !is_said => None,
            Err(error) => return Err(error),
        };
        let objects = match mask {
            MaskSource::Classes(taxonomy) => Objects::Classes(Box::new(taxonomy.clone())),
            MaskSource::NetworkClasses(taxonomy, _) => {
                Objects::NetworkClasses(Box::new(taxonomy.clone()))
            }
            MaskSource::NotGround(_) | MaskSource::Marked(_) => Objects::NotGround,
            MaskSource::All => Objects::All,
        };
        let remarks = remarks.into_iter().map(|(_, problem)| problem);
        let odd = odd_field.map(|odd| odd.describe());
        Ok(InspectedCloud {
            semantics,
            remarks: remarks.chain(odd).chain(missing).collect(),
            frame_id: wire.frame_id.clone(),
            intensity: intensity(&wire),
            truth,
            detections: Cow::into_owned(detections),
            decoded_by: DecodedBy::of(config),
            objects,
            far: OnceLock::new(),
            cloud,
            message,
        })
    }

    /// Where the ramp of its ranges ends, metres, which is computed once: runs share the image.
    pub fn far(&self, far: impl FnOnce() -> f64) -> f64 {
        *self.far.get_or_init(far)
    }

    /// Where its object mask comes from.
    pub fn mask<'a>(&'a self, config: &'a AnnotateConfig) -> MaskSource<'a> {
        match &self.objects {
            Objects::Classes(taxonomy) => MaskSource::Classes(taxonomy),
            Objects::NetworkClasses(taxonomy) => {
                MaskSource::NetworkClasses(taxonomy, &config.ground)
            }
            Objects::NotGround => MaskSource::NotGround(&config.ground),
            Objects::All => MaskSource::All,
        }
    }

    /// What the ids of its classes mean, those of the truth too.
    pub fn taxonomy<'a>(&'a self, config: &'a AnnotateConfig) -> &'a Taxonomy {
        match &self.objects {
            Objects::Classes(taxonomy) | Objects::NetworkClasses(taxonomy) => taxonomy,
            Objects::NotGround | Objects::All => &config.taxonomy,
        }
    }
}
