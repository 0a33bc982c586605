//! What is so at this moment: read from the loop whenever somebody asks, so that no gauge can drift from what it shows.

use std::collections::BTreeMap;

use super::Metrics;
use crate::job::JobState;
use crate::store::Traffic;

/// Pools that are told apart; the rest is one more.
const POOLS: usize = 50;
/// Seconds of a unit as long as nothing is known of any.
const GUESS: f64 = 1.0;

/// What a worker does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum WorkerState {
    Busy,
    Idle,
    Draining,
    SetAside,
}

impl WorkerState {
    fn name(self) -> &'static str {
        match self {
            WorkerState::Busy => "busy",
            WorkerState::Idle => "idle",
            WorkerState::Draining => "draining",
            WorkerState::SetAside => "set_aside",
        }
    }
}

/// The state of the loop.
#[derive(Clone, Debug, Default)]
pub(crate) struct Snapshot {
    pub(crate) draining: bool,
    /// Jobs by state; paused ones by themselves.
    pub(crate) jobs: BTreeMap<&'static str, u64>,
    /// Units of jobs that are not over: ready, leased, done, given up.
    pub(crate) units: [u64; 4],
    /// Units that could be granted now, with the seconds that one takes where that is known.
    pub(crate) queue: Vec<(u64, f64)>,
    /// Age of the oldest lease [s].
    pub(crate) oldest_lease: f64,
    /// Workers: state, pool, threads.
    pub(crate) workers: Vec<(WorkerState, String, u32)>,
}

impl Snapshot {
    /// Units that could be granted, and how long they take on one thread: jobs of which nothing is done are as long as the others.
    fn queue(&self) -> (u64, f64) {
        let known = self.queue.iter().filter(|(_, seconds)| *seconds > 0.0);
        let (units, sum) = known.fold((0, 0.0), |(units, sum), (count, seconds)| (units + count, sum + *count as f64 * seconds));
        let usual = if units > 0 { sum / units as f64 } else { GUESS };
        let seconds = |(count, seconds): &(u64, f64)| *count as f64 * if *seconds > 0.0 { *seconds } else { usual };
        (self.queue.iter().map(|(count, _)| count).sum(), self.queue.iter().map(seconds).sum())
    }
}

impl Metrics {
    /// Everything in words, with the state as it is now.
    pub(crate) async fn scrape(&self, now: Snapshot, traffic: &Traffic) -> String {
        let _one_at_a_time = self.scrape.lock().await;
        self.draining.set(i64::from(now.draining));
        for name in JobState::ALL.map(JobState::name).into_iter().chain(["paused"]) {
            self.jobs.get_or_create(&[("state", name.to_owned())]).set(now.jobs.get(name).copied().unwrap_or(0) as i64);
        }
        for (name, count) in ["ready", "leased", "done", "given_up"].into_iter().zip(now.units) {
            self.units.get_or_create(&[("state", name.to_owned())]).set(count as i64);
        }
        let (units, seconds) = now.queue();
        self.queue_units.set(units as i64);
        self.queue_seconds.set(seconds);
        self.oldest_lease.set(now.oldest_lease);
        self.workers.clear();
        self.worker_slots.clear();
        let mut pools = Vec::new();
        for (state, pool, threads) in now.workers {
            if !pools.contains(&pool) && pools.len() < POOLS {
                pools.push(pool.clone());
            }
            let pool = if pools.contains(&pool) { pool } else { "other".to_owned() };
            self.workers.get_or_create(&[("state", state.name().to_owned()), ("pool", pool.clone())]).inc();
            self.worker_slots.get_or_create(&[("pool", pool)]).inc_by(i64::from(threads));
        }
        let counted = traffic.counted();
        self.blob_written.inner().store(counted.written, std::sync::atomic::Ordering::Relaxed);
        self.blob_read.inner().store(counted.read, std::sync::atomic::Ordering::Relaxed);
        self.blobs.set(counted.stock as i64);
        self.blobs_bytes.set(counted.stock_bytes as i64);
        self.text()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_of_which_nothing_is_known_are_as_long_as_the_others() {
        let queue = |queue: &[(u64, f64)]| Snapshot { queue: queue.to_vec(), ..Snapshot::default() }.queue();
        assert_eq!(queue(&[]), (0, 0.0));
        assert_eq!(queue(&[(10, 0.0)]), (10, 10.0));
        assert_eq!(queue(&[(10, 0.0), (3, 2.0), (1, 6.0)]), (14, 12.0 + 30.0));
    }

    #[tokio::test]
    async fn pools_beyond_the_bound_are_one() {
        let workers = (0..60).map(|k| (WorkerState::Idle, format!("pool-{k}"), 2)).collect();
        let snapshot = Snapshot { workers, ..Snapshot::default() };
        let metrics = Metrics::default();
        for _ in 0..2 {
            let text = metrics.scrape(snapshot.clone(), &Traffic::default()).await;
            assert_eq!(text.lines().filter(|line| line.starts_with("gradfarm_workers{")).count(), POOLS + 1);
            assert!(text.contains(r#"gradfarm_worker_slots{pool="other"} 20"#), "{text}");
        }
    }
}
