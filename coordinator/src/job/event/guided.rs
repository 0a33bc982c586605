//! The guide of a round is there, or cannot be had. The units that waited for it are open from now on.

use std::sync::Arc;

use gradfarm_core::plan::Guide;

use crate::clock::Timestamp;
use crate::job::{Action, Job, JobState};

pub(super) fn apply(job: &mut Job, position: u32, round: u32, outcome: Result<Arc<Guide>, String>, now: Timestamp) -> Vec<Action> {
    let waits = job.guides.get(position as usize).is_some_and(|guides| guides.awaits(round));
    if job.state.is_final() || !waits {
        return Vec::new();
    }
    let guide = match outcome {
        Ok(guide) => guide,
        Err(reason) => {
            let number = job.moment(position).first;
            let error = format!("round {round} of frame {number} could not be guided: {reason}");
            return job.end(JobState::Failed, Some(error), now);
        }
    };
    job.guides[position as usize].take(guide);
    job.next_guide(position).into_iter().collect()
}
