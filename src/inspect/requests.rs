//! What a page asks for, and what keeps it from being answered.

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::pack::Sums;
use super::setting::Setting;
use crate::error::Error;

/// What keeps a request from being answered, in words.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Problem {
    /// The status of the reply.
    pub status: u16,
    /// The words.
    pub words: String,
}

/// The answer to a request.
pub(super) type Outcome<T> = Result<T, Problem>;

impl Problem {
    /// A request that cannot be answered.
    pub fn wrong(words: impl Into<String>) -> Self {
        Problem { status: 400, words: words.into() }
    }

    /// There is nothing of that name.
    pub fn nothing_here() -> Self {
        Problem { status: 404, words: "nothing is here".into() }
    }
}

impl From<Error> for Problem {
    fn from(error: Error) -> Self {
        Problem { status: 422, words: error.to_string() }
    }
}

/// A frame and how it is clustered.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrameRequest {
    pub topic: String,
    pub frame: u64,
    #[serde(default)]
    pub setting: Setting,
    /// Whether the page needs the points of the cloud too.
    #[serde(default)]
    pub with_points: bool,
    /// The sums of the arrays that the page has.
    #[serde(default)]
    pub known: Sums,
}

/// What a command does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum CommandKind {
    /// Draws the frame.
    Figure,
    /// Explains one or two points.
    Explain,
    /// Annotates the recording.
    Annotate,
    /// Looks at the frame in the inspector.
    Inspect,
}

/// What a figure looks like.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct FigureForm {
    /// `svg`, `png` or `pdf`.
    pub format: String,
    /// Whether its page and its panels are dark.
    #[serde(default)]
    pub dark: bool,
    /// The panels, by the names of the command line; none means those of `figure`.
    #[serde(default)]
    pub panels: Vec<String>,
    /// The part of the plane that is shown: least and greatest x, and y, metres.
    #[serde(default)]
    pub view: Option<[[f64; 2]; 2]>,
}

/// One or two points of a frame.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PointsRequest {
    pub topic: String,
    pub frame: u64,
    #[serde(default)]
    pub setting: Setting,
    #[serde(default)]
    pub points: Vec<usize>,
    /// The kind of command that is asked for.
    #[serde(default)]
    pub command: Option<CommandKind>,
    /// The figure that is asked for.
    #[serde(default)]
    pub figure: Option<FigureForm>,
    /// What the page shows, kept in a case.
    #[serde(default)]
    pub shown: serde_json::Value,
}

/// Two settings of a frame.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CompareRequest {
    pub topic: String,
    pub frame: u64,
    pub first: Setting,
    pub second: Setting,
}

/// Frames to look for the worst cases in.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SurveyRequest {
    pub topic: String,
    /// The first frame, and the last, excluded.
    pub frames: [u64; 2],
    #[serde(default)]
    pub setting: Setting,
}

/// Reads the body of a request.
///
/// # Errors
/// If it is not what it should be.
pub(super) fn read<T: DeserializeOwned>(body: &[u8]) -> Outcome<T> {
    serde_json::from_slice(body).map_err(|error| Problem::wrong(format!("request: {error}")))
}
