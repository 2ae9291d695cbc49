//! Arguments about the geometry of clouds: how they become images, and which way is up.

use std::path::Path;

use anyhow::{Result, anyhow};
use clap::Args;
use divmerge::Error;
use divmerge::io::asked_transforms;
use divmerge::pipeline::Overrides;
use divmerge::pipeline::overrides::limits;
use divmerge::range_image::ProjectionParams;
use divmerge::sensor_frame::{SensorFrame, Transforms};

use crate::arguments::{at_least_one, number};

/// What clouds look like from their sensor. Nothing needs to be said: `divmerge info` tells what is found.
#[derive(Args, Default)]
pub struct GeometryArguments {
    /// Rows of equal elevation in the range image, in place of the beams that are found; organised clouds stay as
    /// they stand [default: the beams; without any, as fine as the points lie]
    #[arg(long, value_name = "N", value_parser = rows)]
    rows: Option<usize>,

    /// Columns of the full circle, for clouds that are not organised [default: a column for each shot of a beam]
    #[arg(long, value_name = "N", value_parser = columns)]
    columns: Option<usize>,

    /// Elevation of the upper and the lower edge of the range image in degrees, as in 3,-25; in place of the beams
    /// that are found, for clouds that are not organised [default: that of the returns]
    #[arg(long, value_name = "UP,DOWN", value_parser = field_of_view, allow_hyphen_values = true)]
    fov: Option<(f64, f64)>,

    /// How the clouds' frame stands: three letters that say where x, y and z look (of forward, back, left, right,
    /// up, down: flu is the usual one, rfu has x to the right and y ahead, frd z down); roll,pitch,yaw of the
    /// sensor on the vehicle in degrees (180,0,0 hangs upside down); `tf` as the recorded static transforms have
    /// it; `auto` the same where they are there, else z up; `none` z up. Clouds are written as they came, boxes
    /// in the clouds' own frame
    #[arg(long, value_name = "FRAME", default_value = "auto", allow_hyphen_values = true)]
    sensor_frame: SensorFrame,
}

impl GeometryArguments {
    /// Sets what is asked for.
    pub fn set(&self, projection: &mut ProjectionParams) {
        self.overriding(Overrides::default()).set_projection(projection);
    }

    /// Overrides with what is asked for of the projection.
    pub fn overriding(&self, overrides: Overrides) -> Overrides {
        Overrides { rows: self.rows, columns: self.columns, field_of_view: self.fov, ..overrides }
    }

    /// How the frames of a recording's clouds stand, and what the recording says of that, as far as it is asked.
    pub fn frame(&self, recording: &Path) -> Result<(SensorFrame, Transforms)> {
        let transforms = asked_transforms(&self.sensor_frame, recording);
        let transforms = transforms.map_err(|error| match error {
            Error::Parameter { .. } => anyhow!(
                "the transforms of a stream cannot be had: --sensor-frame needs axes or angles, or a file"
            ),
            _ => anyhow::Error::from(error)
                .context(format!("{}: static transforms", recording.display())),
        })?;
        Ok((self.sensor_frame, transforms))
    }

    /// The same arguments as words of a command line; nothing for those that were left out.
    pub fn words(&self) -> Vec<String> {
        let fov = self.fov.map(|(up, down)| format!("{up},{down}"));
        let frame = self.sensor_frame;
        let said = [
            ("--rows", self.rows.map(|n| n.to_string())),
            ("--columns", self.columns.map(|n| n.to_string())),
            ("--fov", fov),
            ("--sensor-frame", (frame != SensorFrame::Auto).then(|| frame.to_string())),
        ];
        let words = said.into_iter().filter_map(|(name, value)| Some([name.to_owned(), value?]));
        words.flatten().collect()
    }
}

fn rows(text: &str) -> Result<usize, String> {
    at_least_one(text).and_then(limits::rows)
}

fn columns(text: &str) -> Result<usize, String> {
    at_least_one(text).and_then(limits::columns)
}

fn field_of_view(text: &str) -> Result<(f64, f64), String> {
    let (up, down) = text.split_once(',').ok_or("use UP,DOWN in degrees, as in 3,-25")?;
    limits::field_of_view((number(up.trim())?, number(down.trim())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_checked() {
        assert_eq!(field_of_view("3,-25"), Ok((3.0, -25.0)));
        for text in ["3", "3,x", "-25,3", "3,3", "91,0", "0,-91", "nan,0"] {
            assert!(field_of_view(text).is_err(), "{text}");
        }
        assert_eq!(rows("1024"), Ok(1024));
        assert!([rows("0"), rows("1025"), rows("-1"), columns("16385")].iter().all(Result::is_err));
    }

    #[test]
    fn words_give_the_arguments_back() {
        let arguments = GeometryArguments {
            rows: Some(32),
            columns: None,
            fov: field_of_view("10,-30").ok(),
            sensor_frame: "180,0,0".parse().unwrap(),
        };
        let words = arguments.words().join(" ");
        assert!(
            words.starts_with("--rows 32 --fov 10") && words.ends_with("--sensor-frame 180,0,0"),
            "{words}"
        );
        assert!(GeometryArguments::default().words().is_empty());
    }
}
