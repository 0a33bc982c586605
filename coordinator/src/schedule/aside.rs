//! Sets a worker aside that fails unit after unit, and forgives it in time.

use std::time::Duration;

use crate::clock::Timestamp;

/// How a worker has been doing lately.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Aside {
    in_a_row: u32,
    times: u32,
    until: Option<Timestamp>,
    lies: u32,
}

impl Aside {
    /// Failures in a row that set a worker aside.
    pub const FAILURES: u32 = 3;
    /// How long, the first time; each further time it is twice as long.
    pub const FIRST: Duration = Duration::from_secs(10);
    /// The longest.
    pub const LONGEST: Duration = Duration::from_secs(600);

    /// The worker failed a unit.
    pub fn failed(&mut self, now: Timestamp) {
        self.in_a_row += 1;
        if self.in_a_row >= Self::FAILURES {
            let span = Self::FIRST.saturating_mul(1 << self.times.min(10)).min(Self::LONGEST);
            self.until = Some(now + span);
            self.times += 1;
            self.in_a_row = 0;
        }
    }

    /// A result of the worker was shown to be wrong.
    pub fn lied(&mut self, now: Timestamp) {
        self.lies += 1;
        self.until = Some(now + Self::LONGEST);
    }

    /// Results of the worker that were shown to be wrong.
    pub fn lies(&self) -> u32 {
        self.lies
    }

    /// A result of the worker counted: all is forgiven.
    pub fn succeeded(&mut self) {
        *self = Self::default();
    }

    /// Until when it gets nothing, if it is set aside now.
    pub fn until(&self, now: Timestamp) -> Option<Timestamp> {
        self.until.filter(|until| *until > now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_in_a_row_and_longer_each_time() {
        let now = Timestamp::from_millis(1_000);
        let mut aside = Aside::default();
        aside.failed(now);
        aside.failed(now);
        assert_eq!(aside.until(now), None);
        aside.failed(now);
        assert_eq!(aside.until(now), Some(now + Aside::FIRST));
        let later = now + Aside::FIRST;
        assert_eq!(aside.until(later), None, "forgiven in time");
        for _ in 0..3 {
            aside.failed(later);
        }
        assert_eq!(aside.until(later), Some(later + Aside::FIRST * 2));
        aside.succeeded();
        assert_eq!(aside.until(later), None);
        for _ in 0..100 {
            aside.failed(later);
        }
        assert!(aside.until(later) <= Some(later + Aside::LONGEST));
    }
}
