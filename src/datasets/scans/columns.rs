//! Names of columns, for files that do not name them.

use std::str::FromStr;

use super::scan::{Parsed, field};
use crate::messages::clouds::{Datatype, PointField};

/// Error if names of columns are given for a file that has its own.
pub(super) const NAMED: &str = "the file names its fields itself; leave the columns' names out";

/// Names of a point's numbers, in order. A `_` is a number without a name: its bytes stay, as
/// padding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns(Vec<String>);

impl FromStr for Columns {
    type Err = String;

    /// Reads `x,y,z,intensity`.
    fn from_str(text: &str) -> Parsed<Self> {
        let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
        if names.iter().any(String::is_empty) {
            return Err("a column without a name; `_` stands for one to leave out".into());
        }
        for name in ["x", "y", "z"] {
            if !names.iter().any(|other| other == name) {
                return Err(format!("no column `{name}`"));
            }
        }
        let twice =
            |(number, name): (usize, &String)| name != "_" && names[..number].contains(name);
        if let Some((_, name)) = names.iter().enumerate().find(|&named| twice(named)) {
            return Err(format!("two columns `{name}`"));
        }
        Ok(Columns(names))
    }
}

impl Columns {
    /// x, y, z, intensity, then `column_5` and on.
    pub(super) fn usual(count: usize) -> Self {
        let first = ["x", "y", "z", "intensity"].map(str::to_owned).into_iter();
        Columns(first.chain((5..=count).map(|n| format!("column_{n}"))).take(count).collect())
    }

    /// Number of columns, with those without a name.
    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    /// Fields of numbers of one type, one behind the other.
    pub(super) fn fields(&self, datatype: Datatype) -> Vec<PointField> {
        let offsets = (0_u32..).step_by(datatype.size().max(1));
        let named = self.0.iter().zip(offsets).filter(|(name, _)| *name != "_");
        named.map(|(name, offset)| field(name, offset, datatype, 1)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_bad_ones_told() {
        let columns: Columns = "x, y,z,_,ring,_".parse().unwrap();
        let fields = columns.fields(Datatype::Float32);
        let offsets: Vec<_> = fields.iter().map(|f| (f.name.as_str(), f.offset)).collect();
        assert_eq!(offsets, [("x", 0), ("y", 4), ("z", 8), ("ring", 16)]);
        for (text, problem) in [("x,y", "no column `z`"), ("x,y,z,x", "two"), ("x,,y,z", "without")]
        {
            assert!(text.parse::<Columns>().unwrap_err().contains(problem), "{text}");
        }
        assert_eq!(Columns::usual(5).0, ["x", "y", "z", "intensity", "column_5"]);
        assert_eq!(Columns::usual(3).0, ["x", "y", "z"]);
    }
}
