//! A window of moments is solved, or cannot be.

use crate::clock::Timestamp;
use crate::job::{Action, Job, JobState, SolvedWindow, WindowState};

pub(super) fn apply(job: &mut Job, window: u32, outcome: Result<SolvedWindow, String>, now: Timestamp) -> Vec<Action> {
    let Some(windows) = job.windows() else { return Vec::new() };
    let moments = windows.layout.moments(window);
    if job.state.is_final() || windows.states.get(window as usize) != Some(&WindowState::Solving) {
        return Vec::new();
    }
    match outcome {
        Ok(solved) if solved.shares.len() == moments.len() => job.window_solved(window, solved),
        Ok(solved) => {
            let error = format!("window {window} of {} moments was solved for {}", moments.len(), solved.shares.len());
            job.end(JobState::Failed, Some(error), now)
        }
        Err(reason) => {
            let [first, last] = [moments.start, moments.end - 1].map(|position| job.moment(position));
            let error = format!("frames {} to {} could not be reconstructed together: {reason}", first.first, last.end - 1);
            job.end(JobState::Failed, Some(error), now)
        }
    }
}
