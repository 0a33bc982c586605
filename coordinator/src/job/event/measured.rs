//! The error of a frame as it is was measured: it stops, or goes on to the next check.

use gradfarm_core::accuracy::{Estimate, Reason, Verdict, verdict};

use super::Measured;
use crate::clock::Timestamp;
use crate::job::{Action, Job, JobState, News};

pub(super) fn apply(job: &mut Job, position: u32, outcome: Result<Measured, String>, now: Timestamp) -> Vec<Action> {
    if job.state.is_final() || !job.is_measured_now(position) {
        return Vec::new();
    }
    let measured = match outcome {
        Ok(measured) => measured,
        Err(reason) => {
            let number = job.moment(position).first;
            return job.end(JobState::Failed, Some(format!("the error of frame {number} could not be measured: {reason}")), now);
        }
    };
    let plan = &job.record.plan;
    let frame = &mut job.frames[position as usize];
    if measured.samples != frame.goal {
        return Vec::new();
    }
    let verdict = match measured.error.filter(Estimate::is_sound) {
        Some(error) => {
            frame.points.push(frame.point(error, measured.seconds, now));
            verdict(&plan.stop, plan.samples, plan.batch, &frame.points)
        }
        // Too few samples to tell, or numbers beyond all bounds.
        None if frame.goal >= plan.samples => Verdict::Stop(Reason::Samples),
        None => Verdict::Continue { samples: frame.goal.saturating_mul(2).min(plan.samples) },
    };
    let mut actions = match verdict {
        Verdict::Stop(reason) => {
            frame.stopped = Some(reason);
            job.finish_frame(position)
        }
        Verdict::Continue { samples } => {
            frame.goal = samples;
            job.open_to_goal(position);
            std::iter::once(job.kept_frame(position)).chain(job.next_guide(position)).collect()
        }
    };
    actions.push(Action::Tell(News::Accuracy(position)));
    actions
}
