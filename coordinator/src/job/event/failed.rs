//! A unit failed on a worker: it goes to another one, a limited number of times.

use crate::clock::Timestamp;
use crate::job::evidence::{Attempt, Ending};
use crate::job::unit::UnitState;
use crate::job::{Action, Job, MOST_FAILURES, WorkerId};

pub(super) fn apply(job: &mut Job, unit: u32, epoch: u32, worker: WorkerId, reason: String, ending: Ending, now: Timestamp) -> Vec<Action> {
    let Some(held) = job.unit(unit).copied() else { return Vec::new() };
    if held.epoch != epoch || !matches!(held.state, UnitState::Leased { worker: w, .. } if w == worker) {
        return Vec::new();
    }
    job.units.release(unit);
    job.units.note(unit, |u| {
        u.failures += 1;
        u.failed_on = Some(worker);
    });
    let mut actions = vec![job.attempted(unit, Attempt { worker, epoch, at: now, ending, reason }), Action::Blame(worker)];
    let failures = held.failures + 1;
    if failures >= MOST_FAILURES {
        actions.extend(job.give_up(unit, &format!("failed {failures} times, the last time with"), now));
    } else {
        actions.push(job.freed(unit));
    }
    actions
}
