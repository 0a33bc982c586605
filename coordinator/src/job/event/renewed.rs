//! A worker says that it still holds a lease.
//!
//! The lease may have run out meanwhile, or the connection may have broken; as long as nobody else was granted the unit, its epoch
//! stands and the worker gets it back.

use crate::clock::Timestamp;
use crate::job::unit::UnitState;
use crate::job::{Action, Job, WorkerId};

pub(super) fn apply(job: &mut Job, unit: u32, epoch: u32, worker: WorkerId, until: Timestamp) -> Vec<Action> {
    let gone = vec![Action::Revoke { unit, epoch, worker }];
    if job.state.is_final() {
        return gone;
    }
    match job.unit(unit) {
        Some(held) if held.epoch == epoch && epoch > 0 => match held.state {
            UnitState::Leased { worker: holder, .. } if holder != worker => gone,
            // So it is when its result is compared with others first.
            UnitState::Ready if job.witnesses(unit).iter().any(|witness| witness.epoch == epoch) => Vec::new(),
            UnitState::Leased { .. } | UnitState::Ready => {
                job.units.set(unit, UnitState::Leased { worker, until });
                Vec::new()
            }
            // Its result is here; the worker drops the lease when the answer to its delivery reaches it.
            UnitState::Done { .. } => Vec::new(),
            UnitState::GivenUp => gone,
        },
        _ => gone,
    }
}
