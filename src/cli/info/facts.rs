//! What `info` shows of a recording and its clouds.

use std::path::PathBuf;

use serde::Serialize;

use crate::annotate::{AnnotateConfig, Decoded};
use crate::cloud::up::{Axis, unusual_up};
use crate::cloud::{CloudFrames, Crop, LengthUnit, PointCloud, wide};
use crate::frames::{EgoBodies, EncodedCloud};
use crate::messages::clouds::PointField;
use crate::range_image::{Geometry, ProjectionParams, RangeImage};
use crate::semantics::GroundParams;
use crate::semantics::ground::{self, GroundPose};

/// How clouds are projected and which way is up.
#[derive(Default)]
pub struct GeometryOptions {
    pub projection: ProjectionParams,
    pub unit: Option<LengthUnit>,
    pub crop: Crop,
    pub ego: EgoBodies,
    pub frames: CloudFrames,
}

/// A recording.
#[derive(Serialize)]
pub struct Info {
    pub file: PathBuf,
    pub bytes: u64,
    pub profile: String,
    pub library: String,
    pub complete: bool,
    pub messages: u64,
    pub seconds: f64,
    pub compression: Vec<String>,
    pub attachments: u64,
    pub metadata: u64,
    pub problems: Vec<String>,
    pub topics: Vec<Topic>,
}

#[derive(Serialize)]
pub struct Topic {
    pub topic: String,
    #[serde(rename = "type")]
    pub type_name: String,
    pub encoding: String,
    pub messages: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cloud: Option<Cloud>,
}

/// The first cloud of a topic.
#[derive(Serialize)]
pub struct Cloud {
    pub note: Option<String>,
    #[serde(flatten)]
    pub facts: Option<CloudFacts>,
}

#[derive(Serialize)]
pub struct CloudFacts {
    pub frame_id: String,
    pub height: u32,
    pub width: u32,
    pub point_step: u32,
    pub fields: Vec<String>,
    /// Least and greatest x, y and z of the returns, metres, in the frame turned upright.
    pub limits: [[f64; 2]; 3],
    /// Whether the coordinates are too large to be in metres.
    pub immense: bool,
    #[serde(flatten)]
    pub geometry: Geometry,
    /// The ground, if one was found.
    pub ground: Option<GroundPose>,
    /// The `--sensor-frame` under which much more level ground lies, if there is one.
    pub upright_frame: Option<&'static str>,
    /// Roll, pitch and yaw by which the cloud was rotated, degrees; `None` if it was not.
    pub turned_degrees: Option<[f64; 3]>,
    pub auto: String,
    /// What is odd about the cloud's place, and which returns are the vehicle's own.
    pub remarks: Vec<String>,
    /// Why classes are not taken as they seem to be.
    pub auto_note: Option<String>,
}

/// Decodes and projects a cloud.
pub fn cloud_facts(encoded: &EncodedCloud, options: &GeometryOptions) -> crate::Result<CloudFacts> {
    let wire = encoded.decode()?;
    let mut method = AnnotateConfig {
        unit: options.unit,
        crop: options.crop,
        ego: options.ego.clone(),
        frames: options.frames.clone(),
        ..AnnotateConfig::default()
    };
    method.pipeline.projection = options.projection.clone();
    let decoded = method.decode(&wire, &encoded.key(&wire))?;
    let Decoded { cloud, semantics, odd_field, remarks, .. } = decoded;
    let is_immense = options.unit.is_none() && cloud.immense_extent().is_some();
    let image = RangeImage::new(&cloud, &options.projection);
    let ground = ground::pose(&cloud, &image, &GroundParams::default());
    let is_doubtful = !cloud.is_z_up && ground.is_none_or(|ground| ground.is_overhead);
    let upright_frame = is_doubtful.then(|| unusual_up(&cloud)).flatten().map(Axis::sensor_frame);
    let describe = |field: &PointField| {
        let count = if field.count == 1 { String::new() } else { format!("[{}]", field.count) };
        let datatype = format!("{:?}", field.datatype).to_lowercase();
        format!("{} {datatype}{count}", field.name)
    };
    let (roll, pitch, yaw) = cloud.turned.euler_angles();
    let is_turned = cloud.turned.angle() > 0.0;
    Ok(CloudFacts {
        frame_id: wire.frame_id.clone(),
        height: wire.height,
        width: wire.width,
        point_step: wire.point_step,
        fields: wire.fields.iter().map(describe).collect(),
        limits: limits(&cloud),
        immense: is_immense,
        geometry: Geometry::new(&cloud, &image),
        ground,
        upright_frame,
        turned_degrees: is_turned.then(|| [roll, pitch, yaw].map(f64::to_degrees)),
        auto: semantics,
        remarks: remarks.into_iter().map(|(_, problem)| problem).collect(),
        auto_note: odd_field.map(|odd| odd.describe()),
    })
}

/// Least and most of each coordinate of the returns in the recording's frame, metres.
fn limits(cloud: &PointCloud) -> [[f64; 2]; 3] {
    let mut limits = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
        let recorded = cloud.recorded_metres(wide(cloud.position(point)));
        for ([least, most], along) in limits.iter_mut().zip(recorded) {
            (*least, *most) = (least.min(along), most.max(along));
        }
    }
    limits
}
