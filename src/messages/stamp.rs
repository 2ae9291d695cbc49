//! Points in time: the stamps of messages, and how times are written as text.

use jiff::Timestamp;

const NS_PER_S: u64 = 1_000_000_000;

/// Whole seconds since 1970 and the nanoseconds beyond, of nanoseconds since 1970.
pub fn stamp(nanoseconds: u64) -> (i32, u32) {
    ((nanoseconds / NS_PER_S) as i32, (nanoseconds % NS_PER_S) as u32)
}

/// Nanoseconds since 1970 of a stamp; what does not fit is cut off at the ends of the range.
pub(crate) fn stamp_ns(sec: i64, nanosec: u32) -> i64 {
    sec.saturating_mul(NS_PER_S as i64).saturating_add(i64::from(nanosec))
}

/// Seconds since 1970 and the nanoseconds beyond, of a time as in RFC 3339:
/// `2011-09-30T12:28:26.4Z`. Digits of a fraction beyond the ninth are cut off, and a leap second
/// is the second before it.
pub(crate) fn parse_rfc3339(text: &str) -> Option<(i64, u32)> {
    const TO_MINUTES: usize = "2011-09-30T12:28".len();
    const TO_NANOSECONDS: usize = "2011-09-30T12:28:26.123456789".len();
    // The library takes more of ISO 8601 (no seconds, zones by name), and no more than nine digits.
    let zone_at = text.rfind(['Z', 'z', '+', '-']).filter(|_| !text.ends_with(']'))?;
    let (clock, zone) = text.split_at(zone_at);
    let has_seconds = clock.as_bytes().get(TO_MINUTES) == Some(&b':');
    let clock = clock.get(..clock.len().min(TO_NANOSECONDS)).filter(|_| has_seconds)?;
    let time: Timestamp = format!("{clock}{zone}").parse().ok()?;
    let (ns, second) = (time.as_nanosecond(), i128::from(NS_PER_S));
    Some((ns.div_euclid(second) as i64, ns.rem_euclid(second) as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_times() {
        assert_eq!(parse_rfc3339("1970-01-01T00:00:00Z"), Some((0, 0)));
        assert_eq!(parse_rfc3339("2011-09-30T12:28:26.4Z"), Some((1_317_385_706, 400_000_000)));
        assert_eq!(
            parse_rfc3339("2011-09-30T14:28:26.400000001+02:00"),
            Some((1_317_385_706, 400_000_001))
        );
        assert_eq!(parse_rfc3339("2000-02-29t23:59:59z"), Some((951_868_799, 0)));
        assert_eq!(parse_rfc3339("1969-12-31T23:59:59.9999999999Z"), Some((-1, 999_999_999)));
        assert_eq!(parse_rfc3339("1969-12-31T18:30:00-05:30"), Some((0, 0)));
    }

    #[test]
    fn what_is_no_time_is_none() {
        for text in [
            "",
            "T",
            "2011-09-30",
            "2011-09-30T12:28:26",
            "2011-13-30T12:28:26Z",
            "2011-09-30T24:28:26Z",
            "2011-09-30T12:28:26.Z",
            "2011-09-30T12:28Z",
            "2011-9-30T12:28:26Z",
            "2011-09-30T12:28:26+2",
            "2011-09-30T12:28:26.4€Z",
            "2011-09-30T12:28:26Zulu",
            "+011-09-30T12:28:26Z",
        ] {
            assert_eq!(parse_rfc3339(text), None, "{text}");
        }
    }
}
