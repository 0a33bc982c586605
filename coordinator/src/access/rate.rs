//! How often somebody may ask: a bucket that fills at a steady rate and empties with every request.

use std::collections::HashMap;

use crate::clock::Timestamp;

/// Buckets that are remembered; when there are more, full ones are forgotten.
const REMEMBERED: usize = 10_000;

/// How fast a bucket fills, and how much it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rate {
    /// Requests that are always borne [1/s].
    pub(crate) per_second: f64,
    /// Requests that may come at once.
    pub(crate) burst: f64,
}

#[derive(Clone, Copy, Debug)]
struct Bucket {
    level: f64,
    at: Timestamp,
}

/// A bucket for each of those who ask.
#[derive(Debug, Default)]
pub(crate) struct Buckets {
    all: HashMap<String, Bucket>,
}

impl Buckets {
    /// Takes one out of somebody's bucket.
    ///
    /// # Errors
    /// If it is empty: in how many seconds there is one again.
    pub(crate) fn take(&mut self, who: &str, rate: Rate, now: Timestamp) -> Result<(), f64> {
        if self.all.len() >= REMEMBERED && !self.all.contains_key(who) {
            self.all.retain(|_, bucket| bucket.level + now.seconds_since(bucket.at) * rate.per_second < rate.burst);
        }
        let bucket = self.all.entry(who.to_owned()).or_insert(Bucket { level: rate.burst, at: now });
        bucket.level = (bucket.level + now.seconds_since(bucket.at) * rate.per_second).min(rate.burst);
        bucket.at = now;
        if bucket.level < 1.0 {
            return Err((1.0 - bucket.level) / rate.per_second);
        }
        bucket.level -= 1.0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bursts_are_borne_and_floods_are_not() {
        let rate = Rate { per_second: 2.0, burst: 5.0 };
        let at = Timestamp::from_millis;
        let mut buckets = Buckets::default();
        assert!((0..5).all(|_| buckets.take("anna", rate, at(0)).is_ok()));
        assert_eq!(buckets.take("anna", rate, at(0)), Err(0.5));
        assert!(buckets.take("bert", rate, at(0)).is_ok(), "everybody has a bucket");
        assert_eq!(buckets.take("anna", rate, at(500)), Ok(()));
        assert!(buckets.take("anna", rate, at(500)).is_err());
        // A long rest fills it to the brim, not above.
        assert_eq!((0..9).filter(|_| buckets.take("anna", rate, at(1_000_000)).is_ok()).count(), 5);
    }

    #[test]
    fn strangers_without_number_do_not_fill_the_memory() {
        let rate = Rate { per_second: 1000.0, burst: 1.0 };
        let mut buckets = Buckets::default();
        for k in 0..5 * REMEMBERED {
            buckets.take(&k.to_string(), rate, Timestamp::from_millis(k as i64)).unwrap();
        }
        assert!(buckets.all.len() <= REMEMBERED + 1, "{}", buckets.all.len());
    }
}
