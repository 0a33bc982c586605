//! Counts what became durable: the changes of a turn, after their commit.

use std::collections::BTreeMap;

use super::Metrics;
use crate::job::{Change, JobId, Timestamp};

/// Since when leases are held.
#[derive(Debug, Default)]
pub(crate) struct Ledger {
    since: BTreeMap<(JobId, u32), Timestamp>,
}

impl Ledger {
    /// Since when a lease is held, as far as this coordinator has seen; from `now` on if it has not.
    pub(crate) fn since(&mut self, job: JobId, unit: u32, now: Timestamp) -> Timestamp {
        *self.since.entry((job, unit)).or_insert(now)
    }

    /// Keeps leases alone that are held.
    pub(crate) fn retain(&mut self, held: impl Fn(JobId, u32) -> bool) {
        self.since.retain(|(job, unit), _| held(*job, *unit));
    }
}

impl Metrics {
    /// Counts changes that are durable.
    pub(crate) fn count(&self, changes: &[Change], ledger: &mut Ledger, now: Timestamp) {
        for change in changes {
            match change {
                Change::Submitted(_) => drop(self.jobs_submitted.inc()),
                Change::Job { state, .. } if state.is_final() => {
                    self.jobs_finished.get_or_create(&[("state", state.name().to_owned())]).inc();
                }
                Change::Leased { job, unit, epoch, at, .. } => {
                    self.grants.inc();
                    if *epoch > 1 {
                        self.retries.inc();
                    }
                    ledger.since.insert((*job, *unit), *at);
                }
                Change::Delivered { job, unit, result, .. } => {
                    self.completions.inc();
                    self.render_seconds.inc_by(result.render);
                    if let Some(since) = ledger.since.remove(&(*job, *unit)) {
                        self.lease_seconds.observe(now.seconds_since(since));
                    }
                }
                Change::Freed { job, unit, given_up, .. } => {
                    self.returned.inc();
                    if *given_up {
                        self.given_up.inc();
                    }
                    ledger.since.remove(&(*job, *unit));
                }
                Change::Witness { job, unit, .. } => drop(ledger.since.remove(&(*job, *unit))),
                Change::Attempt { attempt, .. } => {
                    self.attempts.get_or_create(&[("ending", attempt.ending.name().to_owned())]).inc();
                }
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{DeliveredRecord, WorkerId};
    use gradfarm_proto::Digest;

    #[test]
    fn a_unit_that_is_lost_and_done_is_counted_once_each_time() {
        let (metrics, mut ledger) = (Metrics::default(), Ledger::default());
        let (job, worker, at) = (JobId::from_bytes([1; 16]), WorkerId::fresh(), |seconds: i64| Timestamp::from_millis(1000 * seconds));
        let content = Digest::of(b"x");
        let result = DeliveredRecord { content, blob: content, size: 1, load: 0.0, compile: 0.0, render: 1.5 };
        let turns = [
            (Change::Leased { job, unit: 3, epoch: 1, worker, at: at(0) }, 0),
            (Change::Freed { job, unit: 3, failures: 0, losses: 1, given_up: false }, 2),
            (Change::Leased { job, unit: 3, epoch: 2, worker, at: at(5) }, 5),
            (Change::Delivered { job, unit: 3, epoch: 2, worker, result }, 9),
        ];
        turns.into_iter().for_each(|(change, seconds)| metrics.count(&[change], &mut ledger, at(seconds)));
        assert_eq!((metrics.grants.get(), metrics.retries.get(), metrics.returned.get(), metrics.completions.get()), (2, 1, 1, 1));
        assert!(metrics.text().contains("gradfarm_lease_seconds_sum 4.0\n"), "{}", metrics.text());
        assert_eq!(metrics.render_seconds.get(), 1.5);
        assert!(ledger.since.is_empty());
    }
}
