//! The library's errors. Every variant carries the values that offended; the command line adds the
//! file, the topic and the offset.

use std::path::PathBuf;

/// What can go wrong in the library.
#[derive(Debug, thiserror::Error)]
pub enum Error {
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

    /// A message that is not what its schema says.
    #[error("malformed {message}: {problem}")]
    Malformed {
        /// Message type.
        message: &'static str,
        /// What is wrong, with the numbers.
        problem: String,
    },

    /// A message in an encoding or layout that is well formed but cannot be read here.
    #[error("unsupported {message}: {problem}")]
    Unsupported {
        /// Message type.
        message: &'static str,
        /// What is not supported.
        problem: String,
    },

    /// A cloud lacks a field that was asked for.
    #[error("no field `{name}` in the cloud; it has: {present}")]
    MissingField {
        /// The field asked for.
        name: String,
        /// The fields that are there, comma separated.
        present: String,
    },

    /// A taxonomy file that cannot be used.
    #[error("taxonomy {}: {problem}", path.display())]
    Taxonomy {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },

    /// A recording that is damaged or not a recording at all.
    #[error("{}: {problem} (byte {offset})", path.display())]
    Recording {
        /// The recording.
        path: PathBuf,
        /// Byte offset in the file at which the damage was met.
        offset: u64,
        /// What is wrong, in words.
        problem: String,
    },

    /// A recording without a cloud to annotate.
    #[error("{}: {problem}", path.display())]
    NoCloud {
        /// The recording.
        path: PathBuf,
        /// What was looked for, and what is there.
        problem: String,
    },

    /// The output would collide with something in the input.
    #[error("{}: {problem}", path.display())]
    Conflict {
        /// The input recording.
        path: PathBuf,
        /// What collides.
        problem: String,
    },

    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file that was being read or written.
        path: PathBuf,
        /// The system's own error.
        source: std::io::Error,
    },

    /// A stream to a viewer, or into a file for one, that cannot be opened or broke off.
    #[error("{target}: {problem}")]
    Viewer {
        /// The file or address.
        target: String,
        /// What is wrong, and what to do.
        problem: String,
    },

    /// Frames that a recording does not have.
    #[error("{}: {problem}", path.display())]
    NoFrame {
        /// The recording.
        path: PathBuf,
        /// What was asked for, and what is there.
        problem: String,
    },

    /// The MCAP writer refused.
    #[error("writing MCAP: {0}")]
    Write(#[from] mcap::McapError),
}

/// Result of the library's functions.
pub type Result<T> = std::result::Result<T, Error>;
