//! Compression of chunks.

use serde::{Deserialize, Serialize};

/// Compression of the chunks of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Compression {
    /// None.
    None,
    /// LZ4 at its fastest level.
    Lz4,
    /// Zstandard at level 1.
    #[default]
    Zstd,
}

impl Compression {
    /// Name in the format, empty for none.
    pub fn name(self) -> &'static str {
        match self {
            Compression::None => "",
            Compression::Lz4 => "lz4",
            Compression::Zstd => "zstd",
        }
    }

    /// The compression of a name in the format.
    pub fn of_name(name: &str) -> Option<Self> {
        let all = [Compression::None, Compression::Lz4, Compression::Zstd];
        all.into_iter().find(|compression| compression.name() == name)
    }
}
