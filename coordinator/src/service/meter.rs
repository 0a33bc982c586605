//! What the loop looks like at this moment, for its metrics.

use super::dispatch::Dispatcher;
use super::handle::Handle;
use crate::error::Error;
use crate::job::JobState;
use crate::metrics::{Metrics, Snapshot};

impl Dispatcher {
    fn snapshot(&mut self) -> Snapshot {
        let now = self.now();
        let mut snapshot = Snapshot { draining: self.draining, ..Snapshot::default() };
        for job in self.jobs.values() {
            let state = if job.paused && !job.state.is_final() { "paused" } else { JobState::name(job.state) };
            *snapshot.jobs.entry(state).or_insert(0) += 1;
        }
        let mut oldest = now;
        for (id, job) in self.open.iter().filter_map(|id| Some((*id, self.jobs.get(id)?))) {
            let given_up: u32 = job.frames.iter().map(|frame| frame.failed_units).sum();
            let counts = [job.ready() as u64, job.leases() as u64, job.units_done(), u64::from(given_up)];
            snapshot.units.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
            if job.has_open_units() {
                snapshot.queue.push((job.open_units().count() as u64, job.usual_seconds()));
            }
            for (unit, _) in job.leased() {
                oldest = oldest.min(self.ledger.since(id, unit, now));
            }
        }
        snapshot.oldest_lease = now.seconds_since(oldest);
        let (jobs, ledger) = (&self.jobs, &mut self.ledger);
        let is_leased = |unit: &crate::job::Unit| matches!(unit.state, crate::job::UnitState::Leased { .. });
        ledger.retain(|job, unit| jobs.get(&job).and_then(|job| job.unit(unit)).is_some_and(is_leased));
        snapshot.workers = self.roster.states(now, |worker| self.lease_count(worker) > 0);
        snapshot
    }
}

impl Handle {
    /// What is counted and measured.
    pub fn metrics(&self) -> &Metrics {
        &self.metrics
    }

    /// All metrics, in the text format that Prometheus reads.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub async fn scrape(&self) -> Result<String, Error> {
        let snapshot = self.look(Dispatcher::snapshot).await?;
        Ok(self.metrics.scrape(snapshot, self.blobs.traffic()).await)
    }
}
