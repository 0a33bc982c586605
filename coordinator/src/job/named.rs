//! Which contents a job still needs, besides its scene and the files of its frames.

use gradfarm_proto::Digest;

use super::record::StoredJob;
use super::state::{FrameState, JobState};
use super::windows::JobWindows;
use crate::schedule::{Split, TooManyUnits};

/// The results and shares of windows that frames are still to be made of. What belongs to a frame whose files are there, or to a job that
/// is over, is needed no more: a moment is only assembled when all windows over it are solved. But what failed may be tried again: a job that
/// failed goes on from all it has, and frames that lack something are made again, with those that share a window with them.
///
/// # Errors
/// If the record cannot be split, which no accepted job's can.
pub fn named(stored: &StoredJob) -> Result<Vec<Digest>, TooManyUnits> {
    let lacking = stored.frames.iter().any(|(_, frame)| frame.failed_units > 0);
    let retryable = stored.state == JobState::Failed || stored.state == JobState::Done && lacking;
    if stored.state.is_final() && !retryable {
        return Ok(Vec::new());
    }
    let split = Split::new(&stored.record.plan, &stored.record.moments, stored.record.tile)?;
    let mut open = vec![true; split.frames() as usize];
    for (position, frame) in &stored.frames {
        if let Some(open) = open.get_mut(*position as usize) {
            *open = frame.state != FrameState::Done;
        }
    }
    let windows = JobWindows::waiting(&stored.record.plan, split.frames());
    for (position, frame) in &stored.frames {
        if frame.failed_units == 0 {
            continue;
        }
        let mut again = vec![*position];
        if let Some(windows) = &windows {
            again.extend(windows.layout.over(*position).flat_map(|window| windows.layout.moments(window)));
            // Windows over these moments are solved again from all their moments, or were: their shares are blended anew.
            let beside: Vec<u32> = again.iter().flat_map(|moment| windows.layout.over(*moment)).collect();
            again.extend(beside.into_iter().flat_map(|window| windows.layout.moments(window)));
        }
        again.into_iter().for_each(|moment| open[moment as usize] = true);
    }
    let is_open = |position: u32| open.get(position as usize) == Some(&true);
    let results = stored.units.iter().filter(|unit| is_open(split.place(unit.unit).frame)).filter_map(|unit| Some(unit.result?.blob));
    let mut named: Vec<Digest> = results.collect();
    if let Some(windows) = windows {
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
    use crate::job::{Frame, JobRecord, StoredUnit};

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
            attempts: Vec::new(),
            witnesses: Vec::new(),
        }
    }

    fn unit(unit: u32) -> StoredUnit {
        StoredUnit { unit, epoch: 1, failures: 0, losses: 0, given_up: false, lease: None, result: Some(result(unit, false)), worker: None }
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
        job.state = JobState::Failed;
        assert_eq!(named(&job).unwrap(), blobs(&[9]), "it can be tried again, from what it has");
        job.state = JobState::Done;
        assert_eq!(named(&job).unwrap(), []);
        job.frames[0].1.failed_units = 1;
        assert_eq!(named(&job).unwrap(), blobs(&[0, 7, 9]), "the frame that lacks something can be made again");
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
