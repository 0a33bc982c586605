//! Why a job waits, from what the loop knows.

use super::book::Used;
use super::dispatch::Dispatcher;
use crate::job::{FrameState, Job, Lack, Needs, WindowState};
use crate::schedule::{Facts, Waiting};

impl Dispatcher {
    /// Why a job gets no worker at this moment, if it waits for one.
    pub(super) fn why_waiting(&self, job: &Job) -> Option<Waiting> {
        if job.state.is_final() {
            return None;
        }
        let needs = &job.record.needs;
        let waiting = |id| self.jobs.get(id).filter(|other| other.record.id != job.record.id && other.has_open_units());
        let others: Vec<&Job> = self.open.iter().filter_map(waiting).collect();
        let (fitting, lacks) = self.fitting(needs);
        let facts = Facts {
            over: false,
            paused: job.paused,
            open: job.has_ready_units(),
            leases: job.leases(),
            errand: errand(job),
            workers: self.roster.count(),
            fitting,
            lacks,
            limit: Used::of(self.open.iter().filter_map(|id| self.jobs.get(id))).reached(job, None, &self.rules),
            higher: others.iter().filter(|other| other.record.priority > job.record.priority).count(),
            poorer: others
                .iter()
                .filter(|other| other.record.priority == job.record.priority)
                .filter(|other| self.shares.time(&other.record.needs.project) < self.shares.time(&needs.project))
                .count(),
            project: needs.project.clone(),
        };
        Waiting::why(&facts)
    }

    /// How many connected workers may render a job with these needs, and what the others lack.
    pub(super) fn fitting(&self, needs: &Needs) -> (usize, Vec<Lack>) {
        let mut lacks: Vec<Lack> = self.roster.capabilities().filter_map(|worker| needs.lacks(worker)).collect();
        let fitting = self.roster.count() - lacks.len();
        lacks.sort();
        lacks.dedup();
        (fitting, lacks)
    }
}

/// What is being made of a job's results, while no unit of it can be rendered.
fn errand(job: &Job) -> Option<&'static str> {
    let positions = || 0..job.split.frames();
    if job.is_guided_now() {
        return Some("where its next samples go is being worked out");
    }
    if positions().any(|position| job.is_measured_now(position)) {
        return Some("the error of a frame is being measured");
    }
    if job.windows().is_some_and(|windows| windows.states.contains(&WindowState::Solving)) {
        return Some("a window of frames is being reconstructed");
    }
    job.frames.iter().any(|frame| frame.state == FrameState::Assembling).then_some("a frame is being assembled")
}
