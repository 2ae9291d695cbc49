//! Points in time of a recording as people say them, and the log times that they stand for.

use std::path::Path;
use std::str::FromStr;

use crate::error::Result;
use crate::frames::{CloudAt, choose_topics, encoded_cloud_at};
use crate::messages::stamp::parse_rfc3339;
use divmerge_core::ParameterError;
use divmerge_recording::{Overview, is_stream};

/// The error message of a time that cannot be read.
const FORMS: &str = "use seconds from the start (12.5), a time since 1970 (@1317384506.4), a date \
                     (2011-09-30T12:28:26Z) or a frame (frame:100)";

const NS_PER_S: u64 = 1_000_000_000;

/// A point in time of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeSpec {
    /// Seconds after the first message.
    FromStart(f64),
    /// Log time in nanoseconds since 1970.
    Absolute(u64),
    /// When the cloud of that number was logged, from 0.
    Frame(u64),
}

impl TimeSpec {
    /// The log time in nanoseconds; a frame's on the first of the topics that are chosen (none: of
    /// all).
    ///
    /// # Errors
    /// If there is no such frame; those of reading the recording.
    pub fn log_time(self, overview: &Overview, topics: &[String]) -> Result<u64> {
        let start = overview.start_ns.unwrap_or(0);
        Ok(match self {
            TimeSpec::FromStart(seconds) => start.saturating_add((seconds * 1e9).round() as u64),
            TimeSpec::Absolute(nanoseconds) => nanoseconds,
            TimeSpec::Frame(number) => {
                let topic = first_topic(overview, topics)?;
                encoded_cloud_at(&overview.path, Some(&topic), CloudAt::Frame(number), None)?
                    .header
                    .log_time
            }
        })
    }

    /// As [`TimeSpec::log_time`], and nothing for the frame behind the last, which ends what has no
    /// end.
    fn end(self, overview: &Overview, topics: &[String]) -> Result<Option<u64>> {
        if let TimeSpec::Frame(number) = self {
            let topic = first_topic(overview, topics)?;
            let counts = overview
                .channels_of(&topic)
                .filter_map(|channel| overview.message_counts.get(&channel.id));
            if number == counts.sum::<u64>() {
                return Ok(None);
            }
        }
        self.log_time(overview, topics).map(Some)
    }
}

/// The first topic whose clouds are looked at.
fn first_topic(overview: &Overview, topics: &[String]) -> Result<String> {
    if let Some(topic) = topics.first() {
        return Ok(topic.clone());
    }
    let clouds = choose_topics(overview, topics, None)?;
    Ok(clouds.into_values().next().map(|cloud| cloud.topic.to_string()).unwrap_or_default())
}

/// The log times in nanoseconds of two times of a recording; the topics are those
/// whose clouds are looked at, none for all.
///
/// # Errors
/// [`Error::Parameter`](crate::error::Error::Parameter) if the first does not lie before the
/// second, or the recording is a stream and they need one that can be read twice; those of
/// [`TimeSpec::log_time`].
pub fn window(
    input: &Path,
    (from, to): (Option<TimeSpec>, Option<TimeSpec>),
    topics: &[String],
) -> Result<(Option<u64>, Option<u64>)> {
    if from.is_none() && to.is_none() {
        return Ok((None, None));
    }
    if is_stream(input) {
        return absolute((from, to));
    }
    let overview = Overview::read(input)?;
    let from = from.map(|from| from.log_time(&overview, topics)).transpose()?;
    let to = to.map(|to| to.end(&overview, topics)).transpose()?.flatten();
    if let (Some(from), Some(to)) = (from, to)
        && from >= to
    {
        return Err(ParameterError::new("from", "must lie before the end").into());
    }
    Ok((from, to))
}

/// The log times of times that need no recording, for a stream.
fn absolute(
    (from, to): (Option<TimeSpec>, Option<TimeSpec>),
) -> Result<(Option<u64>, Option<u64>)> {
    let time = |moment| match moment {
        None => Ok(None),
        Some(TimeSpec::Absolute(nanoseconds)) => Ok(Some(nanoseconds)),
        Some(_) => {
            let problem = "of a stream, both ends are times since 1970 (@1317384506.4) or dates";
            Err(ParameterError::new("window", problem))
        }
    };
    Ok((time(from)?, time(to)?))
}

/// Reads `12.5` as seconds from the start, `@1317384506.4` as seconds since 1970,
/// `2011-09-30T12:28:26Z` as a date and `frame:100` as a cloud.
impl FromStr for TimeSpec {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        if let Some(frame) = text.strip_prefix("frame:") {
            return frame.parse().map(TimeSpec::Frame).map_err(|_| FORMS.to_owned());
        }
        if let Some(digits) = text.strip_prefix('@') {
            return since_1970(digits).map(TimeSpec::Absolute);
        }
        if text.contains(['T', 't']) {
            return date(text).map(TimeSpec::Absolute).ok_or_else(|| FORMS.to_owned());
        }
        match text.strip_suffix('s').unwrap_or(text).parse::<f64>() {
            Ok(seconds) if seconds < 0.0 && seconds.is_finite() => {
                Err("must not be negative".into())
            }
            Ok(seconds) if seconds.is_finite() => Ok(TimeSpec::FromStart(seconds)),
            _ => Err(FORMS.to_owned()),
        }
    }
}

/// Reads seconds since 1970, with a fraction or without, as nanoseconds.
///
/// # Errors
/// What to write instead.
pub fn since_1970(text: &str) -> std::result::Result<u64, String> {
    // Through text: a double does not hold nanoseconds since 1970.
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    match (digits(whole), fraction_ns(fraction)) {
        (Some(whole), Some(nanoseconds)) => whole
            .checked_mul(NS_PER_S)
            .and_then(|whole| whole.checked_add(nanoseconds))
            .ok_or_else(|| "too far in the future".to_owned()),
        _ => Err("use seconds since 1970, as in 1317384506.4".into()),
    }
}

/// A number of digits alone.
fn digits(text: &str) -> Option<u64> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

/// The digits behind a decimal point, of seconds, as nanoseconds.
fn fraction_ns(text: &str) -> Option<u64> {
    let nine: String = text.chars().chain("000000000".chars()).take(9).collect();
    digits(text.get(..text.len().min(9))?).or(text.is_empty().then_some(0))?;
    digits(&nine)
}

/// Nanoseconds since 1970 of a date and time as RFC 3339 has them, with `Z` or an offset.
fn date(text: &str) -> Option<u64> {
    let (seconds, nanoseconds) = parse_rfc3339(text)?;
    u64::try_from(seconds).ok()?.checked_mul(NS_PER_S)?.checked_add(nanoseconds.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(text: &str) -> std::result::Result<TimeSpec, String> {
        text.parse()
    }

    #[test]
    fn every_form() {
        assert_eq!(moment("12.5"), Ok(TimeSpec::FromStart(12.5)));
        assert_eq!(moment("12.5s"), Ok(TimeSpec::FromStart(12.5)));
        assert_eq!(moment("@1317384506.4"), Ok(TimeSpec::Absolute(1_317_384_506_400_000_000)));
        assert_eq!(moment("@7"), Ok(TimeSpec::Absolute(7_000_000_000)));
        assert_eq!(moment("@1.1234567899"), Ok(TimeSpec::Absolute(1_123_456_789)));
        assert_eq!(moment("frame:100"), Ok(TimeSpec::Frame(100)));
        for wrong in ["-1", "noon", "@1e3", "@", "frame:", "frame:-1", "frame:1.5", "@1.x", "@+1"] {
            assert!(moment(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn dates() {
        let at = |text: &str| date(text).map(|ns| (ns / NS_PER_S, ns % NS_PER_S));
        assert_eq!(at("1970-01-01T00:00:00Z"), Some((0, 0)));
        // `date -u -d ... +%s` says so.
        assert_eq!(at("2011-09-30T12:28:26Z"), Some((1_317_385_706, 0)));
        assert_eq!(at("2011-09-30t14:28:26.25+02:00"), Some((1_317_385_706, 250_000_000)));
        assert_eq!(at("2011-09-30T08:58:26-03:30"), Some((1_317_385_706, 0)));
        assert_eq!(at("2000-02-29T00:00:00Z"), Some((951_782_400, 0)));
        assert_eq!(at("2024-12-31T23:59:59Z"), Some((1_735_689_599, 0)));
        assert_eq!(at("2100-03-01T00:00:00Z"), Some((4_107_542_400, 0)));
        for wrong in [
            "2011-09-30T12:28:26",
            "2011-09-31T12:28:26Z",
            "2011-02-29T12:28:26Z",
            "2011-13-01T12:28:26Z",
            "2011-09-30T24:28:26Z",
            "2011-9-30T12:28:26Z",
            "2011-09-30T12:28Z",
            "1969-12-31T23:59:59Z",
            "2011-09-30T12:28:26.Z5",
            "T",
        ] {
            assert_eq!(date(wrong), None, "{wrong}");
        }
    }
}
