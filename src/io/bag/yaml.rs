//! A tree of values as YAML: blocks, and text in double quotes wherever it could be taken for something else.

use serde_json::Value;

/// The text of a document.
pub(super) fn text(value: &Value) -> String {
    lines(value).into_iter().map(|line| line + "\n").collect()
}

/// The lines of a value, as they stand at the left margin.
fn lines(value: &Value) -> Vec<String> {
    match value {
        Value::Object(table) if !table.is_empty() => {
            table.iter().flat_map(|(key, value)| entry(&scalar(key), value)).collect()
        }
        Value::Array(list) if !list.is_empty() => list.iter().flat_map(item).collect(),
        Value::Object(_) => vec!["{}".to_owned()],
        Value::Array(_) => vec!["[]".to_owned()],
        Value::String(text) => vec![scalar(text)],
        other => vec![other.to_string()],
    }
}

/// A key with its value, on the same line or below it.
fn entry(key: &str, value: &Value) -> Vec<String> {
    let below = lines(value);
    match is_block(value) {
        true => std::iter::once(format!("{key}:"))
            .chain(below.iter().map(|line| format!("  {line}")))
            .collect(),
        false => vec![format!("{key}: {}", below.concat())],
    }
}

/// An item of a list: a dash before its first line.
fn item(value: &Value) -> Vec<String> {
    let marks = std::iter::once("- ").chain(std::iter::repeat("  "));
    lines(value).iter().zip(marks).map(|(line, mark)| format!("{mark}{line}")).collect()
}

fn is_block(value: &Value) -> bool {
    match value {
        Value::Object(table) => !table.is_empty(),
        Value::Array(list) => !list.is_empty(),
        _ => false,
    }
}

/// Text as it is where it can only be text, else in double quotes, with JSON's escapes, which are YAML's too.
fn scalar(text: &str) -> String {
    const WORDS: [&str; 12] =
        ["y", "n", "yes", "no", "on", "off", "true", "false", "null", "nan", "inf", "infinity"];
    let starts_plain = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '/' || c == '_');
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/_.-".contains(c);
    let is_word = WORDS.contains(&text.to_ascii_lowercase().as_str());
    match starts_plain && text.chars().all(is_plain) && !is_word {
        true => text.to_owned(),
        false => Value::from(text).to_string().chars().map(escaped).collect(),
    }
}

/// A character that JSON lets stand and YAML does not, escaped; any other as it is.
fn escaped(c: char) -> String {
    match c {
        '\u{7f}'..='\u{9f}' | '\u{2028}' | '\u{2029}' | '\u{feff}' => {
            format!("\\u{:04x}", u32::from(c))
        }
        c => c.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn blocks() {
        let value = json!({
            "a": { "b": [1, "x", { "c": [], "d": { "e": true } }, ["y", 2]] },
            "f": "- g: 1\n", "h": "", "i": "no", "j": "1.5", "k": null,
        });
        let expected = "a:\n  b:\n    - 1\n    - x\n    - c: []\n      d:\n        e: true\n    - - \"y\"\n      - 2\nf: \"- g: 1\\n\"\nh: \"\"\ni: \"no\"\nj: \"1.5\"\nk: null\n";
        assert_eq!(text(&value), expected);
    }

    #[test]
    fn a_reader_finds_what_was_written() {
        let value = json!({
            "text": ["a b", "#", "a: b", "\"", "\\", "ü", "\u{7f}\u{2028}", "-", "1_000", "0x1f", "~", "/a/b.c-d"],
            "numbers": [0, 1, -5, u64::MAX, 1.5],
            "deep": [[[{ "a": [{}] }]]],
        });
        let again: Value = serde_saphyr::from_str(&text(&value)).unwrap();
        assert_eq!(again, value);
    }
}
