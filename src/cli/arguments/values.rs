//! Value parsers: how the command line reads numbers, ranges and names.

use std::ops::{Bound, Range};
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::annotate::TrackOptions;
use crate::pipeline::overrides::limits;
use crate::recording::{Compression, MessageRange};
use crate::view::Theme;

/// A name, what `--help` says about it, and the value that it stands for.
pub type NamedValue<T> = (&'static str, &'static str, T);

/// Compressions of a recording's chunks.
pub const COMPRESSIONS: &[NamedValue<Compression>] = &[
    ("zstd", "Zstandard, level 1", Compression::Zstd),
    ("lz4", "LZ4: faster, larger files", Compression::Lz4),
    ("none", "No compression", Compression::None),
];

/// Themes of figures.
pub const THEMES: &[NamedValue<Theme>] = &[
    ("dark", "Dark panels on a white page, for the screen", Theme::Dark),
    ("light", "Light panels, for print", Theme::Light),
];

/// Reads one of the names.
pub fn one_of<T: Copy + Send + Sync>(
    choices: &'static [NamedValue<T>],
) -> impl TypedValueParser<Value = T> {
    let names = choices.iter().map(|(name, help, _)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names)
        .map(|text| find(choices, &text).expect("clap accepts these names alone"))
}

/// The value of a name.
pub fn find<T: Copy>(choices: &[NamedValue<T>], text: &str) -> Option<T> {
    choices.iter().find(|(name, ..)| *name == text).map(|&(.., value)| value)
}

/// A finite number.
pub fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "not a number".to_owned()).and_then(limits::finite)
}

/// A number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(limits::above_zero)
}

/// A number from 0 on.
pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(limits::not_negative)
}

/// Seconds to look ahead.
pub fn lag(text: &str) -> Result<f64, String> {
    let seconds = number(text)?;
    TrackOptions::default().with_lag(seconds).map(|_| seconds)
}

/// Degrees from 0 to below 90.
pub fn angle(text: &str) -> Result<f64, String> {
    number(text).and_then(limits::acute_angle)
}

/// A whole number from 1 on.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    limits::at_least_one(text.parse().unwrap_or(0))
}

/// Rows of a range image.
pub fn rows(text: &str) -> Result<usize, String> {
    at_least_one(text).and_then(limits::rows)
}

/// Columns of a range image.
pub fn columns(text: &str) -> Result<usize, String> {
    at_least_one(text).and_then(limits::columns)
}

/// `UP,DOWN` in degrees.
pub fn field_of_view(text: &str) -> Result<(f64, f64), String> {
    let (up, down) = text.split_once(',').ok_or("use UP,DOWN in degrees, as in 3,-25")?;
    limits::field_of_view((number(up.trim())?, number(down.trim())?))
}

/// `x,y,z` in metres.
pub fn position(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, String> =
        text.split(',').map(|part| number(part.trim())).collect();
    let form = || "use x,y,z in metres, as in 12.5,-3.2,0.4".to_owned();
    numbers.map_err(|_| form())?.try_into().map_err(|_| form())
}

/// `5..10` (without 10), `5..`, `..10` or `5`.
pub fn frames(text: &str) -> Result<MessageRange, String> {
    let wrong = |_| "use numbers from 0, as in 5..10 (without 10), 5.., ..10 or 5".to_owned();
    let number = |text: &str| text.trim().parse::<u64>().map_err(wrong);
    let Some((first, end)) = text.split_once("..") else {
        let frame = number(text)?;
        return Ok((Bound::Included(frame), Bound::Included(frame)));
    };
    let bound = |text: &str, bound: fn(u64) -> Bound<u64>| match text.trim() {
        "" => Ok(Bound::Unbounded),
        text => number(text).map(bound),
    };
    let range = (bound(first, Bound::Included)?, bound(end, Bound::Excluded)?);
    if let (Bound::Included(first), Bound::Excluded(end)) = range
        && first >= end
    {
        return Err("the range is empty".into());
    }
    Ok(range)
}

/// `a..b` with a below b.
pub fn range<T: FromStr + PartialOrd>(text: &str) -> Result<Range<T>, String> {
    let wrong = || format!("`{text}` is not a range: use a..b with a below b");
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    match (from.parse::<T>(), to.parse::<T>()) {
        (Ok(from), Ok(to)) if from < to => Ok(from..to),
        _ => Err(wrong()),
    }
}

/// Reads a number of bytes: `1000`, or with K, M, G or T for powers of 1024, as in `16G`.
pub fn bytes(text: &str) -> Result<u64, String> {
    let (number, unit) = match text.find(|c: char| !c.is_ascii_digit()) {
        Some(at) => text.split_at(at),
        None => (text, ""),
    };
    let shift = match unit.to_ascii_uppercase().trim_end_matches('B').trim_end_matches('I') {
        "" => Some(0),
        unit => "KMGT".find(unit).filter(|_| unit.len() == 1).map(|place| 10 * (place + 1)),
    };
    let number = number.parse::<u64>().ok().filter(|&number| number > 0);
    let bytes = number.zip(shift).and_then(|(number, shift)| number.checked_mul(1 << shift));
    bytes.ok_or_else(|| "must be a number of bytes, as 500M or 16G".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units_of_1024() {
        assert_eq!(
            ["7", "1k", "16G", "3GiB", "2MB"].map(|text| bytes(text).unwrap()),
            [7, 1 << 10, 16 << 30, 3 << 30, 2 << 20]
        );
        for wrong in ["", "G", "0", "-1", "1.5G", "1X", "1KM", "99999999999T"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn frame_ranges() {
        use Bound::{Excluded, Included, Unbounded};
        assert_eq!(frames("5..10"), Ok((Included(5), Excluded(10))));
        assert_eq!(frames("5.."), Ok((Included(5), Unbounded)));
        assert_eq!(frames("..10"), Ok((Unbounded, Excluded(10))));
        assert_eq!(frames("7"), Ok((Included(7), Included(7))));
        assert!(["", "a..b", "-1", "5..5", "9..3", "1...3"].iter().all(|t| frames(t).is_err()));
    }

    #[test]
    fn images() {
        assert_eq!(field_of_view("3,-25"), Ok((3.0, -25.0)));
        for text in ["3", "3,x", "-25,3", "3,3", "91,0", "0,-91", "nan,0"] {
            assert!(field_of_view(text).is_err(), "{text}");
        }
        assert_eq!(rows("1024"), Ok(1024));
        assert!([rows("0"), rows("1025"), rows("-1"), columns("16385")].iter().all(Result::is_err));
    }
}
