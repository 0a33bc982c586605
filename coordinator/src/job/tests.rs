//! Random histories of a job: double execution, late deliveries, expiry, lost workers, restarts. The invariants hold after every
//! event, and the store never meets a change that does not fit.

use std::collections::BTreeMap;
use std::time::Duration;

use gradfarm_core::accuracy::Estimate;
use gradfarm_core::film::{Image, Noise};
use gradfarm_core::plan::{Plan, Stop};
use gradfarm_core::reconstruction::SolveReport;
use gradfarm_proto::Digest;
use proptest::prelude::*;

use super::*;

mod checks;
mod guides;
mod model;
mod trouble;
pub(crate) mod windows;

use crate::schedule::Place;
use crate::schedule::split::tests::{plan, single};
use crate::store::{Memory, Store};

const TTL: Duration = Duration::from_secs(15);

/// A step of a history. Numbers pick among what there is, modulo its length.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    Lease { worker: usize },
    Renew { grant: usize },
    Return { grant: usize },
    Lose { worker: usize },
    Pass { millis: u64 },
    Deliver { grant: usize, wrong: bool },
    Fail { grant: usize },
    Assemble { works: bool },
    Guide { works: bool },
    Measure { error: f64, works: bool },
    Solve { works: bool },
    Pause { paused: bool },
    Prioritise { priority: i32 },
    Retry { frame: Option<u32> },
    Stick { grant: usize },
    Cancel,
    Restart,
}

pub(crate) fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        30 => (0usize..3).prop_map(|worker| Step::Lease { worker }),
        8 => any::<usize>().prop_map(|grant| Step::Renew { grant }),
        4 => any::<usize>().prop_map(|grant| Step::Return { grant }),
        4 => (0usize..3).prop_map(|worker| Step::Lose { worker }),
        8 => (0u64..20_000).prop_map(|millis| Step::Pass { millis }),
        30 => (any::<usize>(), prop::bool::weighted(0.05)).prop_map(|(grant, wrong)| Step::Deliver { grant, wrong }),
        8 => any::<usize>().prop_map(|grant| Step::Fail { grant }),
        8 => prop::bool::weighted(0.95).prop_map(|works| Step::Assemble { works }),
        8 => prop::bool::weighted(0.98).prop_map(|works| Step::Guide { works }),
        8 => (1e-3..0.1f64, prop::bool::weighted(0.98)).prop_map(|(error, works)| Step::Measure { error, works }),
        8 => prop::bool::weighted(0.98).prop_map(|works| Step::Solve { works }),
        2 => prop::bool::weighted(0.3).prop_map(|paused| Step::Pause { paused }),
        1 => (-2i32..2).prop_map(|priority| Step::Prioritise { priority }),
        3 => prop::option::of(0u32..2).prop_map(|frame| Step::Retry { frame }),
        2 => any::<usize>().prop_map(|grant| Step::Stick { grant }),
        1 => Just(Step::Cancel),
        3 => Just(Step::Restart),
    ];
    prop::collection::vec(step, 1..120)
}

/// A job of 2 frames × 2 passes × 4 tiles.
pub(crate) fn record(name: &str) -> JobRecord {
    JobRecord {
        id: JobId::fresh(),
        name: name.into(),
        priority: 0,
        created: Timestamp::from_millis(1_000),
        client_token: None,
        scene: Digest::of(b"a scene"),
        plan: plan(8, 8, 20),
        tile: 4,
        first_frame: 3,
        frame_count: 2,
        moments: single(3..5),
        needs: Needs::default(),
    }
}

/// The same with a target and a time: 2 frames of up to 7 passes, the last one of 4 samples, × 4 tiles.
pub(crate) fn record_with_checks() -> JobRecord {
    let stop = Stop { error: Some(0.01), seconds: Some(100.0), curve: false };
    JobRecord { plan: Plan { stop, ..plan(8, 8, 100) }, ..record("with checks") }
}

/// The same in three rounds: 2 frames × 5 passes × 4 tiles, of which two passes are guided.
fn record_in_rounds() -> JobRecord {
    JobRecord { plan: Plan { rounds: 3, ..plan(8, 8, 24) }, ..record("in rounds") }
}

/// The same with a target: 2 frames of up to 13 passes × 4 tiles, in a first round of 4 and doublings of 4 and 8.
pub(super) fn record_in_rounds_with_checks() -> JobRecord {
    let stop = Stop { error: Some(0.01), ..Stop::default() };
    JobRecord { plan: Plan { rounds: 3, stop, ..plan(8, 8, 200) }, ..record("in rounds with checks") }
}

/// A guide that spreads samples evenly.
fn some_guide(plan: &Plan, round: u32) -> Guide {
    let image = || Image::new(plan.extent, 1);
    let noise = || Noise { grey: image(), primal: image(), gradients: image() };
    Guide::new(plan, 0, round, &[noise(), noise()], &[] as &[Guide])
}

pub(crate) fn result(unit: u32, wrong: bool) -> DeliveredRecord {
    let content = Digest::of(format!("unit {unit} {}", if wrong { "damaged" } else { "" }).as_bytes());
    DeliveredRecord { content, blob: content, size: 100, load: 0.0, compile: 0.0, render: 0.25 }
}

/// What comes of assembling a frame of so many units.
pub(crate) fn assembled(units: u32) -> Assembled {
    let file = FileRecord { kind: FileKind::Exr, blob: Digest::of(b"image"), size: 5 };
    let statistics = Statistics::from_counts(&[16]);
    Assembled {
        files: vec![file],
        units,
        seconds: Seconds::default(),
        error: Some(Estimate { relmse: 0.5, low: 0.4, high: 0.6 }),
        choice: None,
        statistics,
    }
}

/// A job, the store behind it, and everything that was granted and counted.
pub(crate) struct History {
    pub(crate) job: Job,
    pub(crate) store: Memory,
    pub(crate) changes: Vec<Vec<Change>>,
    now: Timestamp,
    workers: Vec<WorkerId>,
    grants: Vec<(u32, u32, WorkerId)>,
    counted: BTreeMap<u32, (u32, Digest)>,
}

fn wait<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(future)
}

impl History {
    pub(crate) fn new() -> Self {
        Self::of(record("history"))
    }

    pub(crate) fn of(record: JobRecord) -> Self {
        let (job, actions) = submit(record).unwrap();
        let mut history = Self {
            job,
            store: Memory::new(),
            changes: Vec::new(),
            now: Timestamp::from_millis(5_000),
            workers: (0..3).map(|_| WorkerId::fresh()).collect(),
            grants: Vec::new(),
            counted: BTreeMap::new(),
        };
        history.keep(&actions);
        history
    }

    fn keep(&mut self, actions: &[Action]) {
        let changes: Vec<Change> =
            actions.iter().filter_map(|a| if let Action::Keep(change) = a { Some(change.clone()) } else { None }).collect();
        for change in &changes {
            if let Change::Withdrawn { unit, .. } = change {
                assert!(self.counted.remove(unit).is_some(), "only what counted is withdrawn");
            }
        }
        wait(self.store.commit(&changes)).expect("the machine's changes fit the store");
        self.changes.push(changes);
    }

    fn apply(&mut self, event: Event) -> Vec<Action> {
        let was_final = self.job.state.is_final().then_some(self.job.state);
        let actions = apply(&mut self.job, event, self.now);
        self.keep(&actions);
        if let Some(state) = was_final {
            assert_eq!(self.job.state, state, "a final state is final");
            assert!(!actions.iter().any(|a| matches!(a, Action::Grant { .. } | Action::Do(_))), "I9: no grant after the end");
        }
        self.check();
        actions
    }

    fn check(&self) {
        invariants::check(&self.job).unwrap();
        for (unit, (epoch, content)) in &self.counted {
            if let Some(held) = self.job.unit(*unit) {
                assert_eq!(held.epoch, *epoch, "I2: unit {unit} was granted again after it was done");
                assert!(matches!(held.state, UnitState::Done { content: c, .. } if c == *content), "I2: {:?}", held.state);
            }
        }
    }

    pub(crate) fn stored(&self) -> StoredJob {
        wait(self.store.jobs()).unwrap().remove(0)
    }

    fn pick(&self, grant: usize) -> Option<(u32, u32, WorkerId)> {
        (!self.grants.is_empty()).then(|| self.grants[grant % self.grants.len()])
    }

    pub(crate) fn lease(&mut self, worker: usize) {
        let worker = self.workers[worker];
        let Some(unit) = self.job.next_for(worker, &self.workers) else { return };
        let actions = self.apply(Event::Leased { unit, worker, until: self.now + TTL });
        let granted: Vec<_> = actions
            .iter()
            .filter_map(|a| if let Action::Grant { unit, epoch, worker } = a { Some((*unit, *epoch, *worker)) } else { None })
            .collect();
        assert_eq!(granted.len(), 1);
        assert!(!self.grants.iter().any(|(u, e, _)| (*u, *e) == (granted[0].0, granted[0].1)), "I1: an epoch is granted once");
        self.grants.extend(granted);
    }

    pub(crate) fn deliver(&mut self, (unit, epoch, worker): (u32, u32, WorkerId), wrong: bool) {
        let result = result(unit, wrong);
        let Some(before) = self.job.unit(unit).copied() else {
            let actions = self.apply(Event::Delivered { unit, epoch, worker, result });
            return assert_eq!(actions, [Action::Answer(Answer::Superseded)], "nothing counts beyond the end of a frame");
        };
        let (due, again) = (self.job.awaits(unit, epoch), self.job.has_taken(unit, epoch, result.content));
        let compared = self.job.is_verified(unit);
        let actions = self.apply(Event::Delivered { unit, epoch, worker, result });
        let expected = if due || again { Answer::Accepted } else { Answer::Superseded };
        assert!(actions.contains(&Action::Answer(expected)), "I3: {before:?} met epoch {epoch}: {actions:?}");
        let kept = actions.iter().any(|a| matches!(a, Action::Keep(Change::Delivered { .. })));
        assert!(kept == due || due && compared, "I3: a result is kept exactly when it counts");
        if kept {
            assert_eq!(self.counted.insert(unit, (epoch, result.content)), None, "a unit counts once");
        }
        for action in actions {
            if let Action::Distrust { worker, .. } = action {
                self.apply(Event::Distrusted { worker });
            }
        }
    }

    pub(crate) fn assemble(&mut self, works: bool) {
        let Some(frame) = self.job.frames.iter().position(|f| f.state == FrameState::Assembling) else { return };
        let units = self.job.frames[frame].units;
        let outcome = if works { Ok(assembled(units)) } else { Err("disk full".into()) };
        self.apply(Event::Assembled { frame: frame as u32, outcome });
    }

    /// Renders all units that there are.
    fn finish_units(&mut self) {
        while self.job.next_for(self.workers[0], &[]).is_some() {
            self.lease(0);
            let grant = *self.grants.last().unwrap();
            self.deliver(grant, false);
        }
    }

    /// Tries again, which alone may open a job that is over.
    fn retry(&mut self, frame: Option<u32>) -> Vec<Action> {
        let (state, possible) = (self.job.state, self.job.can_be_retried(frame));
        let actions = apply(&mut self.job, Event::Retried { frame }, self.now);
        self.keep(&actions);
        assert!(possible || actions.is_empty(), "nothing is done where nothing failed");
        assert!(possible || self.job.state == state);
        assert!(state != JobState::Cancelled || self.job.state == state, "I9: cancelled is for ever");
        self.check();
        actions
    }

    /// Makes a guide that is asked for: the first one of the frames in order.
    fn guide(&mut self, works: bool) {
        let Some(frame) = self.job.guides.iter().position(FrameGuides::in_the_making) else { return };
        let (frame, split) = (frame as u32, self.job.split.clone());
        let made = self.job.guides(frame).len();
        let steering = (0..split.passes().len() as u32).filter(|pass| split.steers(*pass, made as u32 + 1));
        for unit in steering.flat_map(|pass| (0..4).map(move |tile| Place { frame, pass, tile })).map(|place| split.unit(place)) {
            let again = !self.job.attempts(unit).is_empty();
            assert!(again || self.job.unit(unit).unwrap().state.is_settled(), "a guide is asked for when its units are settled");
        }
        let outcome = if works { Ok(Arc::new(some_guide(&self.job.record.plan, made as u32 + 1))) } else { Err("no memory".into()) };
        self.apply(Event::Guided { frame, round: made as u32 + 1, outcome });
        if works {
            assert_eq!(self.job.guides(frame).len(), made + 1);
            let nothing = self.apply(Event::Guided { frame, round: made as u32 + 1, outcome: Err("too late".into()) });
            assert!(nothing.is_empty(), "a guide is made once");
        }
    }

    /// Measures a frame that is to be measured: the first one in order.
    fn measure(&mut self, relmse: f64, works: bool) {
        let Some(frame) = (0..self.job.split.frames()).find(|frame| self.job.is_measured_now(*frame)) else { return };
        let goal = self.job.frames[frame as usize].goal;
        let of_frame = self.job.units.of_frame(frame);
        assert_eq!(of_frame.len() as u32, self.job.split.passes_within(goal) * 4);
        assert!(of_frame.iter().all(|unit| matches!(unit.state, UnitState::Done { .. })), "a frame is measured when its units are done");
        let measured = Measured { samples: goal, error: Some(Estimate { relmse, low: 0.9 * relmse, high: 1.1 * relmse }), seconds: 0.5 };
        let outcome = if works { Ok(measured) } else { Err("no memory".into()) };
        let over = self.job.state.is_final();
        let actions = self.apply(Event::Measured { frame, outcome });
        if over {
            assert!(actions.is_empty(), "nothing is done for a job that is over");
        } else if works {
            let after = &self.job.frames[frame as usize];
            assert_eq!((after.points.last().unwrap().samples, after.points.last().unwrap().error.relmse), (goal, relmse));
            assert_eq!(after.stopped.is_some(), after.goal == goal, "it stops, or goes on");
            assert!(self.apply(Event::Measured { frame, outcome: Ok(measured) }).is_empty(), "a check counts once");
        }
    }

    /// Solves a window that is to be solved: the first one in order.
    fn solve(&mut self, works: bool) {
        let Some(windows) = self.job.windows() else { return };
        let Some(window) = windows.states.iter().position(|state| *state == WindowState::Solving) else { return };
        let moments = windows.layout.moments(window as u32);
        assert!(moments.clone().all(|position| self.job.is_in(position)), "a window is solved when its moments are rendered");
        let outcome = if works { Ok(windows::solved(moments.len() as u32)) } else { Err("no memory".into()) };
        self.apply(Event::Solved { window: window as u32, outcome: outcome.clone() });
        assert!(self.apply(Event::Solved { window: window as u32, outcome }).is_empty(), "a window is solved once");
    }

    pub(crate) fn step(&mut self, step: &Step) {
        match step {
            Step::Lease { worker } => self.lease(*worker),
            Step::Renew { grant } => {
                if let Some((unit, epoch, worker)) = self.pick(*grant) {
                    let gone = |u: &Unit| u.epoch != epoch || u.state == UnitState::GivenUp;
                    let stands = self.job.unit(unit).is_some_and(|u| !gone(u)) && !self.job.state.is_final();
                    let actions = self.apply(Event::Renewed { unit, epoch, worker, until: self.now + TTL });
                    assert_eq!(actions.is_empty(), stands, "a lease is renewed exactly while its epoch stands");
                }
            }
            Step::Return { grant } => {
                if let Some((unit, epoch, worker)) = self.pick(*grant) {
                    self.apply(Event::Returned { unit, epoch, worker });
                }
            }
            Step::Lose { worker } => {
                self.apply(Event::Lost { worker: self.workers[*worker] });
            }
            Step::Pass { millis } => {
                self.now = self.now + Duration::from_millis(*millis);
                self.apply(Event::Expired);
                let now = self.now;
                let overdue = |unit: &Unit| matches!(unit.state, UnitState::Leased { until, .. } if until <= now);
                assert!(!self.job.leased().any(|(_, unit)| overdue(unit)));
            }
            Step::Deliver { grant, wrong } => {
                if let Some(grant) = self.pick(*grant) {
                    self.deliver(grant, *wrong);
                }
            }
            Step::Fail { grant } => {
                if let Some((unit, epoch, worker)) = self.pick(*grant) {
                    self.apply(Event::Failed { unit, epoch, worker, reason: "no memory".into() });
                }
            }
            Step::Assemble { works } => self.assemble(*works),
            Step::Guide { works } => self.guide(*works),
            Step::Measure { error, works } => self.measure(*error, *works),
            Step::Solve { works } => self.solve(*works),
            Step::Pause { paused } => {
                self.apply(Event::Paused { paused: *paused });
            }
            Step::Prioritise { priority } => {
                self.apply(Event::Prioritised { priority: *priority });
            }
            Step::Retry { frame } => drop(self.retry(*frame)),
            Step::Stick { grant } => {
                if let Some((unit, epoch, worker)) = self.pick(*grant) {
                    self.apply(Event::Stuck { unit, epoch, worker, reason: "no progress".into() });
                }
            }
            Step::Cancel => {
                self.apply(Event::Cancelled);
                assert!(self.job.state.is_final());
            }
            Step::Restart => {
                let stored = self.stored();
                let (job, actions) = Job::restore(stored, self.now, TTL).unwrap();
                let assembly = |a: &&Action| matches!(a, Action::Do(Errand::Assemble { .. }));
                let pending = self.job.frames.iter().filter(|f| f.state == FrameState::Assembling).count();
                let begun = actions.iter().filter(assembly).count();
                assert_eq!(begun, if job.state.is_final() { 0 } else { pending }, "assembly begins again");
                for (old, new) in self.job.guides.iter().zip(&job.guides) {
                    let had = old.in_the_making() || !old.made().is_empty();
                    assert_eq!(had, new.in_the_making(), "guides are made again, from the first one on");
                    assert!(new.made().is_empty());
                }
                let measured = |a: &&Action| matches!(a, Action::Do(Errand::Measure { .. }));
                let pending = (0..job.split.frames()).filter(|frame| !job.state.is_final() && self.job.is_measured_now(*frame)).count();
                assert_eq!(actions.iter().filter(measured).count(), pending, "measurements begin again");
                let solving = |job: &Job| job.windows().map_or(0, |w| w.states.iter().filter(|s| **s == WindowState::Solving).count());
                let begun = actions.iter().filter(|a| matches!(a, Action::Do(Errand::Window { .. }))).count();
                assert_eq!((begun, solving(&job)), (solving(&self.job), solving(&self.job)), "windows begin again");
                assert_eq!(job.windows(), self.job.windows());
                assert_eq!((job.state, &job.error, job.paused), (self.job.state, &self.job.error, self.job.paused));
                for (old, new) in self.job.frames.iter().zip(&job.frames) {
                    assert_eq!((old.state, old.units, old.samples), (new.state, new.units, new.samples));
                    assert_eq!((old.goal, old.stopped, &old.points), (new.goal, new.stopped, &new.points), "decisions are kept");
                }
                self.job = job;
                if self.job.units.all().next().is_none() {
                    self.counted.clear();
                    self.grants.clear();
                }
                self.check();
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn invariants_hold_through_any_history(steps in steps(), kind in 0..7, salt: u8) {
        // Which units are verified depends on the name: the same history must be the same again.
        let id = JobId::from_bytes([salt; 16]);
        let verified = |record: JobRecord| JobRecord { id, needs: Needs { verify: 0.5, ..Needs::default() }, ..record };
        let records = [
            record("even"),
            record_in_rounds(),
            record_with_checks(),
            windows::record_with_windows(),
            record_in_rounds_with_checks(),
            verified(record("verified")),
            verified(windows::record_with_windows()),
        ];
        let mut history = History::of(records[kind as usize].clone());
        for step in &steps {
            history.step(step);
        }
        history.step(&Step::Pause { paused: false });
        // Whatever happened: a farm that works from here on finishes the job, and what failed before when it is tried again.
        history.work_to_the_end();
        if history.job.can_be_retried(None) {
            history.retry(None);
            history.work_to_the_end();
        }
        let whole = history.job.frames.iter().all(|frame| frame.state == FrameState::Done && frame.failed_units == 0);
        prop_assert!(history.job.state == JobState::Cancelled || history.job.state == JobState::Done && whole, "{:?}", history.job.error);
    }
}

impl History {
    /// Each turn everybody works once. A turn can lose ground, for what a worker did that is shown to be wrong is done anew; but not for ever.
    fn work_to_the_end(&mut self) {
        self.step(&Step::Pause { paused: false });
        for _ in 0..300 {
            if self.job.state.is_final() {
                return;
            }
            self.step(&Step::Pass { millis: 16_000 });
            self.guide(true);
            self.measure(0.02, true);
            for worker in 0..3 {
                let grants = self.grants.len();
                self.lease(worker);
                if let Some(grant) = self.grants.get(grants).copied() {
                    self.deliver(grant, false);
                }
            }
            self.solve(true);
            self.assemble(true);
        }
        panic!("the job does not end: {:?} of {}", self.job.frames, self.job.units_done());
    }
}

#[test]
fn cancelling_takes_leases_back_and_refuses_late_results() {
    let mut history = History::new();
    history.lease(0);
    history.lease(1);
    let grants = history.grants.clone();
    let actions = history.apply(Event::Cancelled);
    for (unit, epoch, worker) in &grants {
        assert!(actions.contains(&Action::Revoke { unit: *unit, epoch: *epoch, worker: *worker }));
    }
    history.deliver(grants[0], false);
    assert_eq!((history.job.state, history.job.units_done()), (JobState::Cancelled, 0));
}
