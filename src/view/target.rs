//! Where a stream for the Rerun viewer goes; known with and without the feature `rerun`.

use std::fmt;
use std::path::PathBuf;

/// Where a stream for the Rerun viewer goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// Into a `.rrd` file.
    Save {
        /// The file.
        path: PathBuf,
        /// Whether an existing file may be replaced.
        force: bool,
    },
    /// To a viewer that is running, as in `rerun+http://127.0.0.1:9876/proxy`.
    Connect(String),
    /// To a viewer that is started, or the one that is running on this machine.
    Spawn,
}

impl fmt::Display for Target {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Target::Save { path, .. } => write!(formatter, "{}", path.display()),
            Target::Connect(url) => formatter.write_str(url),
            Target::Spawn => formatter.write_str("the viewer on this machine"),
        }
    }
}
