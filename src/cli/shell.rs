//! Command lines that a shell reads back.

use std::fmt::Write;

pub use crate::text::{option_words, path_word};

use crate::cli::terminal::is_hidden;

/// The words as one command line, quoted where a shell needs it.
pub fn command_line(words: &[String]) -> String {
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// A word, quoted if a shell would not read it as it is. One with control characters is quoted as
/// `$'...'` (POSIX 2024), so that none of them is in it.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    match word.chars().any(is_hidden) {
        true => format!("$'{}'", with_escapes(word)),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// A word between the quotes of `$'...'`. What is hidden is written byte by byte, of three octal
/// digits each: a hexadecimal escape would take letters behind it for its own.
fn with_escapes(word: &str) -> String {
    let mut text = String::new();
    for letter in word.chars() {
        match letter {
            '\\' | '\'' => text.extend(['\\', letter]),
            letter if is_hidden(letter) => {
                for byte in letter.encode_utf8(&mut [0; 4]).bytes() {
                    let _ = write!(text, "\\{byte:03o}");
                }
            }
            letter => text.push(letter),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_quoted_for_a_shell() {
        let words = ["divmerge", "a b.mcap", "--at", "-1.5,2,3", "it's", ""].map(String::from);
        assert_eq!(command_line(&words), r"divmerge 'a b.mcap' --at -1.5,2,3 'it'\''s' ''");
    }

    #[test]
    fn nothing_hidden_is_left_in_a_word() {
        assert_eq!(quoted("/p\u{1b}[2J'\\\n"), r"$'/p\033[2J\'\\\012'");
        assert_eq!(quoted("\u{7}12"), r"$'\00712'");
        assert_eq!(quoted("\u{202e}"), r"$'\342\200\256'");
    }
}
