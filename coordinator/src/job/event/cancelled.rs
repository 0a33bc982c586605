//! Somebody calls the job off. Nothing is granted afterwards, and no result counts.

use crate::clock::Timestamp;
use crate::job::{Action, Job, JobState};

pub(super) fn apply(job: &mut Job, now: Timestamp) -> Vec<Action> {
    if job.state.is_final() {
        return Vec::new();
    }
    job.end(JobState::Cancelled, None, now)
}
