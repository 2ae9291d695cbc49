//! Trees of values as YAML, read and written.

use serde_json::Value;

/// The tree in a text.
///
/// # Errors
/// The first line of what is wrong with it.
pub(super) fn parse(text: &str) -> Result<Value, String> {
    serde_saphyr::from_str(text)
        .map_err(|error| error.to_string().lines().next().unwrap_or_default().to_owned())
}

/// The text of a tree, in which no reader of an older version takes text for something else.
pub(super) fn text(value: &Value) -> String {
    let options = serde_saphyr::ser_options! { prefer_block_scalars: false };
    serde_saphyr::to_string_with_options(value, options).expect("a tree of JSON is YAML")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_reader_finds_what_was_written() {
        let value = json!({
            "text": ["a b", "#", "a: b", "\"", "\\", "ü", "\u{7f}\u{2028}", "-"],
            "words": ["- g: 1\n", "", "no", "1.5", "/a/b.c-d", "2011-09-30", "null", "12:30:45"],
            "digits": ["1_000", "0x1f", "~"],
            "numbers": [0, 1, -5, u64::MAX, 1.5],
            "deep": [[[{ "a": [{}] }]]],
        });
        assert_eq!(parse(&text(&value)), Ok(value));
    }
}
