//! The workers that are connected.

use std::collections::{BTreeMap, BTreeSet};

use gradfarm_proto::{Digest, v1};
use tokio::sync::mpsc;

use super::command::{Hello, SessionKey};
use super::view::WorkerView;
use crate::clock::Timestamp;
use crate::job::WorkerId;
use crate::schedule::Aside;

/// A connected worker.
#[derive(Debug)]
pub(crate) struct Session {
    number: u64,
    outbox: mpsc::Sender<v1::CoordinatorMessage>,
    name: String,
    version: String,
    threads: u32,
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
            threads: hello.threads,
            connected: now,
            heard: now,
            credit: 0,
            scenes: hello.scenes.iter().copied().collect(),
            delivered: 0,
            failed: 0,
        };
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

    /// Workers that may be given work now, in order. If all are set aside, none is: a job never waits without anybody to do it, and if
    /// it is the job that is wrong, its units' failures soon say so.
    pub(crate) fn eligible(&self, now: Timestamp) -> Vec<WorkerId> {
        let trusted: Vec<WorkerId> = self.sessions.keys().filter(|worker| self.aside_until(**worker, now).is_none()).copied().collect();
        if trusted.is_empty() { self.sessions.keys().copied().collect() } else { trusted }
    }

    /// Until when a worker is set aside, if it is.
    pub(crate) fn aside_until(&self, worker: WorkerId, now: Timestamp) -> Option<Timestamp> {
        self.asides.get(&worker)?.until(now)
    }

    /// A result of the worker counted.
    pub(crate) fn praise(&mut self, worker: WorkerId) {
        self.asides.remove(&worker);
        if let Some(session) = self.sessions.get_mut(&worker) {
            session.delivered += 1;
        }
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
        let drain = || v1::CoordinatorMessage { message: Some(v1::coordinator_message::Message::Drain(v1::Drain {})) };
        for session in self.sessions.values() {
            // A worker that does not read learns from the end of the stream.
            let _full = session.outbox.try_send(drain());
        }
        self.sessions.clear();
    }

    /// What people see. `leases` tells how many leases a worker holds.
    pub(crate) fn views(&self, now: Timestamp, leases: impl Fn(WorkerId) -> u64) -> Vec<WorkerView> {
        let view = |(id, session): (&WorkerId, &Session)| WorkerView {
            id: *id,
            name: session.name.clone(),
            version: session.version.clone(),
            threads: session.threads,
            connected: session.connected,
            heard: session.heard,
            leases: leases(*id),
            delivered: session.delivered,
            failed: session.failed,
            set_aside_until: self.aside_until(*id, now),
        };
        self.sessions.iter().map(view).collect()
    }
}

impl Session {
    /// The worker gave a sign of life.
    pub(crate) fn hear(&mut self, now: Timestamp) {
        self.heard = now;
    }
}
