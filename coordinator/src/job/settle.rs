//! A unit is settled when it is done or given up. What waits for units waits for them to be settled: guides, checks, windows, frames.

use super::action::{Action, Errand};
use super::evidence::Attempt;
use super::record::Change;
use super::state::JobState;
use super::unit::UnitState;
use super::{Job, News};
use crate::clock::Timestamp;
use crate::schedule::Place;

/// Units that a job may give up and still go on: a sixteenth of them, within these bounds.
const GIVEN_UP: std::ops::RangeInclusive<u32> = 4..=1024;

impl Job {
    /// Notes an attempt at a unit that came to nothing.
    pub(super) fn attempted(&mut self, unit: u32, attempt: Attempt) -> Action {
        let attempts = self.evidence.entry(unit).or_default();
        let number = attempts.len() as u32;
        attempts.push(attempt.clone());
        Action::Keep(Change::Attempt { job: self.record.id, unit, number, attempt })
    }

    /// Attempts at a unit that came to nothing, in order.
    pub fn attempts(&self, unit: u32) -> &[Attempt] {
        self.evidence.get(&unit).map_or(&[], Vec::as_slice)
    }

    /// Units of a frame that are given up, by the frame's position.
    pub fn given_up(&self, position: u32) -> impl Iterator<Item = u32> {
        let first = position * self.split.units_per_frame();
        let candidates = if self.frames[position as usize].failed_units > 0 { first..first + self.split.units_per_frame() } else { 0..0 };
        let held = self.evidence.range(candidates).map(|(unit, _)| *unit);
        held.filter(|unit| self.unit(*unit).is_some_and(|u| u.state == UnitState::GivenUp))
    }

    /// What is kept of a unit that is not leased any more.
    pub(super) fn freed(&self, unit: u32) -> Action {
        let held = self.unit(unit);
        let (failures, losses) = held.map_or((0, 0), |u| (u.failures, u.losses));
        let given_up = held.is_some_and(|u| u.state == UnitState::GivenUp);
        Action::Keep(Change::Freed { job: self.record.id, unit, failures, losses, given_up })
    }

    /// A unit is given up: its frame goes on without it. The job does not, if nothing of it was ever rendered or too much of it is missing:
    /// then it is the job that is wrong.
    pub(super) fn give_up(&mut self, unit: u32, why: &str, now: Timestamp) -> Vec<Action> {
        self.units.set(unit, UnitState::GivenUp);
        self.witnesses.remove(&unit);
        let place = self.split.place(unit);
        self.frames[place.frame as usize].failed_units += 1;
        let broken = self.windows.as_mut().map_or(Vec::new(), |windows| windows.break_over(place.frame));
        let mut actions = vec![self.freed(unit), Action::Tell(News::Tile { frame: place.frame, tile: place.tile })];
        let work = self.split.work(unit);
        let last = self.attempts(unit).last().map_or("", |attempt| attempt.reason.as_str());
        let what = format!(
            "frame {}, tile at ({}, {}), samples {} to {} {why}: {last}",
            work.moment.first,
            work.tile.x,
            work.tile.y,
            work.samples.first,
            work.samples.end() - 1
        );
        let missing: u32 = self.frames.iter().map(|frame| frame.failed_units).sum();
        let most = (self.split.units() / 16).clamp(*GIVEN_UP.start(), *GIVEN_UP.end());
        if self.units_done() == 0 {
            actions.extend(self.end(JobState::Failed, Some(what), now));
        } else if missing > most {
            let error = format!("{missing} units were given up, {most} may be; the last one: {what}");
            actions.extend(self.end(JobState::Failed, Some(error), now));
        } else {
            actions.extend(self.assemble_under(broken, place.frame));
            actions.extend(self.settled(place));
        }
        actions
    }

    /// A unit is settled: what waited for nothing else goes on.
    pub(super) fn settled(&mut self, place: Place) -> Vec<Action> {
        self.guides[place.frame as usize].done(&self.split, place.pass);
        let mut actions: Vec<Action> = self.next_guide(place.frame).into_iter().collect();
        if self.is_measured_now(place.frame) {
            actions.push(Action::Do(Errand::Measure { frame: place.frame }));
        } else if self.has_all_units(place.frame) {
            actions.extend(self.moment_rendered(place.frame));
        }
        actions
    }
}
