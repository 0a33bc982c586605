//! Somebody pauses the job, or lets it go on. A paused job gets no leases; units that are being rendered finish, and count.

use crate::job::{Action, Change, Job, News};

pub(super) fn apply(job: &mut Job, paused: bool) -> Vec<Action> {
    if job.state.is_final() || job.paused == paused {
        return Vec::new();
    }
    job.paused = paused;
    vec![Action::Keep(Change::Paused { job: job.record.id, paused }), Action::Tell(News::Job)]
}
