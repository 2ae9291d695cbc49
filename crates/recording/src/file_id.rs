//! Whether two names are those of one file.

use std::fs::{File, Metadata};
use std::path::Path;

/// What tells a file from all others of the system, whatever its names: device and inode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct FileId(u64, u64);

impl FileId {
    /// `None` where the system has no such numbers.
    #[cfg(unix)]
    fn of(metadata: &Metadata) -> Option<Self> {
        use std::os::unix::fs::MetadataExt;
        Some(FileId(metadata.dev(), metadata.ino()))
    }

    #[cfg(not(unix))]
    fn of(_: &Metadata) -> Option<Self> {
        None
    }
}

/// Whether two names are those of one file that exists, also by links of any kind.
pub fn is_same_file(first: &Path, second: &Path) -> bool {
    let ids = [first, second].map(|path| path.metadata().ok().and_then(|found| FileId::of(&found)));
    match ids {
        [Some(first), Some(second)] => first == second,
        _ => match (first.canonicalize(), second.canonicalize()) {
            (Ok(first), Ok(second)) => first == second,
            _ => false,
        },
    }
}

/// Whether an open file is the one under a name, which is not followed if it is a link.
pub fn is_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), path.symlink_metadata()) {
        (Ok(open), Ok(named)) => FileId::of(&open) == FileId::of(&named),
        _ => false,
    }
}
