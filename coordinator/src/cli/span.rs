//! Spans of time as people write and read them: `90 s`, `12h`, `30d`.

use std::time::Duration;

/// Longest span that can be asked for: a hundred years.
const LONGEST: u64 = 100 * 365 * 86_400;

/// Reads a span: a whole number with `s`, `m`, `h` or `d`.
///
/// # Errors
/// What is expected.
pub(super) fn parse(text: &str) -> Result<Duration, String> {
    let expected = || "expected a whole number with s, m, h or d, such as 12h, above 0 and at most a hundred years".to_owned();
    let text = text.trim();
    let unit = text.chars().last().ok_or_else(expected)?;
    let seconds: u64 = match unit {
        's' => 1,
        'm' => 60,
        'h' => 3600,
        'd' => 86_400,
        _ => return Err(expected()),
    };
    let number: u64 = text[..text.len() - 1].trim().parse().map_err(|_| expected())?;
    let all = number.checked_mul(seconds).filter(|all| (1..=LONGEST).contains(all)).ok_or_else(expected)?;
    Ok(Duration::from_secs(all))
}

/// Tells a span [ms] in its largest fitting unit.
pub(super) fn tell(millis: i64) -> String {
    match millis.max(0) / 1000 {
        seconds @ 0..=119 => format!("{seconds} s"),
        seconds @ 120..=7199 => format!("{} min", seconds / 60),
        seconds @ 7200..=172_799 => format!("{} h", seconds / 3600),
        seconds => format!("{} days", seconds / 86_400),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_read_and_told() {
        for (text, seconds) in [("90s", 90), ("5m", 300), ("12h", 43_200), ("30d", 2_592_000), (" 1 h", 3600)] {
            assert_eq!(parse(text), Ok(Duration::from_secs(seconds)), "{text}");
        }
        for bad in ["", "h", "12", "1.5h", "-1h", "0s", "1w", "99999999999999999999d", "9999999999d", "1ä"] {
            assert!(parse(bad).unwrap_err().contains("such as 12h"), "{bad}");
        }
        for (millis, text) in [(-5, "0 s"), (119_999, "119 s"), (120_000, "2 min"), (7_200_000, "2 h"), (172_800_000, "2 days")] {
            assert_eq!(tell(millis), text);
        }
    }
}
