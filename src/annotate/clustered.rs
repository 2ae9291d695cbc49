//! The cloud in a message, clustered.

use std::time::Instant;

use nalgebra::Isometry3;

use super::config::{AnnotateConfig, Decoded};
use super::odd_field::OddField;
use crate::error::{FrameError, Result, Unsupported, frame};
use crate::frames::{CloudKey, FrameDetections, Remark};
use crate::messages::clouds::CloudMessage;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::up::unusual_up;
use divmerge_core::cloud::{PointCloud, Reason};
use divmerge_core::pipeline;
use divmerge_core::pipeline::Stages;
use divmerge_core::range_image::Evidence;
use divmerge_recording::stopwatch::ms_since;

/// A cloud out of a message, clustered.
#[derive(Debug, Clone, PartialEq)]
pub struct Clustered {
    /// The cloud.
    pub cloud: PointCloud,
    /// Every intermediate of its run.
    pub stages: Stages,
    /// Where objects came from, as in `field:label`.
    pub semantics: String,
    /// The taxonomy of the classes, if there are classes: the one that was recognised, or given.
    pub taxonomy: Option<Taxonomy>,
    /// What `auto` found wrong with the ids of a field.
    pub odd_field: Option<OddField>,
    /// What is odd about its place.
    pub remarks: Vec<Remark>,
    /// Why the source of boxes says nothing about the cloud, where that is so.
    pub missing_boxes: Option<String>,
    /// Whether a network needs remission and the message has none.
    pub lacks_remission: bool,
    /// A name that several fields of the message have, of which the first was read.
    pub repeated_field: Option<String>,
    /// Half of the returns are farther than this from their middle, metres, where that cannot be
    /// and nobody said that coordinates are in metres.
    pub immense_extent: Option<f64>,
    /// Milliseconds from message to cloud, its boxes included.
    pub decode_ms: f64,
    /// Milliseconds for classes that do not stand in the cloud itself.
    pub semantics_ms: f64,
}

/// Clusters the cloud in a message.
///
/// # Errors
/// Those of [`AnnotateConfig::decode`] and `FrameBoxes::of`.
pub fn cluster(wire: &CloudMessage, key: &CloudKey, method: &AnnotateConfig) -> Result<Clustered> {
    cluster_decoded(wire, key, method, method.decode(wire, key)?)
}

pub(super) fn cluster_decoded(
    wire: &CloudMessage,
    key: &CloudKey,
    method: &AnnotateConfig,
    decoded: Decoded,
) -> Result<Clustered> {
    refuse_moved_boxes(wire, method)?;
    let Decoded { cloud, mask, semantics, odd_field, remarks, decode_ms, semantics_ms } = decoded;
    let taxonomy = mask.taxonomy().cloned();
    let started = Instant::now();
    let FrameDetections { detections, missing: missing_boxes } = method.boxes.of(key)?;
    let decode_ms = decode_ms + ms_since(started);
    let stages = pipeline::run_with(&cloud, mask, &detections, &method.pipeline);
    let immense_extent = match method.unit {
        None => cloud.immense_extent(),
        Some(_) => None,
    };
    let repeated_field = wire.repeated_field().map(str::to_owned);
    let lacks_remission =
        method.wants_remission() && cloud.remission.is_none() && !cloud.is_empty();
    Ok(Clustered {
        cloud,
        stages,
        semantics,
        taxonomy,
        odd_field,
        remarks,
        missing_boxes,
        lacks_remission,
        repeated_field,
        immense_extent,
        decode_ms,
        semantics_ms,
    })
}

/// Boxes are in the cloud's coordinate frame; they are not taken to points that have a pose of
/// their own in it.
pub(crate) fn refuse_moved_boxes(
    wire: &CloudMessage,
    method: &AnnotateConfig,
) -> frame::Result<()> {
    if method.boxes.describe().is_none() || wire.isometry() == Isometry3::identity() {
        return Ok(());
    }
    let problem = Unsupported::BoxesOfPosedCloud;
    Err(FrameError::Unsupported { message: wire.format.type_name(), problem })
}

/// What is odd about a cloud that could be read: a word for the kind, and a sentence.
pub fn remarks(clustered: &Clustered) -> Vec<Remark> {
    let stages = &clustered.stages;
    let counts = stages.labels.counts();
    let points = stages.labels.reason.len() as u64;
    let left_out = [Reason::NoReturn, Reason::Cropped].map(|reason| counts[reason as usize]);
    let returns = points - left_out.iter().sum::<u64>();
    let shadowed = stages.image.shadowed_count() as u64;
    let mut remarks = clustered.remarks.clone();
    if points == 0 {
        remarks.push(("without points", "a cloud without points".to_owned()));
    } else if returns == 0 {
        let problem = format!(
            "none of {points} points is a return: all NaN, at the origin, filled in, or cropped"
        );
        remarks.push(("without returns", problem));
    } else if shadowed * 5 > returns * 4 {
        let problem = format!(
            "{shadowed} of {returns} returns lie behind a nearer one in the same pixel of the {} x \
             {} range image ({})",
            stages.image.rows(),
            stages.image.columns(),
            stages.image.projection.describe()
        );
        remarks.push(("with most returns shadowed", problem));
    }
    if let Some(taxonomy) = clustered.taxonomy.as_ref().filter(|_| stages.mask.unknown_ids > 0) {
        let problem = format!(
            "{} points have a class that the taxonomy `{}` does not know",
            stages.mask.unknown_ids, taxonomy.name
        );
        remarks.push(("with unknown classes", problem));
    }
    remarks.extend(clustered.odd_field.as_ref().map(|odd| (odd.kind(), odd.describe())));
    if let Some(name) = &clustered.repeated_field {
        let problem = format!("several fields are named `{name}`: the first of them is read");
        remarks.push(("with a field name that comes again", problem));
    }
    if let Some(extent) = clustered.immense_extent {
        let problem = format!(
            "half of the returns are more than {extent:.0} m apart from their middle, so that the \
             unit of the coordinates is likely millimetres (or centimetres): `--units mm` or \
             `--units cm` reads them, `--units m` says that they are metres"
        );
        remarks.push(("in another unit than metres", problem));
    }
    if clustered.lacks_remission {
        let problem = "no field `intensity`, `remission` or `reflectivity`: the network is given \
                       the mean of its training";
        remarks.push(("without remission", problem.to_owned()));
    }
    remarks.extend(viewpoint_remark(stages));
    remarks.extend(ground_remark(&clustered.cloud, stages).filter(|_| returns > 0));
    remarks.extend(clustered.missing_boxes.clone().map(|problem| ("without boxes", problem)));
    remarks
}

/// That nothing shows where the sensor stands, and what is done without it.
fn viewpoint_remark(stages: &Stages) -> Option<Remark> {
    let assumed = stages.image.bands.iter().find(|band| band.evidence == Evidence::Assumed)?;
    let [x, y, z] = assumed.sensor.translation.vector.into();
    let how = match stages.post_merge.tree {
        Some(_) => "clustered in space, without the range image".to_owned(),
        None => format!("seen from {x:.1}, {y:.1}, {z:.1} m"),
    };
    let problem = format!(
        "the frame's origin is hardly where the sensor stands, and the points do not show where it \
         does: {how}. `--sensor-origin X,Y,Z` says where it stands"
    );
    Some(("from an unknown place", problem))
}

/// That the ground is not where it should be, or missing, and what may be the reason.
fn ground_remark(cloud: &PointCloud, stages: &Stages) -> Option<Remark> {
    /// With less of the returns on the ground, another way up is looked for.
    const LEAST_GROUND: f64 = 0.1;
    let mask = &stages.mask;
    mask.ground.as_ref()?;
    let ground = stages.labels.counts()[Reason::Ground as usize];
    let has_little = (ground as f64) < LEAST_GROUND * mask.reason.len() as f64;
    if (mask.ground_is_overhead || has_little)
        && !cloud.is_z_up
        && let Some(up) = unusual_up(cloud)
    {
        let problem = format!(
            "the largest level surface lies under another axis than z: `--sensor-frame {}` turns \
             such a frame upright, `--sensor-frame none` keeps it as it is",
            up.sensor_frame()
        );
        return Some(("with another axis up", problem));
    }
    if mask.ground_is_overhead {
        let problem = "the largest level surface lies above the sensor. If that is the ground, z \
                       points down in the cloud's frame: `--sensor-frame frd` turns a frame whose \
                       y is to the right and z down, `--sensor-frame 180,0,0` a sensor that hangs \
                       upside down";
        return Some(("with the ground overhead", problem.to_owned()));
    }
    mask.ground_is_missing.then(|| {
        let problem = "no ground was found around the sensor, so that every return counts as part \
                       of an object. If there is ground: `--sensor-frame` says which way is up, \
                       `--sensor-origin` where the sensor stands";
        ("without ground", problem.to_owned())
    })
}
