//! Units of guided passes wait for the guides of their rounds, which are made once, or fail the job.

use super::*;

#[test]
fn guided_units_wait_for_their_guide_and_for_nothing_else() {
    let mut history = History::of(record_in_rounds());
    let finish = |history: &mut History| {
        while history.job.next_for(history.workers[0], &[]).is_some() {
            history.lease(0);
            let grant = *history.grants.last().unwrap();
            history.deliver(grant, false);
        }
    };
    finish(&mut history);
    // Both frames: three even passes, four tiles each; both guides of the first round are being made.
    assert_eq!((history.job.units_done(), history.job.ready()), (2 * 3 * 4, 2 * 2 * 4));
    assert!(history.job.guide_of(3 * 4) == Err(Unguided) && history.job.guide_of(0) == Ok(None));
    history.guide(true);
    // The second guide of the first frame is asked for at once, for all that steers it is there.
    assert!(history.job.guides[0].in_the_making());
    finish(&mut history);
    assert_eq!(history.job.units_done(), 2 * 3 * 4 + 4);
    assert!(history.job.guide_of(3 * 4).unwrap().is_some());
    for _ in 0..3 {
        history.guide(true);
    }
    finish(&mut history);
    assert!(history.job.frames.iter().all(|frame| frame.state == FrameState::Assembling));
}

#[test]
fn a_guide_that_cannot_be_made_fails_the_job_with_the_reason() {
    let mut history = History::of(record_in_rounds());
    while !history.job.guides[0].in_the_making() {
        history.lease(0);
        let grant = *history.grants.last().unwrap();
        history.deliver(grant, false);
    }
    history.guide(false);
    assert_eq!(history.job.state, JobState::Failed);
    assert_eq!(history.job.error.as_deref(), Some("round 1 of frame 3 could not be guided: no memory"));
}
