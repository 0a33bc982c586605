//! Somebody wants what failed to be tried again. Everything that is there stays; units that were given up get new chances, frames that lacked
//! something are assembled anew, and a job that failed goes on where it stopped.

use std::collections::BTreeSet;

use crate::clock::Timestamp;
use crate::job::guides::FrameGuides;
use crate::job::unit::UnitState;
use crate::job::{Action, Change, FrameState, Job, JobState, News};

pub(super) fn apply(job: &mut Job, only: Option<u32>, now: Timestamp) -> Vec<Action> {
    if !job.can_be_retried(only) {
        return Vec::new();
    }
    let mut actions = Vec::new();
    let mut reopened = BTreeSet::new();
    let was_over = job.state.is_final();
    for position in 0..job.split.frames() {
        if only.is_some_and(|only| only != position) {
            continue;
        }
        let units: Vec<u32> = job.given_up(position).collect();
        for unit in &units {
            job.units.note(*unit, |u| (u.failures, u.losses, u.failed_on) = (0, 0, None));
            job.units.set(*unit, UnitState::Ready);
            let pass = job.split.place(*unit).pass;
            job.guides[position as usize].undone(&job.split, pass);
            actions.push(job.freed(*unit));
        }
        let frame = &mut job.frames[position as usize];
        let lacking = !units.is_empty() || frame.failure.is_some();
        frame.failed_units -= units.len() as u32;
        frame.failure = None;
        if lacking {
            reopen(job, position, &mut actions);
            reopened.insert(position);
        }
    }
    // Frames that were made by themselves because a tile of a neighbour was missing are made with it.
    for position in job.mend_windows() {
        reopen(job, position, &mut actions);
        reopened.insert(position);
    }
    if was_over {
        job.state = if job.started.is_some() { JobState::Running } else { JobState::Queued };
        (job.error, job.finished) = (None, None);
        job.recount_guides();
        actions.extend([job.kept(), Action::Tell(News::Job)]);
        reopened = (0..job.split.frames()).collect();
    }
    actions.extend(job.resumed(reopened));
    if job.frames.iter().all(|frame| frame.state == FrameState::Done) && !job.state.is_final() {
        actions.extend(job.end(JobState::Done, None, now));
    }
    actions
}

/// Puts a frame back to where its units are rendered.
fn reopen(job: &mut Job, position: u32, actions: &mut Vec<Action>) {
    let frame = &mut job.frames[position as usize];
    if matches!(frame.state, FrameState::Done | FrameState::Failed | FrameState::Assembling) {
        frame.state = FrameState::Rendering;
        actions.extend([job.kept_frame(position), Action::Tell(News::Frame(position))]);
    }
}

impl Job {
    /// Whether there is anything to try again, in one frame or in all: the job failed, a frame did, or units of it were given up.
    pub fn can_be_retried(&self, only: Option<u32>) -> bool {
        let lacks = |frame: &crate::job::Frame| frame.failed_units > 0 || frame.failure.is_some();
        match self.state {
            JobState::Cancelled => false,
            JobState::Failed => only.is_none_or(|position| (position as usize) < self.frames.len()),
            JobState::Queued | JobState::Running | JobState::Done => {
                (0..).zip(&self.frames).any(|(position, frame)| only.is_none_or(|only| only == position) && lacks(frame))
            }
        }
    }

    /// Counts again what the guides of unfinished frames wait for.
    fn recount_guides(&mut self) {
        for position in 0..self.split.frames() {
            let mut guides = FrameGuides::waiting(&self.split);
            if matches!(self.frames[position as usize].state, FrameState::Waiting | FrameState::Rendering) {
                let first = position * self.split.units_per_frame();
                for (unit, held) in (first..).zip(self.units.of_frame(position)) {
                    if matches!(held.state, UnitState::Done { .. } | UnitState::GivenUp) {
                        guides.done(&self.split, self.split.place(unit).pass);
                    }
                }
            } else {
                guides.drop_all();
            }
            self.guides[position as usize] = guides;
        }
    }
}

/// Kept of a job whose priority changes.
pub(super) fn prioritised(job: &mut Job, priority: i32) -> Vec<Action> {
    if job.state.is_final() || job.record.priority == priority {
        return Vec::new();
    }
    job.record.priority = priority;
    vec![Action::Keep(Change::Priority { job: job.record.id, priority }), Action::Tell(News::Job)]
}
