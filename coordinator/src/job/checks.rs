//! How far each frame is to go: to its first check, from check to check, and where it ends.
//!
//! Units beyond a frame's goal do not exist. When all up to it are done, the frame is measured if anything is to be learnt from that, and
//! else assembled. What follows from a measurement is stored before anything is done about it, so the decisions of a clock are made once.

use gradfarm_core::accuracy::{Reason, expected_samples, first_check};
use gradfarm_core::plan::Plan;

use super::Job;
use super::action::{Action, Errand, News};
use super::record::Change;
use super::state::FrameState;
use super::unit::UnitState;
use crate::clock::Timestamp;

/// Samples per pixel to which a frame is rendered at first.
pub(super) fn first_goal(plan: &Plan) -> u32 {
    if plan.stop.has_checks() { first_check(plan.samples, plan.batch) } else { plan.samples }
}

impl Job {
    /// Samples per pixel with which a frame will stop, as far as one can tell now.
    pub fn expected_samples(&self, position: u32) -> u32 {
        let (plan, frame) = (&self.record.plan, &self.frames[position as usize]);
        if frame.stopped.is_some() || frame.state == FrameState::Done {
            return frame.goal;
        }
        expected_samples(&plan.stop, plan.samples, frame.goal, &frame.points)
    }

    /// Units of a frame up to its goal.
    pub(super) fn units_to_goal(&self, position: u32) -> u32 {
        self.split.passes_within(self.frames[position as usize].goal) * self.split.units_per_pass()
    }

    /// Makes the units up to a frame's goal.
    pub(super) fn open_to_goal(&mut self, position: u32) {
        self.units.open(position, self.units_to_goal(position));
    }

    /// Whether all units of a frame up to its goal are done.
    pub(super) fn has_all_units(&self, position: u32) -> bool {
        let frame = &self.frames[position as usize];
        frame.state == FrameState::Rendering && frame.units + frame.failed_units == self.units_to_goal(position)
    }

    /// Whether a frame is being measured: it goes on from there, or not.
    pub fn is_measured_now(&self, position: u32) -> bool {
        let in_question = self.record.plan.stop.has_checks() && self.frames[position as usize].stopped.is_none();
        in_question && self.has_all_units(position)
    }

    /// The one frame that is worked on, where each has a time of its own.
    pub(super) fn only_frame(&self) -> Option<u32> {
        self.record.plan.stop.seconds?;
        let unfinished = |state| matches!(state, FrameState::Waiting | FrameState::Rendering);
        self.frames.iter().position(|frame| unfinished(frame.state)).map(|position| position as u32)
    }

    /// A frame has all units that it will get: it is to be assembled.
    pub(super) fn finish_frame(&mut self, position: u32) -> Vec<Action> {
        self.guides[position as usize].drop_all();
        self.frames[position as usize].state = FrameState::Assembling;
        vec![self.kept_frame(position), Action::Do(Errand::Assemble { frame: position }), Action::Tell(News::Frame(position))]
    }

    /// Whether a frame has to end because its time is over.
    pub fn has_frames_out_of_time(&self, now: Timestamp) -> bool {
        self.frames_out_of_time(now).next().is_some()
    }

    /// Frames whose time is over although the units of their goal are not all there, and that have a whole pass to show.
    pub(super) fn frames_out_of_time(&self, now: Timestamp) -> impl Iterator<Item = u32> {
        let budget = self.record.plan.stop.seconds.into_iter();
        let timed = budget.flat_map(|budget| (0..self.split.frames()).map(move |position| (position, budget)));
        let late = timed.filter(move |(position, budget)| {
            let frame = &self.frames[*position as usize];
            let (Some(started), FrameState::Rendering) = (frame.started, frame.state) else { return false };
            // To make an image of it takes as long as it did the last time.
            let finish = frame.points.last().map_or(0.0, |point| point.check_seconds);
            now.seconds_since(started) + finish >= *budget && !self.has_all_units(*position) && self.whole_passes(*position) > 0
        });
        late.map(|(position, _)| position)
    }

    /// How many of a frame's first passes are done in full.
    fn whole_passes(&self, position: u32) -> u32 {
        let units = self.units.of_frame(position);
        let done = units.iter().take_while(|unit| unit.state.is_settled()).count() as u32;
        done / self.split.units_per_pass()
    }

    /// Ends a frame with the passes that it has in full; what was begun beyond them is dropped.
    pub(super) fn cut_short(&mut self, position: u32) -> Vec<Action> {
        let passes = self.whole_passes(position);
        let Some(last) = passes.checked_sub(1).and_then(|last| self.split.passes().get(last as usize)) else { return Vec::new() };
        let goal = last.samples.end();
        let mut actions = Vec::new();
        for (index, unit) in self.units.close(position, passes * self.split.units_per_pass()) {
            match unit.state {
                UnitState::Leased { worker, .. } => {
                    let (failures, losses) = (unit.failures, unit.losses);
                    actions.push(Action::Keep(Change::Freed { job: self.record.id, unit: index, failures, losses, given_up: false }));
                    actions.push(Action::Revoke { unit: index, epoch: unit.epoch, worker });
                }
                UnitState::Done { .. } => {
                    let samples = self.split.samples(index);
                    let frame = &mut self.frames[position as usize];
                    (frame.units, frame.samples) = (frame.units - 1, frame.samples - samples);
                }
                UnitState::GivenUp => self.frames[position as usize].failed_units -= 1,
                UnitState::Ready => {}
            }
        }
        let frame = &mut self.frames[position as usize];
        (frame.goal, frame.stopped) = (goal, Some(Reason::Seconds));
        actions.extend(self.finish_frame(position));
        actions
    }
}
