//! A lease ends without a result: handed back, lost with its worker, or run out. The epoch stays: a late result still counts until
//! the unit is granted again.

use crate::clock::Timestamp;
use crate::job::unit::UnitState;
use crate::job::{Action, Change, Job, JobState, MOST_LOSSES, WorkerId};

/// The worker hands it back.
pub(super) fn returned(job: &mut Job, unit: u32, epoch: u32, worker: WorkerId) -> Vec<Action> {
    let holds = |u: &crate::job::Unit| u.epoch == epoch && matches!(u.state, UnitState::Leased { worker: w, .. } if w == worker);
    if !job.unit(unit).is_some_and(holds) {
        return Vec::new();
    }
    job.units.release(unit);
    vec![freed(job, unit)]
}

/// The worker's connection broke.
pub(super) fn lost(job: &mut Job, worker: WorkerId, now: Timestamp) -> Vec<Action> {
    release(job, now, "its worker was lost", |state| matches!(state, UnitState::Leased { worker: w, .. } if *w == worker))
}

/// Leases whose time is over, and frames.
pub(super) fn expired(job: &mut Job, now: Timestamp) -> Vec<Action> {
    let mut actions = release(job, now, "its lease ran out", |state| matches!(state, UnitState::Leased { until, .. } if *until <= now));
    if !job.state.is_final() {
        let late: Vec<u32> = job.frames_out_of_time(now).collect();
        late.into_iter().for_each(|frame| actions.extend(job.cut_short(frame)));
    }
    actions
}

fn release(job: &mut Job, now: Timestamp, why: &str, which: impl Fn(&UnitState) -> bool) -> Vec<Action> {
    let hit: Vec<u32> = job.leased().filter(|(_, unit)| which(&unit.state)).map(|(index, _)| index).collect();
    let mut actions = Vec::new();
    for unit in hit {
        job.units.release(unit);
        job.units.note(unit, |u| u.losses += 1);
        actions.push(freed(job, unit));
        if job.unit(unit).is_some_and(|u| u.losses >= MOST_LOSSES) {
            let error = format!("unit {unit} was given up {MOST_LOSSES} times, the last time because {why}; it may be what stops workers");
            actions.extend(job.end(JobState::Failed, Some(error), now));
            break;
        }
    }
    actions
}

fn freed(job: &Job, unit: u32) -> Action {
    let (failures, losses) = job.unit(unit).map_or((0, 0), |u| (u.failures, u.losses));
    Action::Keep(Change::Freed { job: job.record.id, unit, failures, losses })
}
