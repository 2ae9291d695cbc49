//! Options of the command line in the library's words, named as Python's keywords.

/// Options whose keyword has another name.
const OTHER_NAMES: [(&str, &str); 3] =
    [("from", "from_"), ("in-place-fields", "in_place"), ("topic", "topics")];

/// The text with `gap_columns` for each `--gap-columns`.
pub fn as_keywords(text: &str) -> String {
    let mut said = String::new();
    let mut rest = text;
    while let Some(place) = rest.find("--") {
        let (before, option) = rest.split_at(place);
        let name = &option[2..];
        let end = name.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(name.len());
        let starts_word =
            before.chars().next_back().is_none_or(|c| !c.is_alphanumeric() && c != '-');
        said.push_str(before);
        match starts_word && name.starts_with(|c: char| c.is_ascii_lowercase()) {
            true => said.push_str(&keyword(&name[..end])),
            false => said.push_str(&option[..2 + end]),
        }
        rest = &name[end..];
    }
    said + rest
}

fn keyword(option: &str) -> String {
    let other = OTHER_NAMES.iter().find(|(name, _)| *name == option);
    other.map_or_else(|| option.replace('-', "_"), |(_, keyword)| (*keyword).to_owned())
}
