//! Arguments about the coordinates of clouds: their unit, and which returns are looked at.

use clap::Args;

use super::values::not_negative;
use crate::cloud::{Block, Crop, Ego, LengthUnit};

/// The unit of the clouds' coordinates, and which returns are looked at.
#[derive(Args, Clone, Copy, Default)]
pub struct CoordinateArguments {
    /// Unit of the clouds' coordinates: m, cm or mm. Boxes are written in it too; options are in
    /// metres [default: m, with a warning where clouds are too large for that]
    #[arg(long, value_name = "UNIT")]
    units: Option<LengthUnit>,

    /// Leave out returns nearer to the origin of the clouds' frame, in metres
    #[arg(long, value_name = "M", value_parser = not_negative)]
    min_range: Option<f64>,

    /// Leave out returns farther from the origin of the clouds' frame, in metres
    #[arg(long, value_name = "M", value_parser = not_negative)]
    max_range: Option<f64>,

    /// Leave out returns outside a block of the clouds' frame, X0..X1,Y0..Y1,Z0..Z1 in metres; a
    /// limit may be missing, as in -50..50,-20..20,..
    #[arg(long, value_name = "BLOCK", allow_hyphen_values = true)]
    crop: Option<Block>,

    /// Leave out returns of the vehicle that carries the sensor: those inside a block of the
    /// clouds' frame, as in -2.5..2.5,-1..1,-2..0.5; or, with `auto`, those within 5 m of the
    /// sensor and above the ground that stay put while all else moves, found in 24 clouds spread
    /// over the recording (not a stream)
    #[arg(long, value_name = "BLOCK|auto", allow_hyphen_values = true)]
    ego: Option<Ego>,
}

impl CoordinateArguments {
    /// The unit, if it was given, and which returns are looked at.
    pub fn values(&self) -> (Option<LengthUnit>, Crop) {
        let CoordinateArguments { min_range, max_range, crop: region, .. } = *self;
        let ego = match self.ego {
            Some(Ego::Block(block)) => Some(block),
            Some(Ego::Auto) | None => None,
        };
        (self.units, Crop { min_range, max_range, region, ego })
    }

    /// Whether the vehicle that carries the sensor is to be found.
    pub fn finds_ego(&self) -> bool {
        self.ego == Some(Ego::Auto)
    }
}
