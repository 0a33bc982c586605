//! Whether a frame goes on: a pure function of its points, so that whoever has the same points decides alike.
//!
//! Two dangers. An estimate is noisy, and asking it often finds a lucky one in the end: so the estimate's bound counts as well as itself, and
//! from one check to the next the samples grow by a quarter at least. And a prediction from few samples may be far too large: so they do no
//! more than double while an error is wanted.

use super::{Cost, Fit, Point, Stop};

/// What follows from a frame's points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The frame is good as it is.
    Stop(Reason),
    /// On to so many samples per pixel.
    Continue {
        /// In all, more than there are.
        samples: u32,
    },
}

/// Why a frame stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reason {
    /// Its error is what was asked for.
    Error,
    /// Its time is up.
    Seconds,
    /// It has all samples that the plan allows.
    Samples,
}

impl Reason {
    /// Every reason.
    pub const ALL: [Reason; 3] = [Reason::Error, Reason::Seconds, Reason::Samples];

    /// Its name in reports, JSON and the store.
    pub fn name(self) -> &'static str {
        match self {
            Reason::Error => "error",
            Reason::Seconds => "seconds",
            Reason::Samples => "samples",
        }
    }
}

/// Least growth of the samples from one check to the next.
const LEAST_GROWTH: f64 = 1.25;
/// Most growth where an error is wanted, or the curve.
const MOST_GROWTH: f64 = 2.0;
/// The same where only time counts: then checks merely tell how fast it goes.
const TIMED_GROWTH: f64 = 4.0;
/// What is added to a predicted number of samples, so that one check more is the exception.
const MARGIN: f64 = 1.05;
/// Batches before the first check: both halves need enough samples to tell their differences.
const FIRST: u32 = 2;

/// Samples per pixel at the first check, of a frame of at most `cap` that is rendered in batches.
pub fn first_check(cap: u32, batch: u32) -> u32 {
    batch.saturating_mul(FIRST).clamp(1, cap.max(1))
}

/// What follows from the points of a frame, the last of which was just measured: whole batches, at most `cap` samples per pixel.
pub fn verdict(stop: &Stop, cap: u32, batch: u32, points: &[Point]) -> Verdict {
    let Some(last) = points.last() else { return Verdict::Continue { samples: first_check(cap, batch) } };
    if stop.is_met_by(last) {
        return Verdict::Stop(Reason::Error);
    }
    if last.samples >= cap {
        return Verdict::Stop(Reason::Samples);
    }
    let n = f64::from(last.samples);
    let timed_only = stop.seconds.is_some() && stop.error.is_none() && !stop.curve;
    let most = n * if timed_only { TIMED_GROWTH } else { MOST_GROWTH };
    let mut wanted = match stop.error {
        Some(target) => needed(target, last, points).unwrap_or(most),
        None => most,
    };
    wanted = wanted.clamp(n * LEAST_GROWTH, most);
    let mut samples = whole(wanted, batch).max(last.samples.saturating_add(1)).min(cap);
    if let Some(budget) = stop.seconds {
        let fits = affordable(budget, last, points);
        let batches = (libm::floor(fits / f64::from(batch.max(1))) * f64::from(batch.max(1))).min(f64::from(cap)) as u32;
        let most = if fits >= f64::from(cap) { cap } else { last.samples.saturating_add(batches).min(cap) };
        if most <= last.samples {
            return Verdict::Stop(Reason::Seconds);
        }
        // What is left after the next check should be worth another one.
        let rest_is_small = f64::from(most) < f64::from(samples) * LEAST_GROWTH;
        samples = if samples > most || (timed_only && rest_is_small) { most } else { samples };
    }
    Verdict::Continue { samples }
}

/// Samples per pixel with which the target should be met, by the law through all points and by the last interval.
fn needed(target: f64, last: &Point, points: &[Point]) -> Option<f64> {
    let fit = Fit::of(points)?;
    let excess = (last.error.bound() / (Stop::SURE * target)).max(last.error.relmse / target);
    let by_last = if last.is_sound() && excess > 1.0 { f64::from(last.samples) * libm::pow(excess, -1.0 / fit.slope) } else { 0.0 };
    Some(MARGIN * fit.samples_for(target).max(by_last))
}

/// Further samples per pixel for which there is time, one more check included.
fn affordable(budget: f64, last: &Point, points: &[Point]) -> f64 {
    let Some(cost) = Cost::of(points) else { return 0.0 };
    let left = budget - last.wall_seconds - last.check_seconds;
    if left <= 0.0 { 0.0 } else { left / cost.each.max(1e-9) }
}

/// With how many samples per pixel a frame will stop, as far as its points tell: for progress and for people, nothing depends on it.
/// `open` of them are being rendered.
pub fn expected_samples(stop: &Stop, cap: u32, open: u32, points: &[Point]) -> u32 {
    let by_error = stop.error.zip(points.last()).and_then(|(target, last)| needed(target, last, points));
    let by_time = stop.seconds.zip(Cost::of(points)).map(|(budget, cost)| (budget - cost.fixed) / cost.each.max(1e-9));
    let end = match (by_error, by_time) {
        (Some(error), Some(time)) => error.min(time),
        (Some(samples), None) | (None, Some(samples)) => samples,
        (None, None) if stop.ends_early() => f64::from(open),
        (None, None) => f64::from(cap),
    };
    (end.clamp(0.0, f64::from(u32::MAX)) as u32).clamp(open.min(cap), cap)
}

/// Rounded up to whole batches.
fn whole(samples: f64, batch: u32) -> u32 {
    let batch = f64::from(batch.max(1));
    (libm::ceil(samples / batch) * batch).clamp(batch, f64::from(u32::MAX)) as u32
}

#[cfg(test)]
mod tests {
    use super::super::Estimate;
    use super::super::fit::tests::point;
    use super::*;

    const CAP: u32 = 65_536;

    fn until(error: f64) -> Stop {
        Stop { error: Some(error), ..Stop::default() }
    }

    /// Runs a frame whose error is known until it stops: the samples at each check, and why it stopped.
    fn run(stop: &Stop, cap: u32, at: impl Fn(u32) -> Point) -> (Vec<u32>, Reason) {
        let mut points = vec![at(first_check(cap, 16))];
        loop {
            match verdict(stop, cap, 16, &points) {
                Verdict::Stop(reason) => return (points.iter().map(|point| point.samples).collect(), reason),
                Verdict::Continue { samples } => {
                    let last = points.last().unwrap().samples;
                    assert!(samples > last && samples <= cap && (samples.is_multiple_of(16) || samples == cap));
                    points.push(at(samples));
                }
            }
        }
    }

    #[test]
    fn a_known_law_is_followed_to_the_target_and_not_far_beyond() {
        for (target, needs) in [(0.1, 32), (0.01, 100), (1e-3, 1000), (2e-4, 5000)] {
            let (checks, reason) = run(&until(target), CAP, |n| point(n, 1.0, -1.0, 0.1));
            let last = *checks.last().unwrap();
            assert_eq!(reason, Reason::Error);
            assert!(last >= needs && f64::from(last) <= f64::from(needs) * 1.25 + 16.0, "{target}: {checks:?}");
        }
    }

    #[test]
    fn a_wide_interval_is_not_believed() {
        let (checks, _) = run(&until(0.01), CAP, |n| point(n, 1.0, -1.0, 0.9));
        // Estimate at the target with 100 samples; its bound, 1.9^0.65 times it, is within 1.3 times the target with 117.
        assert!((117..170).contains(checks.last().unwrap()), "{checks:?}");
        let lucky = Point { error: Estimate { relmse: 0.001, low: 0.0, high: 0.9 }, ..point(32, 1.0, -1.0, 0.0) };
        assert!(matches!(verdict(&until(0.01), CAP, 16, &[lucky]), Verdict::Continue { .. }));
    }

    #[test]
    fn what_cannot_be_reached_ends_with_the_samples() {
        let (checks, reason) = run(&until(1e-9), 1000, |n| point(n, 1.0, -1.0, 0.1));
        assert_eq!((checks.last(), reason), (Some(&1000), Reason::Samples));
        let (checks, reason) = run(&Stop { curve: true, ..Stop::default() }, 100, |n| point(n, 1.0, -1.0, 0.1));
        assert_eq!((checks.as_slice(), reason), (&[32, 64, 100][..], Reason::Samples));
        let (checks, _) = run(&until(0.1), 5, |n| point(n, 1.0, -1.0, 0.1));
        assert_eq!(checks, [5]);
    }

    #[test]
    fn time_is_used_and_not_exceeded() {
        // Half a second to start, then ten samples a second: 20 s allow 195, and whole batches of them.
        let stop = Stop { seconds: Some(20.0), ..Stop::default() };
        let (checks, reason) = run(&stop, CAP, |n| point(n, 1.0, -1.0, 0.1));
        assert_eq!(reason, Reason::Seconds);
        let last = *checks.last().unwrap();
        assert!((160..=195).contains(&last), "{checks:?}");
        let late = Point { wall_seconds: 21.0, ..point(32, 1.0, -1.0, 0.1) };
        assert_eq!(verdict(&stop, CAP, 16, &[late]), Verdict::Stop(Reason::Seconds));
        let both = Stop { error: Some(0.02), ..stop };
        assert_eq!(run(&both, CAP, |n| point(n, 1.0, -1.0, 0.05)).1, Reason::Error);
        let both = Stop { error: Some(0.002), ..stop };
        assert_eq!(run(&both, CAP, |n| point(n, 1.0, -1.0, 0.05)).1, Reason::Seconds);
    }

    #[test]
    fn the_end_is_told_in_advance() {
        let points = [32, 64].map(|n| point(n, 1.0, -1.0, 0.05));
        let expected = |stop: &Stop| expected_samples(stop, CAP, 128, &points);
        assert!((1000..1100).contains(&expected(&until(1e-3))), "{}", expected(&until(1e-3)));
        assert_eq!((expected(&until(0.5)), expected(&until(1e-12))), (128, CAP));
        let timed = Stop { seconds: Some(40.5), ..Stop::default() };
        assert!((399..=401).contains(&expected(&timed)));
        assert_eq!(expected(&Stop { error: Some(1e-3), ..timed }), expected(&timed));
        assert_eq!((expected_samples(&timed, CAP, 32, &[]), expected_samples(&Stop::default(), 64, 64, &[])), (32, 64));
    }

    #[test]
    fn an_error_of_nothing_is_reached_and_nonsense_is_not() {
        let black = Point { error: Estimate { relmse: 0.0, low: 0.0, high: 0.0 }, ..point(32, 1.0, -1.0, 0.0) };
        assert_eq!(verdict(&until(0.01), CAP, 16, &[black]), Verdict::Stop(Reason::Error));
        let broken = Point { error: Estimate { relmse: f64::NAN, ..black.error }, ..black };
        assert_eq!(verdict(&until(0.01), CAP, 16, &[broken]), Verdict::Continue { samples: 64 });
    }

    #[test]
    fn times_do_not_matter_where_only_the_error_does() {
        let at = |n, clock: f64| {
            let point = point(n, 1.0, -0.9, 0.2);
            Point { cpu_seconds: clock, wall_seconds: clock * 3.0, check_seconds: clock, ..point }
        };
        assert_eq!(run(&until(0.003), CAP, |n| at(n, 1.0)), run(&until(0.003), CAP, |n| at(n, f64::from(n) * 77.0)));
    }
}
