//! Arguments about the geometry of clouds: how they become images, and which way is up.

use std::path::Path;
use std::str::FromStr;

use anyhow::{Result, anyhow};
use clap::Args;

use super::coordinates::CoordinateArguments;
use super::values::{columns, field_of_view, rows};
use crate::Error;
use crate::cloud::sensor_frame::SensorFrame;
use crate::cloud::{CloudFrames, SensorOrigin};
use crate::frames::{Assemble, EgoBodies, recorded_transforms};
use crate::pipeline::Overrides;
use crate::range_image::ProjectionParams;

/// How clouds become images, and which way is up. The defaults are found in the clouds.
#[derive(Args, Default)]
pub struct GeometryArguments {
    /// Rows of the range image, at equal elevation steps instead of a row for each beam; organised
    /// clouds keep their rows [default: one for each beam; without beams, as fine as the points]
    #[arg(long, value_name = "N", value_parser = rows)]
    rows: Option<usize>,

    /// Columns of the full circle; organised clouds keep their columns [default: one for each shot
    /// of a beam]
    #[arg(long, value_name = "N", value_parser = columns)]
    columns: Option<usize>,

    /// Elevations of the upper and lower edge of the range image in degrees, as in 3,-25, instead
    /// of those of the beams; not for organised clouds [default: those of the returns]
    #[arg(long, value_name = "UP,DOWN", value_parser = field_of_view, allow_hyphen_values = true)]
    fov: Option<(f64, f64)>,

    /// Orientation of the clouds' frame: three letters for the directions of x, y and z (of
    /// forward, back, left, right, up, down: flu is the usual one, rfu has x right and y forward,
    /// frd z down); roll,pitch,yaw of the sensor on the vehicle in degrees (180,0,0: mounted upside
    /// down); `tf` the recorded static transforms; `auto` these if recorded, rdf in a frame named
    /// `optical`, else what the points say; `none` z up. Points and boxes are written in the
    /// clouds' own frame
    #[arg(long, value_name = "FRAME", default_value = "auto", allow_hyphen_values = true)]
    sensor_frame: SensorFrame,

    /// Where the sensor stands in the frame of the clouds, or of those of a topic, in metres; once
    /// for each topic [default: the frame's origin, or where the points show the sensor]
    #[arg(long, value_name = "[TOPIC=]X,Y,Z", allow_hyphen_values = true)]
    sensor_origin: Vec<SensorOrigin>,

    /// Cluster whole turns put together of several messages of a topic: `auto` (once round, or
    /// 0.1 s where messages do not go around), so many messages (10), or seconds of the clouds'
    /// stamps (0.1, 1s). `annotate` annotates each message, and its boxes stand with the last of a
    /// turn; the other commands take a turn for one frame, which any of its messages names
    #[arg(long, value_name = "auto|N|SECONDS", value_parser = Assemble::from_str)]
    pub assemble: Option<Assemble>,

    #[command(flatten)]
    pub coordinates: CoordinateArguments,
}

impl GeometryArguments {
    /// Sets what was given.
    pub fn set(&self, projection: &mut ProjectionParams) {
        self.overriding(Overrides::default()).set_projection(projection);
    }

    /// Adds what was given about the projection to the overrides.
    pub fn overriding(&self, overrides: Overrides) -> Overrides {
        Overrides { rows: self.rows, columns: self.columns, field_of_view: self.fov, ..overrides }
    }

    /// How the frames of the clouds stand, and where sensors stand in them.
    pub fn frames(&self, recording: &Path) -> Result<CloudFrames> {
        let transforms = recorded_transforms(&self.sensor_frame, recording);
        let transforms = transforms.map_err(|error| match error {
            Error::Parameter(_) => anyhow!(
                "a stream is read once, too late for its transforms: give --sensor-frame axes or \
                 angles, or annotate a file"
            ),
            _ => anyhow::Error::from(error)
                .context(format!("{}: static transforms", recording.display())),
        })?;
        let sensor_origins = self.sensor_origin.clone();
        Ok(CloudFrames { sensor_frame: self.sensor_frame, transforms, sensor_origins })
    }

    /// The vehicles' own bodies in clouds that stand so, if they are to be found.
    pub fn ego(
        &self,
        recording: &Path,
        frames: &CloudFrames,
        projection: &ProjectionParams,
    ) -> Result<EgoBodies> {
        if !self.coordinates.finds_ego() {
            return Ok(EgoBodies::default());
        }
        let unit = self.coordinates.values().0.unwrap_or_default();
        let found = EgoBodies::find(recording, unit, frames, projection);
        found.map_err(|error| match error {
            Error::Parameter(_) => anyhow!(
                "a stream is read once, too late to find the vehicle in it: give --ego a block, or \
                 a file"
            ),
            _ => error.into(),
        })
    }
}
