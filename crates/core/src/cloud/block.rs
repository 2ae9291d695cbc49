//! Blocks along the axes of a frame.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

/// A block along the axes of a frame, its faces included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Block {
    /// Least x, y and z in metres; minus infinity where there is no limit.
    pub least: [f64; 3],
    /// Greatest x, y and z in metres; infinity where there is no limit.
    pub greatest: [f64; 3],
}

impl Block {
    /// Whether a position lies inside.
    pub fn contains(&self, position: [f64; 3]) -> bool {
        (0..3).all(|axis| (self.least[axis]..=self.greatest[axis]).contains(&position[axis]))
    }
}

/// As [`FromStr`] reads it.
impl fmt::Display for Block {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limit = |at: f64| if at.is_finite() { at.to_string() } else { String::new() };
        let sides = self.least.iter().zip(&self.greatest);
        let sides = sides.map(|(&least, &most)| format!("{}..{}", limit(least), limit(most)));
        out.write_str(&sides.collect::<Vec<_>>().join(","))
    }
}

/// Reads `X0..X1,Y0..Y1,Z0..Z1`, where a limit may be left out.
impl FromStr for Block {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let usage = || "use X0..X1,Y0..Y1,Z0..Z1 in metres, as in -2..3,-1..1,..2".to_owned();
        let sides: Vec<&str> = text.split(',').collect();
        let [x, y, z] = sides[..] else { return Err(usage()) };
        let limit = |text: &str, none: f64| match text {
            "" => Ok(none),
            text => text.parse().ok().filter(|at: &f64| at.is_finite()).ok_or_else(usage),
        };
        let side = |text: &str| {
            let (least, most) = text.split_once("..").ok_or_else(usage)?;
            let side = (limit(least, f64::NEG_INFINITY)?, limit(most, f64::INFINITY)?);
            match side.0 <= side.1 {
                true => Ok(side),
                false => Err(format!("{text} ends before it begins")),
            }
        };
        let [x, y, z] = [side(x)?, side(y)?, side(z)?];
        Ok(Block { least: [x.0, y.0, z.0], greatest: [x.1, y.1, z.1] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_read_and_written() {
        let block: Block = "-2..3.5,..1,0..".parse().unwrap();
        assert_eq!(block.to_string(), "-2..3.5,..1,0..");
        assert!(block.contains([3.5, -1e9, 0.0]) && !block.contains([3.6, 0.0, 0.0]));
        for wrong in ["", "1..2", "1..2,3..4", "a..2,..,..", "2..1,..,..", "nan..,..,..", "1,2,3"] {
            assert!(wrong.parse::<Block>().is_err(), "{wrong}");
        }
    }
}
