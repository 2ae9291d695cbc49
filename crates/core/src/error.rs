//! The errors of the core: columns that make no cloud, and parameters out of their limits.

/// An error of one cloud.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CloudError {
    /// Columns of a point cloud differ in length.
    #[error("column `{column}` holds {found} points where x holds {expected}")]
    ColumnLength {
        /// Name of the column.
        column: &'static str,
        /// Points in column x.
        expected: usize,
        /// Points in the offending column.
        found: usize,
    },

    /// The declared height and width do not multiply to the number of points.
    #[error("a cloud of {height} x {width} cannot hold {points} points")]
    Shape {
        /// Declared rows.
        height: usize,
        /// Declared columns.
        width: usize,
        /// Points present.
        points: usize,
    },

    /// Recorded transforms were asked for that are not there.
    #[error(
        "no static transform leads from frame `{frame}` to one of the vehicle (base_link, \
         base_footprint, ...); recorded: {present}"
    )]
    MissingTransform {
        /// The cloud's frame.
        frame: String,
        /// The transforms that are there, comma separated.
        present: String,
    },
}

/// A parameter that is out of its limits, or does not fit the others.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{problem}")]
#[non_exhaustive]
pub struct ParameterError {
    /// Its name.
    pub name: &'static str,
    /// What is wrong with it.
    pub problem: String,
}

impl ParameterError {
    /// The error of a parameter, by its name and what is wrong with it.
    pub fn new(name: &'static str, problem: impl Into<String>) -> Self {
        ParameterError { name, problem: problem.into() }
    }
}
