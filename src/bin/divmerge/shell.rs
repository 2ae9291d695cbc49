//! Command lines that a shell reads back.

/// The words as one command line, quoted where a shell needs it.
pub fn command_line(words: &[String]) -> String {
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// A word, quoted if a shell would not read it as it is.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_quoted_for_a_shell() {
        let words = ["divmerge", "a b.mcap", "--at", "-1.5,2,3", "it's", ""].map(String::from);
        assert_eq!(command_line(&words), r"divmerge 'a b.mcap' --at -1.5,2,3 'it'\''s' ''");
    }
}
