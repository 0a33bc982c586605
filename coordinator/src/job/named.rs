//! Which contents a job still needs, besides its scene and the files of its frames.

use gradfarm_proto::Digest;

use super::record::StoredJob;
use super::state::FrameState;
use super::windows::JobWindows;
use crate::schedule::{Split, TooManyUnits};

/// The results and shares of windows that frames are still to be made of. What belongs to a frame whose files are there, or to a job that
/// is over, is needed no more: a moment is only assembled when all windows over it are solved.
///
/// # Errors
/// If the record cannot be split, which no accepted job's can.
pub fn named(stored: &StoredJob) -> Result<Vec<Digest>, TooManyUnits> {
    if stored.state.is_final() {
        return Ok(Vec::new());
    }
    let split = Split::new(&stored.record.plan, &stored.record.moments, stored.record.tile)?;
    let mut open = vec![true; split.frames() as usize];
    for (position, frame) in &stored.frames {
        if let Some(open) = open.get_mut(*position as usize) {
            *open = frame.state != FrameState::Done;
        }
    }
    let is_open = |position: u32| open.get(position as usize) == Some(&true);
    let results = stored.units.iter().filter(|unit| is_open(split.place(unit.unit).frame)).filter_map(|unit| Some(unit.result?.blob));
    let mut named: Vec<Digest> = results.collect();
    if let Some(windows) = JobWindows::waiting(&stored.record.plan, split.frames()) {
        for (window, solved) in &stored.windows {
            let moments = windows.layout.moments(*window);
            named.extend(moments.zip(&solved.shares).filter(|(position, _)| is_open(*position)).map(|(_, share)| share.blob));
        }
    }
    Ok(named)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::tests::windows::{record_with_windows, solved};
    use crate::job::tests::{record, result};
    use crate::job::{Frame, JobRecord, JobState, StoredUnit};

    fn stored(record: JobRecord) -> StoredJob {
        StoredJob {
            record,
            state: JobState::Running,
            error: None,
            started: None,
            finished: None,
            paused: false,
            windows: Vec::new(),
            frames: Vec::new(),
            units: Vec::new(),
        }
    }

    fn unit(unit: u32) -> StoredUnit {
        StoredUnit { unit, epoch: 1, failures: 0, losses: 0, lease: None, result: Some(result(unit, false)) }
    }

    #[test]
    fn results_are_needed_until_their_frame_is_done() {
        // 2 frames × 8 units.
        let mut job = stored(record("named"));
        job.units = vec![unit(0), unit(7), StoredUnit { result: None, ..unit(8) }, unit(9)];
        let blobs = |units: &[u32]| units.iter().map(|unit| result(*unit, false).blob).collect::<Vec<_>>();
        assert_eq!(named(&job).unwrap(), blobs(&[0, 7, 9]));
        for (state, needed) in [(FrameState::Assembling, blobs(&[0, 7, 9])), (FrameState::Done, blobs(&[9]))] {
            job.frames = vec![(0, Frame { state, ..Frame::waiting(20) })];
            assert_eq!(named(&job).unwrap(), needed);
        }
        job.state = JobState::Cancelled;
        assert_eq!(named(&job).unwrap(), []);
    }

    #[test]
    fn what_windows_say_is_needed_until_the_moment_is_done() {
        let mut job = stored(record_with_windows());
        let windows = JobWindows::waiting(&job.record.plan, job.record.moments.len() as u32).unwrap();
        let moments = windows.layout.moments(0);
        job.windows = vec![(0, solved(moments.len() as u32))];
        let all: Vec<Digest> = job.windows[0].1.shares.iter().map(|share| share.blob).collect();
        assert_eq!(named(&job).unwrap(), all);
        job.frames = vec![(moments.start, Frame { state: FrameState::Done, ..Frame::waiting(20) })];
        assert_eq!(named(&job).unwrap(), all[1..]);
    }
}
