//! What the output of an annotation holds.

use serde::{Deserialize, Serialize};

/// What the output holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Form {
    /// Everything that the input holds, and `T/instances` and `T/objects` beside each cloud topic
    /// T.
    #[default]
    Beside,
    /// Everything that the input holds, but each cloud of T with the fields of `T/instances` behind
    /// its own; `T/objects` beside T. A cloud that cannot be read stays as it is.
    InPlace,
    /// `T/instances` and `T/objects` alone.
    Only,
}

impl Form {
    /// In words, as in the output's metadata.
    pub fn describe(self) -> &'static str {
        match self {
            Form::Beside => "beside the input",
            Form::InPlace => "in place of the clouds",
            Form::Only => "annotations only",
        }
    }
}
