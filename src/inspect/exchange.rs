//! A request and its reply, apart from the bytes that carry them.

use serde::Serialize;
use serde_json::json;

/// A request.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Asked {
    /// Whether something is sent along (POST).
    pub is_post: bool,
    /// The path with the token.
    pub path: String,
    /// The header `Host`.
    pub host: Option<String>,
    /// The header `Origin`.
    pub origin: Option<String>,
    /// The header `Sec-Fetch-Site`.
    pub fetch_site: Option<String>,
    /// What is sent along.
    pub body: Vec<u8>,
}

/// A reply.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Its status.
    pub status: u16,
    /// The type of its body.
    pub content_type: &'static str,
    /// Its body.
    pub body: Vec<u8>,
}

impl Reply {
    /// A reply that is as it should be.
    pub(super) fn new(content_type: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Reply { status: 200, content_type, body: body.into() }
    }

    /// The same in JSON.
    pub(super) fn json(value: &impl Serialize) -> Self {
        let body = serde_json::to_vec(value).expect("values of replies have a form in JSON");
        Reply::new("application/json", body)
    }

    /// A reply that says what is wrong.
    pub(super) fn problem(status: u16, words: &str) -> Self {
        Reply { status, ..Reply::json(&json!({ "problem": words })) }
    }
}
