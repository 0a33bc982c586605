//! What people ask of jobs: submit, cancel, pause, set the priority, try again.

use super::dispatch::{Dispatcher, Turn};
use super::look;
use crate::error::Error;
use crate::job::{self, Action, Change, Event, JobId, JobRecord, JobState};

impl Dispatcher {
    pub(super) fn submit(&mut self, record: JobRecord, kept: bool, paused: bool, turn: &mut Turn) -> Result<JobId, Error> {
        if let Some(token) = &record.client_token
            && let Some(known) = self.tokens.get(token).and_then(|id| self.jobs.get(id))
        {
            // Its priority may have been changed since.
            let JobRecord { id, created, priority, .. } = known.record.clone();
            let same = known.record == JobRecord { id, created, priority, ..record.clone() };
            return if same { Ok(id) } else { Err(Error::TokenReused { token: token.clone(), job: id }) };
        }
        let id = record.id;
        if kept && self.jobs.contains_key(&id) {
            // The store handed it out before this came.
            return Ok(id);
        }
        tracing::info!(job = %id, name = %record.name, "job submitted");
        let (job, mut actions) = job::submit(record)?;
        actions.retain(|action| !(kept && matches!(action, Action::Keep(Change::Submitted(_)))));
        self.admit(job);
        self.sort(id, actions, turn);
        if paused {
            self.apply(id, Event::Paused { paused }, turn);
        }
        Ok(id)
    }

    pub(super) fn cancel(&mut self, job: JobId, turn: &mut Turn) -> Result<(), Error> {
        let found = self.jobs.get(&job).ok_or(Error::NoJob(job))?;
        match found.state {
            job::JobState::Cancelled => return Ok(()),
            state if state.is_final() => return Err(Error::Over { job, state: state.name() }),
            _ => {}
        }
        self.apply(job, Event::Cancelled, turn);
        Ok(())
    }

    pub(super) fn pause(&mut self, job: JobId, paused: bool, turn: &mut Turn) -> Result<(), Error> {
        let found = self.jobs.get(&job).ok_or(Error::NoJob(job))?;
        if found.state.is_final() {
            return Err(Error::Over { job, state: found.state.name() });
        }
        self.apply(job, Event::Paused { paused }, turn);
        Ok(())
    }

    pub(super) fn prioritise(&mut self, job: JobId, priority: i32, turn: &mut Turn) -> Result<(), Error> {
        let found = self.jobs.get(&job).ok_or(Error::NoJob(job))?;
        if found.state.is_final() {
            return Err(Error::Over { job, state: found.state.name() });
        }
        self.apply(job, Event::Prioritised { priority }, turn);
        Ok(())
    }

    /// `frame` is a frame's number.
    pub(super) fn retry(&mut self, job: JobId, frame: Option<u32>, turn: &mut Turn) -> Result<(), Error> {
        let found = self.jobs.get(&job).ok_or(Error::NoJob(job))?;
        let frame = frame.map(|number| look::position(found, number)).transpose()?;
        if found.state == JobState::Cancelled {
            return Err(Error::Over { job, state: found.state.name() });
        }
        if !found.can_be_retried(frame) {
            return Err(Error::NothingFailed(job));
        }
        self.apply(job, Event::Retried { frame }, turn);
        Ok(())
    }
}
