//! Points in time as text, as protobuf's JSON has them: `2011-09-30T12:28:26.4Z` (RFC 3339).

/// Seconds since 1970 and the nanoseconds beyond; `None` of anything that is no such text.
pub(super) fn parse(text: &str) -> Option<(i64, u32)> {
    let (date, time) = text.split_once(['T', 't', ' '])?;
    let [year, month, day] = numbers(date, '-')?;
    let at = time.find(['Z', 'z', '+', '-'])?;
    let (clock, zone) = time.split_at(at);
    let (whole, fraction) = clock.split_once('.').unwrap_or((clock, "0"));
    let [hour, minute, second] = numbers(whole, ':')?;
    let is_possible = (1..=12).contains(&month)
        && (1..=31).contains(&day)
        && hour < 24
        && minute < 60
        && second <= 60;
    let of_day = (hour * 60 + minute) * 60 + second - offset(zone)?;
    let seconds = days_since_1970(year, month, day) * 86_400 + of_day;
    is_possible.then_some((seconds, nanoseconds(fraction)?))
}

/// Numbers of two to four digits with a mark between them.
fn numbers<const N: usize>(text: &str, mark: char) -> Option<[i64; N]> {
    let mut parts = text.split(mark);
    let mut numbers = [0; N];
    for number in &mut numbers {
        let part = parts.next().filter(|part| (2..=4).contains(&part.len()) && is_digits(part))?;
        *number = part.parse().ok()?;
    }
    parts.next().is_none().then_some(numbers)
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Digits behind the point; those beyond the ninth are cut off.
fn nanoseconds(fraction: &str) -> Option<u32> {
    let digits: String = fraction.chars().chain("00000000".chars()).take(9).collect();
    is_digits(fraction).then(|| digits.parse().ok())?
}

/// Seconds that a zone is ahead of UTC: of `Z`, `+02:00` or `-05:30`.
fn offset(zone: &str) -> Option<i64> {
    let (sign, clock) = match zone.split_at_checked(1)? {
        ("Z" | "z", "") => return Some(0),
        ("+", clock) => (1, clock),
        ("-", clock) => (-1, clock),
        _ => return None,
    };
    let [hours, minutes] = numbers(clock, ':')?;
    (hours < 24 && minutes < 60).then_some(sign * (hours * 60 + minutes) * 60)
}

/// Days from 1970-01-01 in the Gregorian calendar. Counted from March, so that the leap day is a year's last.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month < 3 { (year - 1, month + 9) } else { (year, month - 3) };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    let of_year = (153 * month + 2) / 5 + day - 1;
    year * 365 + leap_days + of_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_times() {
        assert_eq!(parse("1970-01-01T00:00:00Z"), Some((0, 0)));
        assert_eq!(parse("2011-09-30T12:28:26.4Z"), Some((1_317_385_706, 400_000_000)));
        assert_eq!(
            parse("2011-09-30T14:28:26.400000001+02:00"),
            Some((1_317_385_706, 400_000_001))
        );
        assert_eq!(parse("2000-02-29t23:59:59z"), Some((951_868_799, 0)));
        assert_eq!(parse("1969-12-31T23:59:59.9999999999Z"), Some((-1, 999_999_999)));
        assert_eq!(parse("1969-12-31T18:30:00-05:30"), Some((0, 0)));
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
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
