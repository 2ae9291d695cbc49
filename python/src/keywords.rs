//! Options of the command line in the library's words, named as Python's keywords.

/// Options whose keyword has another name.
const OTHER_NAMES: [(&str, &str); 3] =
    [("from", "from_"), ("in-place-fields", "in_place"), ("topic", "topics")];

/// Values that follow an option outside of backticks.
const VALUES: [&str; 2] = ["auto", "estimate"];

/// The text with `gap_columns` for each `--gap-columns`, and `units='mm'` for what stands in
/// backticks as `--units mm`.
pub fn as_keywords(text: &str) -> String {
    let mut said = String::new();
    let mut rest = text;
    while let Some(place) = rest.find("--") {
        let (before, option) = rest.split_at(place);
        let name = &option[2..];
        let end = name.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(name.len());
        said.push_str(before);
        if !name.starts_with(|c: char| c.is_ascii_lowercase())
            || before.ends_with(|c: char| c.is_alphanumeric() || c == '-')
        {
            said.push_str(&option[..2 + end]);
            rest = &name[end..];
            continue;
        }
        said.push_str(&keyword(&name[..end]));
        rest = &name[end..];
        if let Some(value) = value(before, rest) {
            said.push_str(&format!("='{value}'"));
            rest = &rest[1 + value.len()..];
        }
    }
    said + rest
}

/// The value of an option, of which `before` stands before it and `rest` behind.
fn value<'a>(before: &str, rest: &'a str) -> Option<&'a str> {
    let behind = rest.strip_prefix(' ')?;
    match before.ends_with('`') {
        true => behind.find('`').map(|end| &behind[..end]),
        false => VALUES.into_iter().find_map(|value| {
            let is_word =
                behind.strip_prefix(value)?.chars().next().is_none_or(|c| !c.is_alphanumeric());
            is_word.then(|| &behind[..value.len()])
        }),
    }
}

fn keyword(option: &str) -> String {
    let other = OTHER_NAMES.iter().find(|(name, _)| *name == option);
    other.map_or_else(|| option.replace('-', "_"), |(_, keyword)| (*keyword).to_owned())
}
