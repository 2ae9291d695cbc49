//! Numbers in sentences, and words of command lines.

use std::path::Path;

/// A number with its thousands apart, as in `1,234,567`.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::with_capacity(digits.len() + digits.len() / 3);
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// A number and its noun: `1 pixel`, `2,000 pixels`.
pub fn counted(count: usize, noun: &str) -> String {
    format!("{} {noun}{}", grouped(count as u64), if count == 1 { "" } else { "s" })
}

/// A text in lines of at most so many letters, broken at spaces. A longer word has a line of its
/// own.
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let fits = |line: &&mut String| line.chars().count() + 1 + word.chars().count() <= width;
        match lines.last_mut().filter(fits) {
            Some(line) => *line += &format!(" {word}"),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Widest line that is printed.
pub const WIDTH: usize = 100;

/// A text in lines of at most [`WIDTH`] letters, broken at spaces: what is longer goes on below,
/// four letters deeper. Commands stay whole, so that they can be copied. Ends with a line break.
pub fn fitted(text: &str) -> String {
    broken(text, WIDTH)
}

fn broken(text: &str, width: usize) -> String {
    let mut broken = String::with_capacity(text.len() + text.len() / 16);
    for line in text.lines() {
        let indent = line.len() - line.trim_start_matches(' ').len();
        let is_command = line[indent..].starts_with("divmerge ");
        let (mut rest, mut below) = (line, String::new());
        while let Some((head, tail)) =
            break_of(rest, width.saturating_sub(below.len())).filter(|_| !is_command)
        {
            broken += &format!("{below}{head}\n");
            (rest, below) = (tail, " ".repeat(indent + 4));
        }
        broken += &format!("{below}{}\n", rest.trim_end());
    }
    broken
}

/// Where a line is broken that is longer than so many letters: before the last word that does not
/// fit, or after the first if that is longer by itself.
fn break_of(line: &str, width: usize) -> Option<(&str, &str)> {
    let start = line.len() - line.trim_start_matches(' ').len();
    let (limit, _) = line.char_indices().nth(width)?;
    let place = match limit > start && line[limit..].starts_with(' ') {
        true => limit,
        false => match line.get(start..limit).and_then(|fitting| fitting.rfind(' ')) {
            Some(place) => start + place,
            None => start + line[start..].find(' ')?,
        },
    };
    Some((line[..place].trim_end(), line[place..].trim_start()))
}

/// Nanoseconds as seconds with nine decimals.
pub(crate) fn seconds(ns: i64) -> String {
    let (sign, ns) = (if ns < 0 { "-" } else { "" }, ns.unsigned_abs());
    format!("{sign}{}", log_seconds(ns))
}

/// A log time in nanoseconds as seconds, without rounding.
pub fn log_seconds(ns: u64) -> String {
    format!("{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000)
}

/// The path of an input as a word that no command takes for an option.
pub fn path_word(path: &Path) -> String {
    let path = path.display().to_string();
    if path.starts_with('-') && path != "-" { format!("./{path}") } else { path }
}

/// An option and its value: in one word where the value would be taken for an option itself.
pub fn option_words(option: &str, value: &str) -> Vec<String> {
    match value.starts_with('-') && value.parse::<f64>().is_err() {
        true => vec![format!("{option}={value}")],
        false => vec![option.to_owned(), value.to_owned()],
    }
}

/// A line of a CSV file (RFC 4180), in which no cell is a formula.
pub fn csv_line(cells: &[String]) -> String {
    let quoted = |text: String| match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    };
    let cell = |text: &String| quoted(without_formula(text));
    cells.iter().map(cell).collect::<Vec<_>>().join(",") + "\n"
}

/// Text with an apostrophe before it if a spreadsheet would take it for a formula: it begins with
/// `=`, `+`, `-`, `@` or an invisible character before those, and is neither a number nor the `-`
/// of an empty cell.
fn without_formula(text: &str) -> String {
    let is_risky = text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']);
    match is_risky && text != "-" && text.parse::<f64>().is_err() {
        true => format!("'{text}"),
        false => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_broken_and_what_follows_stands_in() {
        let text = format!("  {}\n\nshort", "abc ".repeat(30));
        let fitted = fitted(&text);
        let lines: Vec<&str> = fitted.lines().collect();
        assert_eq!(lines[0], format!("  {}abc", "abc ".repeat(23)));
        assert_eq!(lines[1], format!("      {}abc", "abc ".repeat(5)));
        assert_eq!(lines[2..], ["", "short"]);
        let deep = format!("{}one two", " ".repeat(120));
        assert!(
            broken(&deep, 100).lines().all(|line| line.ends_with("one") || line.ends_with("two"))
        );
    }

    #[test]
    fn long_lines_go_on_below() {
        let text = "  A  one two three four\nshort\n  divmerge explain a very long command\n";
        let expected =
            "  A  one two\n      three four\nshort\n  divmerge explain a very long command\n";
        assert_eq!(broken(text, 16), expected);
        assert_eq!(broken("averyverylongword next", 8), "averyverylongword\n    next\n");
        assert_eq!(broken("größer größer größer", 13), "größer größer\n    größer\n");
        assert_eq!(broken("fits exactly", 12), "fits exactly\n");
    }

    #[test]
    fn thousands_are_grouped() {
        let numbers = [0, 12, 123, 1234, 123_456, 1_234_567].map(grouped);
        assert_eq!(numbers, ["0", "12", "123", "1,234", "123,456", "1,234,567"]);
    }

    #[test]
    fn texts_are_broken_at_spaces() {
        assert_eq!(wrapped("one two  three", 7), ["one two", "three"]);
        assert_eq!(wrapped("one incomprehensible two", 7), ["one", "incomprehensible", "two"]);
        assert!(wrapped(" ", 7).is_empty());
    }

    #[test]
    fn nouns_agree_with_their_number() {
        let counts = [0, 1, 2000].map(|count| counted(count, "pixel"));
        assert_eq!(counts, ["0 pixels", "1 pixel", "2,000 pixels"]);
    }

    #[test]
    fn names_that_begin_with_a_dash_are_no_options() {
        assert_eq!(path_word(Path::new("-x.mcap")), "./-x.mcap");
        assert_eq!(path_word(Path::new("x-.mcap")), "x-.mcap");
        assert_eq!(option_words("--topic", "-x"), ["--topic=-x"]);
        assert_eq!(option_words("--topic", "/x"), ["--topic", "/x"]);
        assert_eq!(option_words("--sensor-height", "-2.5"), ["--sensor-height", "-2.5"]);
    }

    #[test]
    fn cells_of_a_table_are_quoted_and_no_formulas() {
        let cells =
            ["=1+1", "@a", "-x", "+y", "\t=1", "-1.5", "+2e3", "-", "a=b"].map(String::from);
        assert_eq!(csv_line(&cells), "'=1+1,'@a,'-x,'+y,'\t=1,-1.5,+2e3,-,a=b\n");
        assert_eq!(csv_line(&["a,\"b\"\n".to_owned()]), "\"a,\"\"b\"\"\n\"\n");
    }
}
