//! Frames that stop early: by their error, by the clock, by their samples; and what is left of units beyond their end.

use gradfarm_core::accuracy::Reason;

use super::*;

fn with(stop: Stop, samples: u32) -> History {
    History::of(JobRecord { plan: Plan { stop, ..plan(8, 8, samples) }, ..record("stopping") })
}

/// Renders what is open of the job, a unit at a time.
fn render(history: &mut History) {
    while history.job.next_for(history.workers[0], &[]).is_some() {
        history.lease(0);
        let grant = *history.grants.last().unwrap();
        history.deliver(grant, false);
    }
}

#[test]
fn a_frame_goes_from_check_to_check_until_its_error_is_small() {
    let mut history = with(Stop { error: Some(0.01), ..Stop::default() }, 1000);
    assert_eq!((history.job.units_done(), history.job.ready()), (0, 2 * 2 * 4), "32 samples each at first");
    render(&mut history);
    assert!(history.job.is_measured_now(0) && history.job.is_measured_now(1), "frames do not wait for each other");
    history.measure(0.02, true);
    // Twice the error: about twice the samples, and a little more.
    assert_eq!((history.job.frames[0].goal, history.job.frames[0].stopped), (64, None));
    render(&mut history);
    history.measure(0.011, true);
    assert_eq!(history.job.frames[0].goal, 80, "a quarter more at least");
    render(&mut history);
    history.measure(0.009, true);
    let frame = &history.job.frames[0];
    assert_eq!((frame.goal, frame.stopped, frame.state, frame.units), (80, Some(Reason::Error), FrameState::Assembling, 5 * 4));
    history.assemble(true);
    assert_eq!(history.job.frames[0].points.iter().map(|point| point.samples).collect::<Vec<_>>(), [32, 64, 80]);
    assert_eq!(history.job.expected_samples(0), 80);
}

#[test]
fn samples_end_a_frame_that_is_not_good_enough() {
    let mut history = with(Stop { error: Some(1e-6), ..Stop::default() }, 40);
    render(&mut history);
    history.measure(0.5, true);
    render(&mut history);
    assert_eq!(history.job.frames[0].goal, 40);
    history.measure(0.4, true);
    assert_eq!(history.job.frames[0].stopped, Some(Reason::Samples));
    assert_eq!(history.job.frames[0].samples, 40 * 64);
}

#[test]
fn the_curve_alone_stops_nothing() {
    let mut history = with(Stop { curve: true, ..Stop::default() }, 100);
    for goal in [32, 64, 100] {
        assert_eq!(history.job.frames[0].goal, goal);
        render(&mut history);
        history.measure(1e-9, true);
    }
    assert_eq!((history.job.frames[0].goal, history.job.frames[0].stopped), (100, Some(Reason::Samples)));
}

#[test]
fn where_each_frame_has_its_time_they_come_one_after_the_other() {
    let mut history = with(Stop { seconds: Some(30.0), ..Stop::default() }, 1000);
    render(&mut history);
    assert!(history.job.is_measured_now(0) && history.job.frames[1].state == FrameState::Waiting);
    history.step(&Step::Pass { millis: 31_000 });
    assert!(history.job.is_measured_now(0), "what is complete is measured, and decided then");
    history.measure(0.5, true);
    assert_eq!(history.job.frames[0].stopped, Some(Reason::Seconds));
    render(&mut history);
    assert!(history.job.is_measured_now(1), "the next frame does not wait for the files");
}

#[test]
fn a_frame_that_runs_out_of_time_keeps_its_whole_passes() {
    let mut history = with(Stop { seconds: Some(10.0), ..Stop::default() }, 1000);
    for _ in 0..6 {
        history.lease(0);
    }
    let grants = history.grants.clone();
    for grant in &grants[..3] {
        history.deliver(*grant, false);
    }
    history.step(&Step::Pass { millis: 11_000 });
    assert_eq!(history.job.frames[0].state, FrameState::Rendering, "there is no whole pass to show");
    history.deliver(grants[4], false);
    history.deliver(grants[3], false);
    let actions = history.apply(Event::Expired);
    let frame = &history.job.frames[0];
    assert_eq!((frame.goal, frame.stopped, frame.state), (16, Some(Reason::Seconds), FrameState::Assembling));
    assert_eq!((frame.units, frame.samples), (4, 16 * 64), "the fifth unit is dropped");
    assert!(actions.contains(&Action::Revoke { unit: grants[5].0, epoch: grants[5].1, worker: grants[5].2 }));
    history.deliver(grants[5], false);
    history.step(&Step::Restart);
    assert_eq!((history.job.frames[0].goal, history.job.frames[0].units), (16, 4));
    history.assemble(true);
    assert_eq!(history.job.frames[0].points.len(), 1, "the image is measured when it is there");
}

#[test]
fn a_frame_that_cannot_be_measured_fails_the_job_with_the_reason() {
    let mut history = with(Stop { error: Some(0.01), ..Stop::default() }, 100);
    render(&mut history);
    history.measure(0.1, false);
    assert_eq!(history.job.error.as_deref(), Some("the error of frame 3 could not be measured: no memory"));
}

#[test]
fn rounds_and_checks_ask_for_a_guide_only_where_the_frame_goes_on_to_it() {
    let mut history = History::of(record_in_rounds_with_checks());
    render(&mut history);
    assert!(history.job.is_measured_now(0) && !history.job.guides[0].in_the_making());
    history.measure(0.02, true);
    assert_eq!(history.job.frames[0].goal, 64);
    render(&mut history);
    // All that steers the first guide is there, and perhaps nobody needs it.
    assert!(history.job.is_measured_now(0) && !history.job.guides[0].in_the_making());
    history.measure(0.02, true);
    assert_eq!(history.job.frames[0].goal, 128);
    assert!(history.job.guides[0].in_the_making(), "now somebody does");
    render(&mut history);
    assert_eq!((history.job.frames[0].units, history.job.is_measured_now(0)), (5 * 4, false), "even units do not wait for it");
    history.step(&Step::Restart);
    assert!(history.job.guides[0].in_the_making());
    history.guide(true);
    render(&mut history);
    assert!(history.job.is_measured_now(0) && !history.job.guides[0].in_the_making());
    history.measure(0.009, true);
    assert_eq!((history.job.frames[0].goal, history.job.frames[0].stopped), (128, Some(Reason::Error)));
    history.assemble(true);
    assert_eq!(history.job.frames[0].points.iter().map(|point| point.samples).collect::<Vec<_>>(), [32, 64, 128]);
}

#[test]
fn a_frame_in_rounds_that_runs_out_of_time_keeps_its_whole_passes() {
    let stop = Stop { seconds: Some(10.0), ..Stop::default() };
    let mut history = History::of(JobRecord { plan: Plan { rounds: 3, stop, ..plan(8, 8, 200) }, ..record("in rounds with time") });
    render(&mut history);
    // So little time was used that the next check comes at four times the samples.
    history.measure(0.5, true);
    assert_eq!(history.job.frames[0].goal, 128);
    render(&mut history);
    history.guide(true);
    for _ in 0..6 {
        history.lease(0);
        let grant = *history.grants.last().unwrap();
        history.deliver(grant, false);
    }
    history.step(&Step::Pass { millis: 11_000 });
    let frame = &history.job.frames[0];
    assert_eq!((frame.goal, frame.stopped, frame.state), (96, Some(Reason::Seconds), FrameState::Assembling), "one guided pass is whole");
    history.step(&Step::Restart);
    history.assemble(true);
    assert_eq!(history.job.frames[0].units, 6 * 4);
}
