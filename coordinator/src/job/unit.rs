//! The units of a job and the sets they are in: ready, leased, done.

use std::collections::{BTreeMap, BTreeSet};

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
        /// Who made it; results of older versions do not say.
        worker: Option<WorkerId>,
    },
    /// It failed so often that its frame goes on without it.
    GivenUp,
}

impl UnitState {
    /// Whether nothing more is to be expected of it.
    pub fn is_settled(&self) -> bool {
        matches!(self, UnitState::Done { .. } | UnitState::GivenUp)
    }
}

/// The units of a job, by number. Of each frame there are the first ones only, as far as it is to go: a frame that stops early never
/// has the others.
#[derive(Clone, Debug, Default)]
pub(super) struct Units {
    /// Numbers that each frame has.
    per_frame: u32,
    frames: Vec<Vec<Unit>>,
    ready: BTreeSet<u32>,
    leased: BTreeSet<u32>,
    /// How many of these each worker has.
    holders: BTreeMap<WorkerId, u32>,
}

impl Units {
    /// Frames with room for so many units each, and no unit yet.
    pub(super) fn closed(frames: u32, per_frame: u32) -> Self {
        Self {
            per_frame,
            frames: vec![Vec::new(); frames as usize],
            ready: BTreeSet::new(),
            leased: BTreeSet::new(),
            holders: BTreeMap::new(),
        }
    }

    /// Makes the units of a frame up to the `upto`-th, ready where they are new.
    pub(super) fn open(&mut self, frame: u32, upto: u32) {
        let first = frame * self.per_frame;
        let Some(units) = self.frames.get_mut(frame as usize) else { return };
        let upto = upto.min(self.per_frame);
        self.ready.extend(first + units.len() as u32..first + upto.max(units.len() as u32));
        let unit = Unit { state: UnitState::Ready, epoch: 0, failures: 0, losses: 0, failed_on: None };
        units.resize(units.len().max(upto as usize), unit);
    }

    /// Takes away the units of a frame from the `upto`-th on: those that there were, with their numbers.
    pub(super) fn close(&mut self, frame: u32, upto: u32) -> Vec<(u32, Unit)> {
        let first = frame * self.per_frame;
        let Some(units) = self.frames.get_mut(frame as usize) else { return Vec::new() };
        let gone: Vec<(u32, Unit)> = (first + upto..).zip(units.drain((upto as usize).min(units.len())..)).collect();
        for (index, unit) in &gone {
            self.ready.remove(index);
            self.leased.remove(index);
            self.drop_holder(unit.state);
        }
        gone
    }

    pub(super) fn get(&self, index: u32) -> Option<&Unit> {
        let frame = index.checked_div(self.per_frame)?;
        self.of_frame(frame).get((index % self.per_frame) as usize)
    }

    fn get_mut(&mut self, index: u32) -> Option<&mut Unit> {
        let frame = index.checked_div(self.per_frame)?;
        self.frames.get_mut(frame as usize)?.get_mut((index % self.per_frame) as usize)
    }

    /// The units of a frame, as far as there are any.
    pub(super) fn of_frame(&self, frame: u32) -> &[Unit] {
        self.frames.get(frame as usize).map_or(&[], Vec::as_slice)
    }

    /// All units with their numbers.
    pub(super) fn all(&self) -> impl Iterator<Item = (u32, &Unit)> {
        (0u32..).zip(&self.frames).flat_map(|(frame, units)| (frame * self.per_frame..).zip(units))
    }

    pub(super) fn ready(&self) -> &BTreeSet<u32> {
        &self.ready
    }

    pub(super) fn leased(&self) -> &BTreeSet<u32> {
        &self.leased
    }

    /// Changes a unit without changing its state.
    pub(super) fn note(&mut self, index: u32, change: impl FnOnce(&mut Unit)) {
        if let Some(unit) = self.get_mut(index) {
            let state = unit.state;
            change(unit);
            unit.state = state;
        }
    }

    /// Puts a unit into a state, and into the set that goes with it.
    pub(super) fn set(&mut self, index: u32, state: UnitState) {
        let Some(unit) = self.get_mut(index) else { return };
        let before = std::mem::replace(&mut unit.state, state);
        self.drop_holder(before);
        if let UnitState::Leased { worker, .. } = state {
            *self.holders.entry(worker).or_insert(0) += 1;
        }
        let (ready, leased) = match state {
            UnitState::Ready => (true, false),
            UnitState::Leased { .. } => (false, true),
            UnitState::Done { .. } | UnitState::GivenUp => (false, false),
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

    /// One lease less of whoever had it, if it was one.
    fn drop_holder(&mut self, state: UnitState) {
        if let UnitState::Leased { worker, .. } = state
            && let Some(leases) = self.holders.get_mut(&worker)
        {
            *leases -= 1;
            if *leases == 0 {
                self.holders.remove(&worker);
            }
        }
    }

    /// How many leases each worker has.
    pub(super) fn holders(&self) -> &BTreeMap<WorkerId, u32> {
        &self.holders
    }

    /// Returns a leased unit to the ready ones, and says who had it. `None`, and no change, if it is not leased.
    pub(super) fn release(&mut self, index: u32) -> Option<WorkerId> {
        match self.get(index)?.state {
            UnitState::Leased { worker, .. } => {
                self.set(index, UnitState::Ready);
                Some(worker)
            }
            UnitState::Ready | UnitState::Done { .. } | UnitState::GivenUp => None,
        }
    }
}
