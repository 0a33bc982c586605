//! Moments that are reconstructed together: windows begin when their moments are in, frames end when their windows are, and nothing is lost on
//! the way.

use gradfarm_core::lattice::Moment;
use gradfarm_core::plan::Temporal;

use super::*;

/// Six moments × 2 passes × 4 tiles, one of them shown by two frames; windows over moments 0 to 2, 2 to 4 and 3 to 5.
pub(crate) fn record_with_windows() -> JobRecord {
    let temporal = Some(Temporal { window: 3, stride: 2, motion: true });
    let moments = [(3, 4), (4, 6), (6, 7), (7, 8), (8, 9), (9, 10)].map(|(first, end)| Moment { first, end });
    JobRecord { plan: Plan { temporal, ..plan(8, 8, 20) }, frame_count: 7, moments: moments.to_vec(), ..record("with windows") }
}

pub(crate) fn solved(moments: u32) -> SolvedWindow {
    let share = |k: u32| ShareRecord { blob: Digest::of(&k.to_le_bytes()), size: 100 };
    let report = SolveReport { iterations: 3, residual: 1e-6, alpha: 0.2 };
    SolvedWindow { shares: (0..moments).map(share).collect(), report, stitch: 3.0, reconstruct: 6.0 }
}

/// Renders the next units, of which there must be as many.
fn render(history: &mut History, units: u32) -> Vec<Action> {
    let mut actions = Vec::new();
    for _ in 0..units {
        let worker = history.workers[0];
        let unit = history.job.next_for(worker, &[]).expect("there is more to render");
        history.lease(0);
        let (granted, epoch, worker) = *history.grants.last().unwrap();
        assert_eq!(granted, unit);
        actions.extend(history.apply(Event::Delivered { unit, epoch, worker, result: result(unit, false) }));
        history.counted.insert(unit, (epoch, result(unit, false).content));
    }
    actions
}

fn errands(actions: &[Action]) -> Vec<Errand> {
    actions.iter().filter_map(|action| if let Action::Do(errand) = action { Some(*errand) } else { None }).collect()
}

#[test]
fn units_favour_the_window_that_comes_next_and_frames_end_with_their_last_window() {
    let mut history = History::of(record_with_windows());
    assert_eq!(errands(&render(&mut history, 3 * 8 - 1)), []);
    assert!(history.job.is_rendered(0) && history.job.is_rendered(1) && !history.job.is_rendered(2));
    assert_eq!(errands(&render(&mut history, 1)), [Errand::Window { window: 0 }], "the first three moments are rendered first");
    assert_eq!(errands(&render(&mut history, 2 * 8)), [Errand::Window { window: 1 }], "the next window does not wait for the first");
    let done = history.apply(Event::Solved { window: 0, outcome: Ok(solved(3)) });
    assert_eq!(errands(&done), [Errand::Assemble { frame: 0 }, Errand::Assemble { frame: 1 }], "moment 2 waits for the second window");
    history.assemble(true);
    history.assemble(true);
    assert_eq!(history.job.frames[1].state, FrameState::Done, "finished while others are still to be rendered");
    assert_eq!((history.job.frames[1].seconds.stitch, history.job.frames[1].seconds.reconstruct), (1.0, 2.0), "its part of the window");
    let done = history.apply(Event::Solved { window: 1, outcome: Ok(solved(3)) });
    assert_eq!(errands(&done), [Errand::Assemble { frame: 2 }]);
    assert_eq!(history.job.shares(2).len(), 2);
    assert_eq!(errands(&render(&mut history, 8)), [Errand::Window { window: 2 }]);
    let done = history.apply(Event::Solved { window: 2, outcome: Ok(solved(3)) });
    assert_eq!(errands(&done), [3, 4, 5].map(|frame| Errand::Assemble { frame }));
    (0..4).for_each(|_| history.assemble(true));
    assert_eq!(history.job.state, JobState::Done);
    assert!(history.apply(Event::Solved { window: 2, outcome: Err("too late".into()) }).is_empty());
}

#[test]
fn a_restart_begins_exactly_the_windows_that_are_missing() {
    let mut history = History::of(record_with_windows());
    render(&mut history, 6 * 8);
    history.apply(Event::Solved { window: 1, outcome: Ok(solved(3)) });
    let (job, actions) = Job::restore(history.stored(), history.now, TTL).unwrap();
    assert_eq!(errands(&actions), [Errand::Window { window: 0 }, Errand::Window { window: 2 }]);
    invariants::check(&job).unwrap();
    history.job = job;
    let done = history.apply(Event::Solved { window: 0, outcome: Ok(solved(3)) });
    assert_eq!(errands(&done), [0, 1, 2].map(|frame| Errand::Assemble { frame }));
    let (job, actions) = Job::restore(history.stored(), history.now, TTL).unwrap();
    let frames = [0, 1, 2].map(|frame| Errand::Assemble { frame });
    assert_eq!(errands(&actions), [&frames[..], &[Errand::Window { window: 2 }]].concat());
    invariants::check(&job).unwrap();
}

#[test]
fn a_window_that_cannot_be_solved_fails_the_job_with_its_frames() {
    let mut history = History::of(record_with_windows());
    render(&mut history, 5 * 8);
    let actions = history.apply(Event::Solved { window: 1, outcome: Err("no memory".into()) });
    assert_eq!(errands(&actions), [Errand::Release]);
    assert_eq!(history.job.error.as_deref(), Some("frames 6 to 8 could not be reconstructed together: no memory"));
    assert!(history.apply(Event::Solved { window: 0, outcome: Ok(solved(3)) }).is_empty(), "nothing is done for a job that is over");
}

#[test]
fn a_paused_job_gets_no_leases_and_counts_what_comes_in() {
    let mut history = History::of(record_with_windows());
    history.lease(0);
    let grant = history.grants[0];
    assert_eq!(history.apply(Event::Paused { paused: true }).len(), 2);
    assert!(history.apply(Event::Paused { paused: true }).is_empty(), "pausing twice changes nothing");
    assert_eq!(history.job.next_for(history.workers[1], &[]), None);
    let refused = history.apply(Event::Leased { unit: 1, worker: history.workers[1], until: history.now + TTL });
    assert!(refused.is_empty());
    history.deliver(grant, false);
    assert_eq!(history.job.units_done(), 1);
    history.step(&Step::Restart);
    assert!(history.job.paused, "it stays paused over a restart");
    history.apply(Event::Paused { paused: false });
    assert_eq!(history.job.next_for(history.workers[1], &[]), Some(1));
}
