//! The units of a job and the sets they are in: ready, leased, done.

use std::collections::BTreeSet;

use gradfarm_proto::Digest;

use super::identity::WorkerId;
use crate::clock::Timestamp;

/// A unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Where it stands.
    pub state: UnitState,
    /// Counts its grants: 0 before the first. A result counts if and only if it bears this number.
    pub epoch: u32,
    /// How often it failed.
    pub failures: u32,
    /// How often its worker died or fell silent.
    pub losses: u32,
    /// Who failed it last.
    pub failed_on: Option<WorkerId>,
}

/// Where a unit stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnitState {
    /// It waits for a worker.
    Ready,
    /// A worker has it.
    Leased {
        /// Who.
        worker: WorkerId,
        /// Until when, unless a heartbeat renews it.
        until: Timestamp,
    },
    /// Its result is there.
    Done {
        /// Digest of the result's encoding.
        content: Digest,
    },
}

/// All units of a job, by number.
#[derive(Clone, Debug, Default)]
pub(super) struct Units {
    units: Vec<Unit>,
    ready: BTreeSet<u32>,
    leased: BTreeSet<u32>,
}

impl Units {
    /// `count` units, all ready.
    pub(super) fn ready_all(count: u32) -> Self {
        let unit = Unit { state: UnitState::Ready, epoch: 0, failures: 0, losses: 0, failed_on: None };
        Self { units: vec![unit; count as usize], ready: (0..count).collect(), leased: BTreeSet::new() }
    }

    pub(super) fn get(&self, index: u32) -> Option<&Unit> {
        self.units.get(index as usize)
    }

    pub(super) fn all(&self) -> &[Unit] {
        &self.units
    }

    pub(super) fn ready(&self) -> &BTreeSet<u32> {
        &self.ready
    }

    pub(super) fn leased(&self) -> &BTreeSet<u32> {
        &self.leased
    }

    /// Changes a unit without changing its state.
    pub(super) fn note(&mut self, index: u32, change: impl FnOnce(&mut Unit)) {
        if let Some(unit) = self.units.get_mut(index as usize) {
            let state = unit.state;
            change(unit);
            unit.state = state;
        }
    }

    /// Puts a unit into a state, and into the set that goes with it.
    pub(super) fn set(&mut self, index: u32, state: UnitState) {
        let Some(unit) = self.units.get_mut(index as usize) else { return };
        unit.state = state;
        let (ready, leased) = match state {
            UnitState::Ready => (true, false),
            UnitState::Leased { .. } => (false, true),
            UnitState::Done { .. } => (false, false),
        };
        if ready {
            self.ready.insert(index)
        } else {
            self.ready.remove(&index)
        };
        if leased {
            self.leased.insert(index)
        } else {
            self.leased.remove(&index)
        };
    }

    /// Returns a leased unit to the ready ones, and says who had it. `None`, and no change, if it is not leased.
    pub(super) fn release(&mut self, index: u32) -> Option<WorkerId> {
        match self.get(index)?.state {
            UnitState::Leased { worker, .. } => {
                self.set(index, UnitState::Ready);
                Some(worker)
            }
            UnitState::Ready | UnitState::Done { .. } => None,
        }
    }
}
