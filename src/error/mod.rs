//! The library's errors: those of one cloud, and those that end a run. Every variant carries the
//! values that offended; the command line adds the file, the topic and the offset.

pub mod conflict;
pub mod frame;
pub mod no_cloud;
pub mod slice;
pub mod spelling;

use std::ops::Range;
use std::path::{Path, PathBuf};

use divmerge_core::parameters::SettingError;
use divmerge_core::{CloudError, ParameterError};

pub use self::conflict::Conflict;
pub use self::frame::{FrameError, MissingClasses, NearestClasses, Unsupported};
pub use self::no_cloud::NoCloud;
pub use self::slice::SliceProblem;
use crate::text::grouped;

/// What can go wrong in the library.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// What is wrong with one cloud. Where clouds are taken one after the other, that cloud is
    /// skipped and the run goes on; every other error ends it.
    #[error(transparent)]
    Frame(#[from] FrameError),

    /// A file, or a cloud with its truth, that has to be read and cannot be.
    #[error("{at}: {problem}")]
    Unreadable {
        /// The file, or the cloud of a recording.
        at: String,
        /// What is wrong with it.
        problem: FrameError,
    },

    /// A taxonomy file that cannot be used.
    #[error("taxonomy {}: {problem}", path.display())]
    Taxonomy {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },

    /// None of the clouds that were asked for.
    #[error("{}: {problem}", path.display())]
    NoCloud {
        /// The recording, or the folder.
        path: PathBuf,
        /// What was looked for, and what is there.
        problem: NoCloud,
    },

    /// Detection boxes that cannot be read, or do not belong to the clouds.
    #[error("boxes of {source_name}: {problem}")]
    Boxes {
        /// The topic or the file.
        source_name: String,
        /// What is wrong, with the values.
        problem: String,
    },

    /// A network, or its configuration, that cannot be used.
    #[error("network {}: {problem}", path.display())]
    Network {
        /// The ONNX file, or the file of its configuration.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },

    /// Classes of points that cannot be read, or do not belong to the clouds.
    #[error("classes of {source_name}: {problem}")]
    Classes {
        /// The topic or the file.
        source_name: String,
        /// What is wrong, with the values.
        problem: String,
    },

    /// A class that the taxonomy does not know, where all have to be known.
    #[error("{at}: class {class} ({} points) is not in taxonomy {taxonomy}", grouped(*points))]
    UnknownClass {
        /// The file, the cloud of a recording, or the array.
        at: String,
        /// The class.
        class: u16,
        /// Points that have it.
        points: u64,
        /// Name of the taxonomy.
        taxonomy: String,
    },

    /// A folder whose files do not fit together or cannot be read.
    #[error("{}", folder(path, problems, *count))]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What is wrong, a line each, with the names of the files; the first ones if there are
        /// many.
        problems: Vec<String>,
        /// How many there are.
        count: usize,
    },

    /// A bag whose `metadata.yaml` cannot be used.
    #[error("{}: {problem}", path.display())]
    Bag {
        /// That file.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        problem: String,
    },

    /// An output that cannot be made of an input.
    #[error("{}: {problem}", path.display())]
    Conflict {
        /// The input, or the output that is to be continued.
        path: PathBuf,
        /// Why not.
        problem: Conflict,
    },

    /// Slices of a recording that do not make up the whole.
    #[error("{}: {problem}", of.display())]
    Slices {
        /// The recording, or a slice.
        of: PathBuf,
        /// What is missing, or there twice, or does not belong.
        problem: SliceProblem,
    },

    /// The caller broke off.
    #[error("interrupted; nothing was written to {}", path.display())]
    Interrupted {
        /// The output that was not written.
        path: PathBuf,
    },

    /// The caller broke off, and what was done so far can be used by a run that goes on.
    #[error(
        "interrupted; the work so far is kept in {} and {}: run the same command with --resume to \
         continue, or without it to start again",
        partial.display(),
        journal.display()
    )]
    Left {
        /// The half written file.
        partial: PathBuf,
        /// What is in it.
        journal: PathBuf,
    },

    /// No return where one was asked for.
    #[error("{}", nothing_there(*at, *within, *nearest))]
    NothingThere {
        /// The position asked for, metres.
        at: [f64; 3],
        /// How far a return may be from it, metres.
        within: f64,
        /// The nearest return and its distance in metres; none in a cloud without a return.
        nearest: Option<([f32; 3], f64)>,
    },

    /// An instance that the frame does not have.
    #[error("{}", no_instance(*id, *count))]
    NoInstance {
        /// The id asked for.
        id: u32,
        /// Number of instances; their ids are 1 to this.
        count: u32,
    },

    /// A parameter that is out of its limits, or does not fit the others.
    #[error(transparent)]
    Parameter(#[from] ParameterError),

    /// A parameter that cannot be set.
    #[error(transparent)]
    Setting(#[from] SettingError),

    /// A file of parameters that cannot be used.
    #[error("{}: {problem}", path.display())]
    ParameterFile {
        /// The file, or the annotated recording.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },

    /// A figure that cannot be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),

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

    /// A recording that is damaged or cannot be read or written. What the system refused is
    /// [`Error::Io`], and an output that was abandoned [`Error::Interrupted`].
    #[error(transparent)]
    Recording(divmerge_recording::Error),
}

impl Error {
    /// [`Error::UnknownClass`] for one of the `raw` classes of all points at `at`.
    pub(crate) fn unknown_class(
        at: impl Into<String>,
        class: u16,
        raw: impl IntoIterator<Item = u16>,
        taxonomy: &str,
    ) -> Self {
        let points = raw.into_iter().filter(|&raw| raw == class).count() as u64;
        Error::UnknownClass { at: at.into(), class, points, taxonomy: taxonomy.to_owned() }
    }
}

impl Error {
    /// The same, with the file before the place of an unknown class.
    pub(crate) fn in_file(mut self, path: &Path) -> Self {
        if let Error::UnknownClass { at, .. } = &mut self {
            *at = format!("{}: {at}", path.display());
        }
        self
    }
}

impl From<CloudError> for Error {
    fn from(error: CloudError) -> Self {
        Error::Frame(error.into())
    }
}

/// Why a figure cannot be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// A figure of nothing.
    #[error("a figure needs a panel")]
    NoPanel,

    /// A part that is not in the image.
    #[error(
        "{side} {}..{} lie outside of the {rows} x {columns} range image", range.start, range.end
    )]
    OutsideImage {
        /// `rows` or `columns`.
        side: &'static str,
        /// Those asked for.
        range: Range<usize>,
        /// Rows of the image.
        rows: usize,
        /// Columns of the image.
        columns: usize,
    },

    /// A panel of the intensity of a cloud without it.
    #[error("the cloud has no field `intensity` or `reflectivity` for a panel `intensity`")]
    NoIntensity,
}

fn folder(path: &Path, problems: &[String], count: usize) -> String {
    let more = match count - problems.len() {
        0 => String::new(),
        more => format!("\n  and {more} more"),
    };
    let lines = problems.join("\n  ");
    let noun = if count == 1 { "problem" } else { "problems" };
    format!("{}: {count} {noun}:\n  {lines}{more}", path.display())
}

impl From<divmerge_recording::Error> for Error {
    fn from(error: divmerge_recording::Error) -> Self {
        match error {
            divmerge_recording::Error::Io { path, source } => Error::Io { path, source },
            divmerge_recording::Error::Interrupted { path } => Error::Interrupted { path },
            error => Error::Recording(error),
        }
    }
}

fn nothing_there(at: [f64; 3], within: f64, nearest: Option<([f32; 3], f64)>) -> String {
    let [x, y, z] = at;
    match nearest {
        None => "the cloud has no return at all".into(),
        Some(([nx, ny, nz], distance)) => format!(
            "no return within {within} m of {x},{y},{z}; the nearest is {distance:.2} m away, at \
             {nx:.3},{ny:.3},{nz:.3}"
        ),
    }
}

fn no_instance(id: u32, count: u32) -> String {
    match count {
        0 => format!("no instance {id}: the frame has no instance at all"),
        _ => format!("no instance {id}: the frame's instances are 1 to {count}"),
    }
}

/// Result of the library's functions.
pub type Result<T> = std::result::Result<T, Error>;
