//! One job: what it is, which states it passes through, and the pure machine that moves it.
//!
//! [`apply`] takes a job, an event and the time, changes the job and returns what is to be done about it. It does nothing itself: no
//! clock, no store, no channel. Each event has its own file in `event/`; what must always hold is written in `invariants`.

mod action;
mod checks;
mod event;
mod evidence;
mod frame;
mod guides;
mod identity;
pub mod invariants;
mod named;
pub(crate) mod needs;
mod pace;
mod record;
mod restore;
mod settle;
mod state;
mod unit;
mod verify;
mod windows;

#[cfg(test)]
pub(crate) mod tests;

use std::collections::BTreeMap;
use std::sync::Arc;

use gradfarm_core::film::Statistics;
use gradfarm_core::lattice::Moment;
use gradfarm_core::plan::{Guide, TileGuide};
use gradfarm_proto::Digest;

pub use action::{Action, Answer, Errand, News};
pub use event::{Assembled, Event, Measured, submit};
pub use evidence::{Attempt, Ending};
pub use frame::{Frame, Seconds};
pub use identity::{JobId, ParseIdError, WorkerId};
pub use named::named;
pub use needs::{Capabilities, Lack, Needs};
pub use record::{Change, DeliveredRecord, FileRecord, JobRecord, StoredJob, StoredUnit};
pub use state::{FileKind, FrameState, JobState};
pub use unit::{Unit, UnitState};
pub use verify::Witness;
pub use windows::{JobWindows, ShareRecord, SolvedWindow, WindowState};

pub use crate::clock::Timestamp;
use crate::schedule::Split;
use guides::FrameGuides;
use unit::Units;

/// Failures of one unit after which it is given up.
pub const MOST_FAILURES: u32 = 5;
/// Losses of one unit (its worker died or fell silent) after which it is given up: such a unit may be what kills them.
pub const MOST_LOSSES: u32 = 12;

/// Most units of a job that debug builds check after every event: a check looks at all of them.
const CHECKED: u32 = 1024;

/// A job in memory.
#[derive(Clone, Debug)]
pub struct Job {
    /// What never changes.
    pub record: JobRecord,
    /// Its units.
    pub split: Split,
    /// Where it stands.
    pub state: JobState,
    /// Why it failed.
    pub error: Option<String>,
    /// When its first unit was leased.
    pub started: Option<Timestamp>,
    /// When it reached its final state.
    pub finished: Option<Timestamp>,
    /// Its frames, by position.
    pub frames: Vec<Frame>,
    /// Whether it gets no leases for the time being.
    pub paused: bool,
    guides: Vec<FrameGuides>,
    units: Units,
    windows: Option<JobWindows>,
    /// Attempts that came to nothing, by unit.
    evidence: BTreeMap<u32, Vec<Attempt>>,
    /// Results of units that are compared and not decided.
    witnesses: BTreeMap<u32, Vec<Witness>>,
    pace: pace::Pace,
}

/// A unit whose guide is not there: it was lost in a crash, and is being made again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the guide of this unit is being made again")]
pub struct Unguided;

/// Moves a job by one event. Events that come too late, twice or out of turn change nothing and are answered as such.
pub fn apply(job: &mut Job, event: Event, now: Timestamp) -> Vec<Action> {
    let actions = event.apply(job, now);
    debug_assert_eq!(if job.split.units() <= CHECKED { invariants::check(job) } else { Ok(()) }, Ok(()));
    actions
}

impl Job {
    /// The moment at a position.
    pub fn moment(&self, position: u32) -> Moment {
        self.split.moments()[position as usize]
    }

    /// A unit, if the job has it in memory.
    pub fn unit(&self, unit: u32) -> Option<&Unit> {
        self.units.get(unit)
    }

    /// The guides of a frame in rounds, as far as they are there, by its position.
    pub fn guides(&self, frame: u32) -> &[Arc<Guide>] {
        self.guides.get(frame as usize).map_or(&[], FrameGuides::made)
    }

    /// What a guide says of a unit: `Ok(None)` if the unit needs none.
    ///
    /// # Errors
    /// If the guide that it needs is not there.
    pub fn guide_of(&self, unit: u32) -> Result<Option<TileGuide>, Unguided> {
        let place = self.split.place(unit);
        let Some(slice) = self.split.passes()[place.pass as usize].slice else { return Ok(None) };
        Guide::of_tile(self.guides(place.frame), &slice, self.split.tiles()[place.tile as usize]).map(Some).ok_or(Unguided)
    }

    /// Whether the unit waits for no guide.
    fn is_open(&self, unit: u32) -> bool {
        let frame = self.split.place(unit).frame;
        self.split.open(frame, self.guides(frame).len()).contains(&unit)
    }

    /// Units that wait for a worker, or for a guide.
    pub fn ready(&self) -> usize {
        self.units.ready().len()
    }

    /// Units that are leased, in order.
    pub fn leased(&self) -> impl Iterator<Item = (u32, &Unit)> {
        self.units.leased().iter().filter_map(|index| Some((*index, self.units.get(*index)?)))
    }

    /// The next unit for a worker. What it failed before, or gave a result for that is compared with others, goes to another one of the workers
    /// that may render the job, if there is one.
    pub fn next_for(&self, worker: WorkerId, eligible: &[WorkerId]) -> Option<u32> {
        if self.state.is_final() || self.paused {
            return None;
        }
        self.open_units().find(|index| {
            let failed_on = self.units.get(*index).and_then(|unit| unit.failed_on);
            let witnesses = self.witnesses(*index);
            let barred = |who: WorkerId| failed_on == Some(who) || witnesses.iter().any(|witness| witness.worker == who);
            !barred(worker) || eligible.iter().all(|other| barred(*other))
        })
    }

    /// Units that wait for a worker and for no guide, in order.
    pub(crate) fn open_units(&self) -> impl Iterator<Item = u32> {
        // Where samples are placed evenly everything is open, and one run of units says so.
        let even = self.split.steering().is_empty();
        let (runs, whole) = match self.only_frame() {
            Some(frame) => (frame..frame + 1, false),
            None if even => (0..1, true),
            None => (0..self.split.frames(), false),
        };
        let run = move |frame| if whole { 0..self.split.units() } else { self.split.open(frame, self.guides(frame).len()) };
        runs.flat_map(move |frame| self.units.ready().range(run(frame)).copied())
    }

    /// Whether it has units that a worker could be given now.
    pub fn has_open_units(&self) -> bool {
        !self.state.is_final() && !self.paused && self.has_ready_units()
    }

    /// The same, paused or not.
    pub fn has_ready_units(&self) -> bool {
        self.open_units().next().is_some()
    }

    /// Whether a guide is being made for any of its frames.
    pub fn is_guided_now(&self) -> bool {
        self.guides.iter().any(FrameGuides::in_the_making)
    }

    /// Leases that are held.
    pub fn leases(&self) -> usize {
        self.units.leased().len()
    }

    /// Leases that a worker holds.
    pub fn leases_of(&self, worker: WorkerId) -> u32 {
        self.units.holders().get(&worker).copied().unwrap_or(0)
    }

    /// Workers that hold leases.
    pub fn workers(&self) -> usize {
        self.units.holders().len()
    }

    /// Whether a result for this lease would count now.
    pub fn awaits(&self, unit: u32, epoch: u32) -> bool {
        !self.state.is_final()
            && self.units.get(unit).is_some_and(|u| u.epoch == epoch && epoch > 0 && !u.state.is_settled())
            && !self.witnesses(unit).iter().any(|witness| witness.epoch == epoch)
    }

    /// Whether this very result was taken in already.
    pub fn has_taken(&self, unit: u32, epoch: u32, content: Digest) -> bool {
        let done = |u: &Unit| u.epoch == epoch && matches!(u.state, UnitState::Done { content: c, .. } if c == content);
        self.units.get(unit).is_some_and(done) || self.witnesses(unit).iter().any(|w| (w.epoch, w.content) == (epoch, content))
    }

    /// Units that are done.
    pub fn units_done(&self) -> u64 {
        self.frames.iter().map(|frame| u64::from(frame.units)).sum()
    }

    /// Camera samples that are done.
    pub fn samples_done(&self) -> u64 {
        self.frames.iter().map(|frame| frame.samples).sum()
    }

    /// Counters summed over the assembled frames.
    pub fn statistics(&self) -> Statistics {
        let mut sum = Statistics::default();
        self.frames.iter().for_each(|frame| sum.merge(&frame.statistics));
        sum
    }

    /// What is kept of the parts that change.
    fn kept(&self) -> Action {
        let id = self.record.id;
        Action::Keep(Change::Job { job: id, state: self.state, error: self.error.clone(), started: self.started, finished: self.finished })
    }

    fn kept_frame(&self, position: u32) -> Action {
        Action::Keep(Change::Frame { job: self.record.id, position, frame: Box::new(self.frames[position as usize].clone()) })
    }

    /// Ends the job in a final state: takes all leases back and says so.
    fn end(&mut self, state: JobState, error: Option<String>, now: Timestamp) -> Vec<Action> {
        let mut actions = Vec::new();
        for index in self.units.leased().clone() {
            if let Some(worker) = self.units.release(index)
                && let Some(epoch) = self.units.get(index).map(|unit| unit.epoch)
            {
                actions.extend([self.freed(index), Action::Revoke { unit: index, epoch, worker }]);
            }
        }
        self.guides.iter_mut().for_each(FrameGuides::drop_all);
        if let Some(windows) = &mut self.windows {
            windows.stop();
            actions.push(Action::Do(Errand::Release));
        }
        self.state = state;
        self.error = error;
        self.finished = Some(now);
        let partial: Vec<u32> = (0..self.split.frames())
            .filter(|p| !matches!(self.frames[*p as usize].state, FrameState::Waiting | FrameState::Done | FrameState::Failed))
            .collect();
        actions.extend(partial.into_iter().map(|position| self.kept_frame(position)));
        actions.push(self.kept());
        actions.push(Action::Tell(News::Job));
        actions
    }
}
