//! How many records of each kind have been read.

/// Numbers of records.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) messages: u64,
    pub(crate) chunks: u64,
    pub(crate) attachments: u64,
    pub(crate) metadata: u64,
}
