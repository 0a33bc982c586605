//! A unit failed on a worker: it goes to another one, a limited number of times.

use crate::clock::Timestamp;
use crate::job::unit::UnitState;
use crate::job::{Action, Change, Job, JobState, MOST_FAILURES, WorkerId};

pub(super) fn apply(job: &mut Job, unit: u32, epoch: u32, worker: WorkerId, reason: &str, now: Timestamp) -> Vec<Action> {
    let Some(held) = job.unit(unit).copied() else { return Vec::new() };
    if held.epoch != epoch || !matches!(held.state, UnitState::Leased { worker: w, .. } if w == worker) {
        return Vec::new();
    }
    job.units.release(unit);
    job.units.note(unit, |u| {
        u.failures += 1;
        u.failed_on = Some(worker);
    });
    let failures = held.failures + 1;
    let freed = Change::Freed { job: job.record.id, unit, failures, losses: held.losses };
    let mut actions = vec![Action::Keep(freed), Action::Blame(worker)];
    if failures >= MOST_FAILURES {
        let work = job.split.work(unit);
        let error = format!(
            "frame {}, tile at ({}, {}), samples {} to {} failed {failures} times, the last time with: {reason}",
            work.moment.first,
            work.tile.x,
            work.tile.y,
            work.samples.first,
            work.samples.end() - 1
        );
        actions.extend(job.end(JobState::Failed, Some(error), now));
    }
    actions
}
