//! Units that are given up, what their frames and windows make of it, and what trying again does; workers that are stuck or wrong.

use super::*;

impl History {
    /// Fails the next unit as often as it takes until it is given up.
    fn poison(&mut self) -> u32 {
        let unit = self.job.next_for(self.workers[0], &[]).unwrap();
        for round in 0..MOST_FAILURES as usize {
            self.lease(round % 3);
            let (leased, epoch, worker) = *self.grants.last().unwrap();
            assert_eq!(leased, unit);
            self.apply(Event::Failed { unit, epoch, worker, reason: format!("no memory, {round}") });
        }
        unit
    }

    /// Renders so many units.
    pub(super) fn render_some(&mut self, units: usize) {
        for _ in 0..units {
            self.lease(0);
            let grant = *self.grants.last().unwrap();
            self.deliver(grant, false);
        }
    }

    fn finish(&mut self) {
        while self.job.next_for(self.workers[0], &[]).is_some() {
            self.render_some(1);
        }
        while self.job.frames.iter().any(|frame| frame.state == FrameState::Assembling) {
            self.assemble(true);
        }
    }
}

#[test]
fn a_unit_that_is_given_up_keeps_its_evidence_and_its_frame_is_made_without_it() {
    let mut history = History::new();
    history.render_some(2);
    let unit = history.poison();
    assert_eq!((unit, history.job.state, history.job.unit(unit).unwrap().state), (2, JobState::Running, UnitState::GivenUp));
    let evidence: Vec<(WorkerId, &str)> = history.job.attempts(unit).iter().map(|a| (a.worker, a.reason.as_str())).collect();
    let [a, b, c] = [0, 1, 2].map(|k| history.workers[k]);
    assert_eq!(evidence, [(a, "no memory, 0"), (b, "no memory, 1"), (c, "no memory, 2"), (a, "no memory, 3"), (b, "no memory, 4")]);
    history.finish();
    assert_eq!((history.job.state, history.job.units_done()), (JobState::Done, 2 * 8 - 1));
    assert_eq!((history.job.frames[0].failed_units, history.job.frames[1].failed_units), (1, 0));
    // It is all there after a restart, and trying again makes it whole.
    history.step(&Step::Restart);
    assert_eq!((history.job.attempts(unit).len(), history.job.given_up(0).collect::<Vec<_>>()), (5, vec![unit]));
    let tried = history.retry(None);
    assert!(tried.contains(&Action::Tell(News::Frame(0))) && !tried.contains(&Action::Tell(News::Frame(1))), "{tried:?}");
    assert_eq!((history.job.state, history.job.next_for(a, &[])), (JobState::Running, Some(unit)));
    history.finish();
    assert_eq!((history.job.state, history.job.units_done(), history.job.frames[0].failed_units), (JobState::Done, 16, 0));
    assert_eq!(history.job.attempts(unit).len(), 5, "the evidence stays");
    assert!(!history.job.can_be_retried(None));
}

#[test]
fn a_job_fails_when_nothing_of_it_works_or_too_much_is_missing_and_goes_on_when_tried_again() {
    let mut history = History::new();
    history.poison();
    assert_eq!(history.job.state, JobState::Failed, "nothing was ever rendered");
    history.retry(None);
    history.render_some(1);
    for _ in 0..4 {
        history.poison();
    }
    assert_eq!(history.job.state, JobState::Running, "a few may be missing");
    history.poison();
    assert_eq!(history.job.state, JobState::Failed);
    assert!(history.job.error.as_deref().unwrap().starts_with("5 units were given up, 4 may be; the last one: frame 3, tile at"));
    history.retry(Some(0));
    assert_eq!((history.job.state, history.job.error.clone()), (JobState::Running, None));
    history.finish();
    assert_eq!((history.job.state, history.job.units_done()), (JobState::Done, 16));
}

#[test]
fn a_frame_that_cannot_be_assembled_does_not_keep_the_others_from_it() {
    let mut history = History::new();
    history.finish_units();
    history.assemble(false);
    assert_eq!((history.job.frames[0].state, history.job.state), (FrameState::Failed, JobState::Running));
    history.assemble(true);
    assert_eq!((history.job.frames[1].state, history.job.state), (FrameState::Done, JobState::Failed));
    assert_eq!(history.job.error.as_deref(), Some("frame 3 could not be assembled: disk full"));
    history.step(&Step::Restart);
    let tried = history.retry(Some(0));
    assert!(tried.contains(&Action::Do(Errand::Assemble { frame: 0 })));
    history.assemble(true);
    assert_eq!(history.job.state, JobState::Done);
}

#[test]
fn moments_under_a_broken_window_are_made_by_themselves_and_again_when_it_is_mended() {
    let mut history = History::of(windows::record_with_windows());
    history.render_some(4);
    let unit = history.poison();
    history.finish_units();
    let windows = history.job.windows().unwrap();
    assert_eq!(windows.states, [WindowState::Broken, WindowState::Solving, WindowState::Solving]);
    let states: Vec<FrameState> = history.job.frames.iter().map(|frame| frame.state).collect();
    use FrameState::{Assembling, Rendering};
    assert_eq!(states, [Assembling, Assembling, Assembling, Rendering, Rendering, Rendering], "those under it wait for nobody");
    assert!(history.job.shares(2).is_empty());
    history.solve(true);
    history.solve(true);
    (0..6).for_each(|_| history.assemble(true));
    assert_eq!(history.job.state, JobState::Done);
    assert_eq!(history.job.shares(2), [], "alone, though the second window over it is solved");
    history.step(&Step::Restart);
    history.retry(None);
    assert_eq!(history.job.next_for(history.workers[0], &[]), Some(unit));
    history.render_some(1);
    history.solve(true);
    (0..3).for_each(|_| history.assemble(true));
    assert_eq!((history.job.state, history.job.shares(2).len()), (JobState::Done, 2));
}

#[test]
fn an_image_that_was_being_made_when_its_frame_was_opened_again_does_not_count() {
    let mut history = History::new();
    history.render_some(1);
    history.poison();
    history.finish_units();
    let units = history.job.frames[0].units;
    history.retry(Some(0));
    history.render_some(1);
    assert_eq!(history.job.frames[0].state, FrameState::Assembling, "it is made again");
    let stale = assembled(units);
    assert!(history.apply(Event::Assembled { frame: 0, outcome: Ok(stale) }).is_empty());
    history.assemble(true);
    assert_eq!(history.job.frames[0].state, FrameState::Done);
}

#[test]
fn a_lease_without_progress_is_taken_back_with_its_reason() {
    let mut history = History::new();
    history.lease(0);
    let (unit, epoch, worker) = history.grants[0];
    let actions = history.apply(Event::Stuck { unit, epoch, worker, reason: "no progress for 60 s".into() });
    assert!(actions.contains(&Action::Revoke { unit, epoch, worker }) && actions.contains(&Action::Blame(worker)));
    assert_eq!(history.job.attempts(unit)[0].ending, Ending::Stuck);
    assert!(history.apply(Event::Stuck { unit, epoch, worker, reason: "again".into() }).is_empty());
    assert_eq!(history.job.next_for(worker, &history.workers), Some(1), "somebody else tries it");
    assert_eq!(history.job.next_for(history.workers[1], &history.workers), Some(0));
    assert_eq!(history.job.patience(), Duration::from_secs(60));
}

#[test]
fn a_worker_that_lies_is_found_and_what_it_gave_unchecked_is_rendered_again() {
    // Which units are compared depends on the job's name: take one with checked and unchecked units among the first four.
    let record = std::iter::repeat_with(|| JobRecord { needs: Needs { verify: 0.5, ..Needs::default() }, ..record("verified") });
    let fits = |r: &JobRecord| {
        let chosen = [0, 1].map(|unit| verify::is_chosen(r.id, unit, 0.5));
        chosen == [false, true]
    };
    let record = record.take(1000).find(fits).unwrap();
    let mut history = History::of(record);
    let lie = |history: &mut History, worker: usize, wrong: bool| {
        history.lease(worker);
        let grant = *history.grants.last().unwrap();
        history.deliver(grant, wrong);
        grant.0
    };
    assert_eq!(lie(&mut history, 0, true), 0, "not checked: the lie counts for now");
    assert_eq!(history.job.units_done(), 1);
    assert_eq!(lie(&mut history, 0, true), 1);
    assert_eq!((history.job.units_done(), history.job.witnesses(1).len()), (1, 1));
    assert_eq!(lie(&mut history, 1, false), 1, "somebody else renders it, too");
    assert_ne!(history.job.next_for(history.workers[0], &history.workers), Some(1));
    assert_eq!(lie(&mut history, 2, false), 1, "two say two things: a third one decides");
    assert!(matches!(history.job.unit(1).unwrap().state, UnitState::Done { content, .. } if content == result(1, false).content));
    assert_eq!(history.job.attempts(1).iter().map(|a| (a.worker, a.ending)).collect::<Vec<_>>(), [(history.workers[0], Ending::Differed)]);
    // The dispatcher would say so to every job; the history does.
    assert_eq!((history.job.units_done(), history.job.unit(0).unwrap().state), (1, UnitState::Ready), "its earlier result is withdrawn");
    assert_ne!(history.job.next_for(history.workers[0], &history.workers), Some(0));
    assert_eq!(history.job.next_for(history.workers[1], &history.workers), Some(0));
    // What it may send once more under the old epoch does not count.
    history.deliver((0, 1, history.workers[0]), true);
    assert_eq!(history.job.units_done(), 1);
    history.step(&Step::Restart);
    assert_eq!(history.job.units_done(), 1);
}

#[test]
fn a_unit_that_keeps_failing_fails_its_job_with_the_reason() {
    let mut history = History::new();
    for round in 0..MOST_FAILURES {
        history.lease(round as usize % 3);
        let (unit, epoch, worker) = *history.grants.last().unwrap();
        assert_eq!(unit, 0);
        if round > 0 {
            assert_ne!(
                history.job.next_for(history.workers[(round as usize - 1) % 3], &history.workers),
                Some(0),
                "another pair of hands first"
            );
        }
        let actions = history.apply(Event::Failed { unit, epoch, worker, reason: "no memory".into() });
        assert!(actions.contains(&Action::Blame(worker)));
    }
    assert_eq!(history.job.state, JobState::Failed);
    assert_eq!(
        history.job.error.as_deref(),
        Some("frame 3, tile at (0, 0), samples 0 to 15 failed 5 times, the last time with: no memory")
    );
}

#[test]
fn a_unit_that_keeps_losing_its_workers_fails_its_job() {
    let mut history = History::new();
    for _ in 0..MOST_LOSSES {
        assert!(!history.job.state.is_final());
        history.lease(0);
        history.step(&Step::Lose { worker: 0 });
    }
    assert_eq!(history.job.state, JobState::Failed);
    assert!(history.job.error.as_deref().unwrap().contains("its worker was lost"));
}
