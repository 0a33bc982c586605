//! A job is accepted.

use crate::job::guides::FrameGuides;
use crate::job::record::JobRecord;
use crate::job::unit::Units;
use crate::job::{Action, Change, Frame, Job, JobState, News};
use crate::schedule::{Split, TooManyUnits};

/// A new job with all its units ready, and what is to be kept of it.
///
/// # Errors
/// If it falls into too many units.
pub fn submit(record: JobRecord) -> Result<(Job, Vec<Action>), TooManyUnits> {
    let split = Split::new(&record.plan, record.first_frame, record.frame_count, record.tile)?;
    let job = Job {
        state: JobState::Queued,
        error: None,
        started: None,
        finished: None,
        frames: vec![Frame::waiting(); split.frames() as usize],
        guides: vec![FrameGuides::waiting(&split); split.frames() as usize],
        units: Units::ready_all(split.units()),
        split,
        record: record.clone(),
    };
    Ok((job, vec![Action::Keep(Change::Submitted(Box::new(record))), Action::Tell(News::Job)]))
}
