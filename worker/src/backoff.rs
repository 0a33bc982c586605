//! How long to wait before trying again: longer each time, and never the same for two workers.

use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

/// Waits between tries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Backoff {
    next: Duration,
}

impl Backoff {
    const FIRST: Duration = Duration::from_millis(100);
    const LONGEST: Duration = Duration::from_secs(5);

    /// Before the first failure.
    pub(crate) fn new() -> Self {
        Self { next: Self::FIRST }
    }

    /// After a success.
    pub(crate) fn reset(&mut self) {
        *self = Self::new();
    }

    /// How long to wait now: between half and all of a span that doubles up to 5 s.
    pub(crate) fn wait(&mut self) -> Duration {
        let span = self.next;
        self.next = (span * 2).min(Self::LONGEST);
        // The hasher's keys are random; workers that lost the same coordinator must not come back all at once.
        let fraction = (RandomState::new().hash_one(0) >> 11) as f64 / (1u64 << 53) as f64;
        span.mul_f64(0.5 + 0.5 * fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_grow_to_a_bound_and_differ() {
        let mut backoff = Backoff::new();
        let waits: Vec<Duration> = (0..20).map(|_| backoff.wait()).collect();
        assert!(waits[0] >= Backoff::FIRST / 2 && waits[0] <= Backoff::FIRST);
        assert!(waits.iter().all(|wait| *wait <= Backoff::LONGEST));
        assert!(waits[19] >= Backoff::LONGEST / 2);
        assert!(waits[10..].windows(2).any(|pair| pair[0] != pair[1]));
        backoff.reset();
        assert!(backoff.wait() <= Backoff::FIRST);
    }
}
