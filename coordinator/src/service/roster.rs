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
    /// How it has been doing.
    pub(crate) aside: Aside,
    delivered: u64,
    failed: u64,
}

/// All connected workers.
#[derive(Debug, Default)]
pub(crate) struct Roster {
    sessions: BTreeMap<WorkerId, Session>,
    connections: u64,
}

impl Roster {
    /// A worker connects, for the first time or again; its record of failures outlives the connection.
    pub(crate) fn connect(&mut self, hello: &Hello, outbox: mpsc::Sender<v1::CoordinatorMessage>, now: Timestamp) -> SessionKey {
        self.connections += 1;
        let before = self.sessions.remove(&hello.worker);
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
            aside: before.map(|session| session.aside).unwrap_or_default(),
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

    /// Workers that may be given work now, in order.
    pub(crate) fn eligible(&self, now: Timestamp) -> Vec<WorkerId> {
        self.sessions.iter().filter(|(_, session)| session.aside.until(now).is_none()).map(|(worker, _)| *worker).collect()
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
            set_aside_until: session.aside.until(now),
        };
        self.sessions.iter().map(view).collect()
    }
}

impl Session {
    /// The worker gave a sign of life.
    pub(crate) fn hear(&mut self, now: Timestamp) {
        self.heard = now;
    }

    /// A result of the worker counted.
    pub(crate) fn praise(&mut self) {
        self.delivered += 1;
        self.aside.succeeded();
    }

    /// The worker failed a unit.
    pub(crate) fn blame(&mut self, now: Timestamp) {
        self.failed += 1;
        self.aside.failed(now);
    }

    /// Name for logs.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }
}
