//! A frame is finished, or cannot be.

use gradfarm_core::accuracy::Estimate;

use super::Assembled;
use crate::clock::Timestamp;
use crate::job::{Action, Change, FrameState, Job, JobState, News, SolvedWindow};

pub(super) fn apply(job: &mut Job, position: u32, outcome: Result<Assembled, String>, now: Timestamp) -> Vec<Action> {
    let assembling = job.frames.get(position as usize).is_some_and(|frame| frame.state == FrameState::Assembling);
    if job.state.is_final() || !assembling {
        return Vec::new();
    }
    let assembled = match outcome {
        // Made of other results than there are now: it was reopened meanwhile, and will be made again.
        Ok(assembled) if assembled.units != job.frames[position as usize].units => return Vec::new(),
        Ok(assembled) => assembled,
        Err(reason) => return fail(job, position, reason, now),
    };
    // Each moment bears its part of the windows over it.
    let part = |seconds: fn(&SolvedWindow) -> f64| -> f64 {
        job.shares(position).iter().map(|(_, window)| seconds(window) / window.shares.len() as f64).sum()
    };
    let windows = [part(|window| window.stitch), part(|window| window.reconstruct)];
    let frame = &mut job.frames[position as usize];
    frame.state = FrameState::Done;
    frame.seconds.stitch = assembled.seconds.stitch + windows[0];
    frame.seconds.reconstruct = assembled.seconds.reconstruct + windows[1];
    frame.seconds.write = assembled.seconds.write;
    frame.estimated_relmse = assembled.error.map(|error| error.relmse);
    frame.choice = assembled.choice;
    frame.statistics = assembled.statistics;
    // Where it stopped at a check, that was the last point already.
    if let Some(error) = assembled.error.filter(Estimate::is_sound)
        && frame.points.last().is_none_or(|point| point.samples < frame.goal)
    {
        let mut point = frame.point(error, assembled.seconds.stitch + assembled.seconds.reconstruct, now);
        // The image was there before its files were.
        point.wall_seconds = (point.wall_seconds - assembled.seconds.write).max(0.0);
        frame.points.push(point);
    }
    let job_id = job.record.id;
    let mut actions: Vec<Action> =
        assembled.files.into_iter().map(|file| Action::Keep(Change::File { job: job_id, position, file })).collect();
    actions.extend([job.kept_frame(position), Action::Tell(News::Frame(position))]);
    actions.extend(finish(job, now));
    actions
}

/// The frame cannot be made; the others can.
fn fail(job: &mut Job, position: u32, reason: String, now: Timestamp) -> Vec<Action> {
    let frame = &mut job.frames[position as usize];
    (frame.state, frame.failure) = (FrameState::Failed, Some(reason));
    let mut actions = vec![job.kept_frame(position), Action::Tell(News::Frame(position))];
    actions.extend(finish(job, now));
    actions
}

/// Ends the job after its last frame.
fn finish(job: &mut Job, now: Timestamp) -> Vec<Action> {
    if !job.frames.iter().all(|frame| matches!(frame.state, FrameState::Done | FrameState::Failed)) {
        return Vec::new();
    }
    let failed: Vec<(u32, &str)> =
        (0..).zip(&job.frames).filter_map(|(position, frame)| Some((position, frame.failure.as_deref()?))).collect();
    let Some((position, reason)) = failed.first() else { return job.end(JobState::Done, None, now) };
    let more = if failed.len() > 1 { format!(", nor could {} others", failed.len() - 1) } else { String::new() };
    let error = format!("frame {} could not be assembled: {reason}{more}", job.moment(*position).first);
    job.end(JobState::Failed, Some(error), now)
}
