//! When frames stop, as it was asked, and how many samples they may have until then.

use super::PlanError;
use crate::accuracy::Stop;

/// Samples per pixel where nothing else was asked.
pub(super) const DEFAULT_SAMPLES: u32 = 64;
/// Most samples per pixel where only an error or a time was asked for.
const MOST_UNASKED: u32 = 65_536;
/// Longest time for a frame [s]: thirty days.
const LONGEST: f64 = 30.0 * 86_400.0;

/// The samples of every pixel, at most where the frame may stop before; and why.
pub(super) fn samples(asked: Option<u32>, stop: &Stop) -> (u32, String) {
    let bound = if stop.ends_early() { " at most" } else { "" };
    match asked {
        Some(samples) => (samples, format!("{samples} samples per pixel{bound}: asked for")),
        None => {
            let samples = if stop.ends_early() { MOST_UNASKED } else { DEFAULT_SAMPLES };
            (samples, format!("{samples} samples per pixel{bound}: the default"))
        }
    }
}

/// Checks the rule, and says what it means.
pub(super) fn rule(stop: &Stop, rounds: u32, reasons: &mut Vec<String>) -> Result<(), PlanError> {
    if let Some(error) = stop.error {
        if !(error.is_finite() && error > 0.0) {
            let expected = "a finite number above 0, such as 0.01".to_string();
            return Err(PlanError::OutOfRange { what: "error to reach", found: error.to_string(), expected });
        }
        reasons.push(format!(
            "a frame stops when its estimated relMSE is at most {error} and very probably at most {:.1} times that: asked for",
            Stop::SURE
        ));
    }
    if let Some(seconds) = stop.seconds {
        if !(seconds > 0.0 && seconds <= LONGEST) {
            let expected = format!("a number above 0, at most {LONGEST}");
            return Err(PlanError::OutOfRange { what: "seconds for a frame", found: seconds.to_string(), expected });
        }
        reasons.push(format!("a frame stops so that its image is there {seconds} s after its first unit was leased: asked for"));
        let again = if rounds > 1 { "as many with the curve measured" } else { "as many" };
        reasons.push(format!("where time decides, the samples say what was decided: asking for {again} gives the same bits again"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(error: Option<f64>, seconds: Option<f64>) -> Stop {
        Stop { error, seconds, curve: false }
    }

    #[test]
    fn targets_leave_room_for_samples() {
        assert_eq!(samples(None, &Stop::default()).0, DEFAULT_SAMPLES);
        assert_eq!(samples(None, &Stop { curve: true, ..Stop::default() }).0, DEFAULT_SAMPLES);
        for stop in [asked(Some(0.01), None), asked(None, Some(5.0))] {
            assert_eq!(samples(None, &stop), (MOST_UNASKED, format!("{MOST_UNASKED} samples per pixel at most: the default")));
            assert_eq!(samples(Some(7), &stop), (7, "7 samples per pixel at most: asked for".to_string()));
        }
    }

    #[test]
    fn rules_are_told_and_nonsense_refused() {
        let mut reasons = Vec::new();
        rule(&asked(Some(0.01), Some(5.0)), 1, &mut reasons).unwrap();
        let told = reasons.join("\n");
        assert!(told.contains("estimated relMSE is at most 0.01") && told.contains("image is there 5 s after"), "{told}");
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let refused = |stop| rule(&stop, 1, &mut Vec::new()).unwrap_err().to_string();
            assert!(refused(asked(Some(bad), None)).starts_with("error to reach: found"), "{bad}");
            assert!(refused(asked(None, Some(bad))).starts_with("seconds for a frame: found"), "{bad}");
        }
        rule(&asked(None, Some(0.1)), 2, &mut reasons).unwrap();
        assert!(reasons.last().unwrap().contains("as many with the curve measured"), "{reasons:?}");
        assert!(rule(&Stop::default(), 2, &mut Vec::new()).is_ok());
    }
}
