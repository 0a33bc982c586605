//! The workers that are connected.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use gradfarm_proto::convert::LeaseName;
use gradfarm_proto::{Digest, v1};
use tokio::sync::mpsc;

use super::command::{Hello, SessionKey};
use super::view::WorkerView;
use crate::clock::Timestamp;
use crate::job::{Capabilities, JobId, Needs, WorkerId};
use crate::metrics::WorkerState;
use crate::schedule::Aside;

/// A connected worker.
#[derive(Debug)]
pub(crate) struct Session {
    number: u64,
    outbox: mpsc::Sender<v1::CoordinatorMessage>,
    name: String,
    version: String,
    capabilities: Capabilities,
    /// Samples of the leases that it works on, and when they became that many.
    progress: BTreeMap<LeaseName, (u64, Timestamp)>,
    connected: Timestamp,
    heard: Timestamp,
    /// Leases it would take more.
    pub(crate) credit: u32,
    /// Scenes it has, or was just sent units of.
    pub(crate) scenes: BTreeSet<Digest>,
    delivered: u64,
    failed: u64,
}

/// All connected workers.
#[derive(Debug, Default)]
pub(crate) struct Roster {
    sessions: BTreeMap<WorkerId, Session>,
    /// Workers that failed lately, connected or not: coming back clears nothing.
    asides: BTreeMap<WorkerId, Aside>,
    /// Names of workers, connected or not; the newest ones are remembered.
    names: BTreeMap<WorkerId, String>,
    /// Workers that get nothing new, connected or not: an operator said so.
    resting: BTreeSet<WorkerId>,
    connections: u64,
}

/// Most workers whose failures are remembered.
const REMEMBERED: usize = 10_000;

impl Roster {
    /// A worker connects, for the first time or again.
    pub(crate) fn connect(&mut self, hello: &Hello, outbox: mpsc::Sender<v1::CoordinatorMessage>, now: Timestamp) -> SessionKey {
        self.connections += 1;
        let session = Session {
            number: self.connections,
            outbox,
            name: hello.name.clone(),
            version: hello.version.clone(),
            capabilities: hello.capabilities.clone(),
            progress: BTreeMap::new(),
            connected: now,
            heard: now,
            credit: 0,
            scenes: hello.scenes.iter().copied().collect(),
            delivered: 0,
            failed: 0,
        };
        if self.names.len() >= REMEMBERED {
            // Workers are named in the order of their start.
            self.names.pop_first();
        }
        self.names.insert(hello.worker, hello.name.clone());
        self.sessions.insert(hello.worker, session);
        SessionKey { worker: hello.worker, number: self.connections }
    }

    /// The end of a connection; whether it was the worker's current one.
    pub(crate) fn disconnect(&mut self, key: SessionKey) -> bool {
        let current = self.current(key).is_some();
        if current {
            self.sessions.remove(&key.worker);
        }
        current
    }

    /// The session of this connection, unless a newer one has taken its place.
    pub(crate) fn current(&mut self, key: SessionKey) -> Option<&mut Session> {
        self.sessions.get_mut(&key.worker).filter(|session| session.number == key.number)
    }

    /// A connected worker's session.
    pub(crate) fn get_mut(&mut self, worker: WorkerId) -> Option<&mut Session> {
        self.sessions.get_mut(&worker)
    }

    /// Workers that may be given units of a job with these needs now, in order. If all that have what it needs are set aside, none is: a job
    /// never waits without anybody to do it, and if it is the job that is wrong, its units' failures soon say so. Those that were found to
    /// be wrong come last.
    pub(crate) fn eligible(&self, now: Timestamp, needs: &Needs) -> Vec<WorkerId> {
        let fits = |session: &Session| needs.any_worker() || needs.lacks(&session.capabilities).is_none();
        let awake = self.sessions.iter().filter(|(worker, _)| !self.resting.contains(worker));
        let all: Vec<WorkerId> = awake.filter(|(_, session)| fits(session)).map(|(worker, _)| *worker).collect();
        let of = |which: &dyn Fn(WorkerId) -> bool| all.iter().copied().filter(|worker| which(*worker)).collect::<Vec<_>>();
        let trusted = of(&|worker| self.aside_until(worker, now).is_none());
        if !trusted.is_empty() {
            return trusted;
        }
        let honest = of(&|worker| self.asides.get(&worker).is_none_or(|aside| aside.lies() == 0));
        if honest.is_empty() { all } else { honest }
    }

    /// Workers that would take work, in order.
    pub(crate) fn hungry(&self) -> Vec<WorkerId> {
        self.sessions
            .iter()
            .filter(|(worker, session)| session.credit > 0 && !self.resting.contains(worker))
            .map(|(worker, _)| *worker)
            .collect()
    }

    /// How many are connected.
    pub(crate) fn count(&self) -> usize {
        self.sessions.len()
    }

    /// What those that are connected have to offer.
    pub(crate) fn capabilities(&self) -> impl Iterator<Item = &Capabilities> {
        self.sessions.values().map(|session| &session.capabilities)
    }

    /// What everybody does, in which pool, with how many threads. `busy` tells who holds leases.
    pub(crate) fn states(&self, now: Timestamp, busy: impl Fn(WorkerId) -> bool) -> Vec<(WorkerState, String, u32)> {
        let state = |worker: WorkerId| match () {
            () if self.resting.contains(&worker) => WorkerState::Draining,
            () if self.aside_until(worker, now).is_some() => WorkerState::SetAside,
            () if busy(worker) => WorkerState::Busy,
            () => WorkerState::Idle,
        };
        let of =
            |(worker, session): (&WorkerId, &Session)| (state(*worker), session.capabilities.pool.clone(), session.capabilities.threads);
        self.sessions.iter().map(of).collect()
    }

    /// Leases that came no further for longer than their job's patience. Workers of older versions do not tell, and are never told off.
    pub(crate) fn stuck(&self, now: Timestamp, patience: impl Fn(&JobId) -> Option<Duration>) -> Vec<Stuck> {
        let mut stuck = Vec::new();
        for (worker, session) in &self.sessions {
            for (lease, (samples, since)) in &session.progress {
                let (job, seconds) = (JobId::from_bytes(lease.job), now.seconds_since(*since));
                if patience(&job).is_some_and(|patience| seconds >= patience.as_secs_f64()) {
                    stuck.push(Stuck { worker: *worker, job, unit: lease.unit, epoch: lease.epoch, samples: *samples, seconds });
                }
            }
        }
        stuck
    }

    /// Until when a worker is set aside, if it is.
    pub(crate) fn aside_until(&self, worker: WorkerId, now: Timestamp) -> Option<Timestamp> {
        self.asides.get(&worker)?.until(now)
    }

    /// A result of the worker counted.
    pub(crate) fn praise(&mut self, worker: WorkerId) {
        // What was shown to be wrong is not made good by what nobody checked.
        if self.asides.get(&worker).is_some_and(|aside| aside.lies() == 0) {
            self.asides.remove(&worker);
        }
        if let Some(session) = self.sessions.get_mut(&worker) {
            session.delivered += 1;
        }
    }

    /// A result of the worker was shown to be wrong: it gets nothing for the longest time there is, and its merits are forgotten.
    pub(crate) fn distrust(&mut self, worker: WorkerId, now: Timestamp) {
        self.asides.entry(worker).or_default().lied(now);
    }

    /// Name for people of a worker that connected since this coordinator started.
    pub(crate) fn name(&self, worker: WorkerId) -> Option<&str> {
        self.names.get(&worker).map(String::as_str)
    }

    /// The worker failed a unit.
    pub(crate) fn blame(&mut self, worker: WorkerId, now: Timestamp) {
        if self.asides.len() >= REMEMBERED {
            self.asides.retain(|_, aside| aside.until(now).is_some());
        }
        self.asides.entry(worker).or_default().failed(now);
        if let Some(session) = self.sessions.get_mut(&worker) {
            session.failed += 1;
            if self.asides[&worker].until(now).is_some() {
                tracing::warn!(%worker, name = %session.name, "worker set aside: it failed too often in a row");
            }
        }
    }

    /// Sends to a worker. One that does not read is disconnected: dropping its session ends the stream.
    pub(crate) fn send(&mut self, worker: WorkerId, message: v1::coordinator_message::Message) -> bool {
        let Some(session) = self.sessions.get(&worker) else { return false };
        session.outbox.try_send(v1::CoordinatorMessage { message: Some(message) }).is_ok()
    }

    /// Takes all sessions off, which ends their streams.
    pub(crate) fn dismiss(&mut self) {
        self.announce_stop();
        self.sessions.clear();
    }

    /// Tells all workers that the coordinator is about to stop.
    pub(crate) fn announce_stop(&self) {
        let drain = || v1::CoordinatorMessage { message: Some(v1::coordinator_message::Message::Drain(v1::Drain {})) };
        for session in self.sessions.values() {
            // A worker that does not read learns from the end of the stream.
            let _full = session.outbox.try_send(drain());
        }
    }

    /// Who gets nothing new, whatever they ask for.
    pub(crate) fn set_resting(&mut self, resting: BTreeSet<WorkerId>) {
        for worker in self.resting.symmetric_difference(&resting) {
            tracing::info!(%worker, rests = resting.contains(worker), "worker");
        }
        self.resting = resting;
    }

    /// What people see. `leases` tells how many leases a worker holds.
    pub(crate) fn views(&self, now: Timestamp, leases: impl Fn(WorkerId) -> u64) -> Vec<WorkerView> {
        let view = |(id, session): (&WorkerId, &Session)| WorkerView {
            id: *id,
            name: session.name.clone(),
            version: session.version.clone(),
            threads: session.capabilities.threads,
            capabilities: session.capabilities.clone(),
            connected: session.connected,
            heard: session.heard,
            leases: leases(*id),
            delivered: session.delivered,
            failed: session.failed,
            set_aside_until: self.aside_until(*id, now),
            draining: self.resting.contains(id),
            lies: self.asides.get(id).map_or(0, Aside::lies),
        };
        self.sessions.iter().map(view).collect()
    }
}

/// A lease that came no further.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stuck {
    pub(crate) worker: WorkerId,
    pub(crate) job: JobId,
    pub(crate) unit: u32,
    pub(crate) epoch: u32,
    /// How far it is.
    pub(crate) samples: u64,
    /// For how long [s].
    pub(crate) seconds: f64,
}

impl Session {
    /// The worker told how far the leases are that it works on.
    pub(crate) fn note_progress(&mut self, told: &[(LeaseName, u64)], now: Timestamp) {
        let before = std::mem::take(&mut self.progress);
        let since = |lease: &LeaseName, samples: u64| before.get(lease).filter(|known| known.0 == samples).map_or(now, |known| known.1);
        self.progress = told.iter().map(|(lease, samples)| (*lease, (*samples, since(lease, *samples)))).collect();
    }

    /// The worker gave a sign of life.
    pub(crate) fn hear(&mut self, now: Timestamp) {
        self.heard = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hello(worker: u8, pool: &str) -> Hello {
        Hello {
            worker: WorkerId::from_bytes([worker; 16]),
            protocol: 1,
            name: format!("worker {worker}"),
            version: String::new(),
            capabilities: Capabilities { pool: pool.into(), ..Capabilities::default() },
            held: Vec::new(),
            scenes: Vec::new(),
        }
    }

    #[test]
    fn a_lease_is_stuck_when_its_samples_stand_still() {
        let mut roster = Roster::default();
        let at = |seconds: i64| Timestamp::from_millis(1000 * seconds);
        let key = roster.connect(&hello(1, ""), mpsc::channel(1).0, at(0));
        let lease = |unit| LeaseName { job: [3; 16], unit, epoch: 2 };
        let patience = |_: &JobId| Some(Duration::from_secs(60));
        for (now, moving) in [(0, 10), (30, 20), (59, 30)] {
            roster.current(key).unwrap().note_progress(&[(lease(0), moving), (lease(1), 7)], at(now));
            assert!(roster.stuck(at(now), patience).is_empty());
        }
        let stuck = roster.stuck(at(60), patience);
        let [stuck] = stuck[..] else { panic!("{stuck:?}") };
        assert_eq!((stuck.unit, stuck.epoch, stuck.samples, stuck.seconds), (1, 2, 7, 60.0));
        assert!(roster.stuck(at(60), |_| None).is_empty(), "of a job that is gone");
        roster.current(key).unwrap().note_progress(&[(lease(0), 30)], at(61));
        assert!(roster.stuck(at(100), patience).is_empty(), "what it no longer works on is not stuck");
    }

    #[test]
    fn who_may_is_never_set_aside_altogether_and_liars_come_last() {
        let mut roster = Roster::default();
        let (now, ids) = (Timestamp::from_millis(1000), [1, 2, 3].map(|k| WorkerId::from_bytes([k; 16])));
        for (k, pool) in [(1, "night"), (2, "night"), (3, "day")] {
            roster.connect(&hello(k, pool), mpsc::channel(1).0, now);
        }
        let night = Needs { pools: ["night".into()].into(), ..Needs::default() };
        assert_eq!(roster.eligible(now, &Needs::default()), ids);
        assert_eq!(roster.eligible(now, &night), ids[..2]);
        roster.distrust(ids[0], now);
        assert_eq!(roster.eligible(now, &night), ids[1..2]);
        (0..3).for_each(|_| roster.blame(ids[1], now));
        assert_eq!(roster.eligible(now, &night), ids[1..2], "rather who fails than who lies");
        assert_eq!(roster.eligible(now, &Needs::default()), ids[2..]);
        roster.praise(ids[0]);
        assert!(roster.aside_until(ids[0], now).is_some(), "a lie is not made good by what nobody checked");
    }
}
