//! A job is accepted.

use std::collections::BTreeMap;

use crate::job::guides::FrameGuides;
use crate::job::pace::Pace;
use crate::job::record::JobRecord;
use crate::job::unit::Units;
use crate::job::{Action, Change, Frame, Job, JobState, JobWindows, News, checks};
use crate::schedule::{Split, TooManyUnits};

/// A new job with its first units ready, and what is to be kept of it.
///
/// # Errors
/// If it falls into too many units.
pub fn submit(record: JobRecord) -> Result<(Job, Vec<Action>), TooManyUnits> {
    let split = Split::new(&record.plan, &record.moments, record.tile)?;
    let mut job = Job {
        state: JobState::Queued,
        error: None,
        started: None,
        finished: None,
        paused: false,
        frames: vec![Frame::waiting(checks::first_goal(&record.plan)); split.frames() as usize],
        guides: vec![FrameGuides::waiting(&split); split.frames() as usize],
        units: Units::closed(split.frames(), split.units_per_frame()),
        windows: JobWindows::waiting(&record.plan, split.frames()),
        evidence: BTreeMap::new(),
        witnesses: BTreeMap::new(),
        pace: Pace::default(),
        split,
        record: record.clone(),
    };
    (0..job.split.frames()).for_each(|frame| job.open_to_goal(frame));
    Ok((job, vec![Action::Keep(Change::Submitted(Box::new(record))), Action::Tell(News::Job)]))
}
