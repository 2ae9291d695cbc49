//! The unit of a cloud's coordinates.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

/// The unit of a recording's coordinates. Clouds are in metres inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum LengthUnit {
    /// Metres, as ROS has it.
    #[default]
    #[serde(rename = "m")]
    Metre,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
}

impl LengthUnit {
    /// Units to a metre.
    pub fn per_metre(self) -> f64 {
        match self {
            LengthUnit::Metre => 1.0,
            LengthUnit::Centimetre => 100.0,
            LengthUnit::Millimetre => 1000.0,
        }
    }
}

/// As [`FromStr`] reads it.
impl fmt::Display for LengthUnit {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            LengthUnit::Metre => "m",
            LengthUnit::Centimetre => "cm",
            LengthUnit::Millimetre => "mm",
        })
    }
}

/// Reads `m`, `cm` or `mm`.
impl FromStr for LengthUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let all = [LengthUnit::Metre, LengthUnit::Centimetre, LengthUnit::Millimetre];
        let found = all.into_iter().find(|unit| unit.to_string() == text);
        found.ok_or_else(|| "use m, cm or mm".to_owned())
    }
}
