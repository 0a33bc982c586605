//! A lease ends without a result: handed back, lost with its worker, or run out. The epoch stays: a late result still counts until
//! the unit is granted again.

use crate::clock::Timestamp;
use crate::job::evidence::{Attempt, Ending};
use crate::job::unit::UnitState;
use crate::job::{Action, Job, MOST_LOSSES, WorkerId};

/// The worker hands it back.
pub(super) fn returned(job: &mut Job, unit: u32, epoch: u32, worker: WorkerId) -> Vec<Action> {
    let holds = |u: &crate::job::Unit| u.epoch == epoch && matches!(u.state, UnitState::Leased { worker: w, .. } if w == worker);
    if !job.unit(unit).is_some_and(holds) {
        return Vec::new();
    }
    job.units.release(unit);
    vec![job.freed(unit)]
}

/// The worker's connection broke.
pub(super) fn lost(job: &mut Job, worker: WorkerId, now: Timestamp) -> Vec<Action> {
    release(job, now, Ending::Lost, |state| matches!(state, UnitState::Leased { worker: w, .. } if *w == worker))
}

/// Leases whose time is over, and frames.
pub(super) fn expired(job: &mut Job, now: Timestamp) -> Vec<Action> {
    let mut actions = release(job, now, Ending::Expired, |state| matches!(state, UnitState::Leased { until, .. } if *until <= now));
    if !job.state.is_final() {
        let late: Vec<u32> = job.frames_out_of_time(now).collect();
        late.into_iter().for_each(|frame| actions.extend(job.cut_short(frame)));
    }
    actions
}

fn release(job: &mut Job, now: Timestamp, ending: Ending, which: impl Fn(&UnitState) -> bool) -> Vec<Action> {
    let holder = |(index, unit): (u32, &crate::job::Unit)| match unit.state {
        UnitState::Leased { worker, .. } if which(&unit.state) => Some((index, unit.epoch, worker)),
        _ => None,
    };
    let hit: Vec<(u32, u32, WorkerId)> = job.leased().filter_map(holder).collect();
    let reason = if ending == Ending::Lost { "its worker was lost" } else { "its lease ran out" };
    let mut actions = Vec::new();
    for (unit, epoch, worker) in hit {
        // A unit that is given up may end the job, and with it the other leases.
        if job.units.release(unit).is_none() {
            continue;
        }
        job.units.note(unit, |u| u.losses += 1);
        actions.push(job.attempted(unit, Attempt { worker, epoch, at: now, ending, reason: reason.into() }));
        if job.unit(unit).is_some_and(|u| u.losses >= MOST_LOSSES) {
            let why = format!("was given up {MOST_LOSSES} times and may be what stops workers, the last time because");
            actions.extend(job.give_up(unit, &why, now));
        } else {
            actions.push(job.freed(unit));
        }
    }
    actions
}
