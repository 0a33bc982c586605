//! A ready unit goes to a worker, under a new epoch.

use crate::clock::Timestamp;
use crate::job::unit::UnitState;
use crate::job::{Action, Change, FrameState, Job, JobState, News, WorkerId};

pub(super) fn apply(job: &mut Job, unit: u32, worker: WorkerId, until: Timestamp, now: Timestamp) -> Vec<Action> {
    if job.state.is_final() || job.paused || job.unit(unit).is_none_or(|u| u.state != UnitState::Ready) || !job.is_open(unit) {
        return Vec::new();
    }
    job.units.note(unit, |u| u.epoch += 1);
    job.units.set(unit, UnitState::Leased { worker, until });
    let epoch = job.unit(unit).map_or(0, |u| u.epoch);
    let mut actions = vec![Action::Keep(Change::Leased { job: job.record.id, unit, epoch, worker, at: now })];
    if job.state == JobState::Queued {
        job.state = JobState::Running;
        job.started = Some(now);
        actions.extend([job.kept(), Action::Tell(News::Job)]);
    }
    let position = job.split.place(unit).frame;
    let frame = &mut job.frames[position as usize];
    if frame.state == FrameState::Waiting {
        frame.state = FrameState::Rendering;
        frame.started = Some(now);
        actions.extend([job.kept_frame(position), Action::Tell(News::Frame(position))]);
    }
    actions.push(Action::Grant { unit, epoch, worker });
    actions
}
