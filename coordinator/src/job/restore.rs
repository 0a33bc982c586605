//! Takes a job up again from what the store kept.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use super::evidence::Attempt;
use super::frame::{Frame, Seconds};
use super::guides::FrameGuides;
use super::pace::Pace;
use super::record::StoredJob;
use super::state::FrameState;
use super::unit::{UnitState, Units};
use super::verify::Witness;
use super::windows::{JobWindows, WindowState};
use super::{Action, Errand, Job, checks};
use crate::clock::Timestamp;
use crate::schedule::{Split, TooManyUnits};

impl Job {
    /// The job as it was when the last change became durable, and what was still to be done.
    ///
    /// Windows that were being solved are begun again. Guides are not stored: those that were there are asked for again, one
    /// after the other. Leases live on for `ttl` from `now`, so that workers who come back keep theirs. Sums of frames are counted again from their
    /// results, for they are only written when a frame is assembled.
    ///
    /// # Errors
    /// If the record cannot be split, which no accepted job's can.
    pub fn restore(stored: StoredJob, now: Timestamp, ttl: Duration) -> Result<(Self, Vec<Action>), TooManyUnits> {
        let StoredJob {
            record,
            state,
            error,
            started,
            finished,
            paused,
            windows: solved,
            frames: kept,
            units: stored_units,
            attempts,
            witnesses,
        } = stored;
        let mut evidence: BTreeMap<u32, Vec<Attempt>> = BTreeMap::new();
        attempts.into_iter().for_each(|(unit, attempt)| evidence.entry(unit).or_default().push(attempt));
        let mut heard: BTreeMap<u32, Vec<Witness>> = BTreeMap::new();
        let mut pace = Pace::default();
        let split = Split::new(&record.plan, &record.moments, record.tile)?;
        let mut frames = vec![Frame::waiting(checks::first_goal(&record.plan)); split.frames() as usize];
        for (position, frame) in kept {
            if let Some(place) = frames.get_mut(position as usize) {
                *place = frame;
            }
        }
        let mut guides = vec![FrameGuides::waiting(&split); frames.len()];
        let mut units = Units::default();
        if !state.is_final() || !stored_units.is_empty() {
            units = Units::closed(split.frames(), split.units_per_frame());
            for (position, frame) in (0..).zip(&frames) {
                units.open(position, split.passes_within(frame.goal) * split.units_per_pass());
            }
            for frame in &mut frames {
                if frame.state != FrameState::Done {
                    (frame.units, frame.samples, frame.failed_units) = (0, 0, 0);
                    frame.seconds = Seconds { render_span: frame.seconds.render_span, ..Seconds::default() };
                }
            }
        }
        for stored in stored_units {
            units.note(stored.unit, |unit| (unit.epoch, unit.failures, unit.losses) = (stored.epoch, stored.failures, stored.losses));
            match (stored.result, stored.lease) {
                (Some(result), _) => {
                    units.set(stored.unit, UnitState::Done { content: result.content, worker: stored.worker });
                    pace.note(result.render);
                    let place = split.place(stored.unit);
                    guides[place.frame as usize].done(&split, place.pass);
                    let frame = &mut frames[place.frame as usize];
                    if frame.state != FrameState::Done {
                        // Of a frame that was cut short there may be results beyond its end: they took time, and that is all.
                        if units.get(stored.unit).is_some() {
                            frame.units += 1;
                            frame.samples += split.samples(stored.unit);
                        }
                        frame.seconds +=
                            Seconds { load: result.load, compile: result.compile, render: result.render, ..Seconds::default() };
                    }
                }
                (None, _) if stored.given_up => {
                    units.set(stored.unit, UnitState::GivenUp);
                    let place = split.place(stored.unit);
                    guides[place.frame as usize].done(&split, place.pass);
                    let frame = &mut frames[place.frame as usize];
                    if frame.state != FrameState::Done && units.get(stored.unit).is_some() {
                        frame.failed_units += 1;
                    }
                }
                (None, Some(worker)) if !state.is_final() => units.set(stored.unit, UnitState::Leased { worker, until: now + ttl }),
                (None, _) => {}
            }
        }
        for (frame, guides) in frames.iter().zip(&mut guides) {
            if state.is_final() || matches!(frame.state, FrameState::Assembling | FrameState::Done | FrameState::Failed) {
                guides.drop_all();
            }
        }
        let mut windows = JobWindows::waiting(&record.plan, split.frames());
        for (window, solved) in solved {
            if let Some(place) = windows.as_mut().and_then(|windows| windows.states.get_mut(window as usize)) {
                *place = WindowState::Solved(solved);
            }
        }
        for position in (0..split.frames()).filter(|position| frames[*position as usize].failed_units > 0) {
            if let Some(windows) = &mut windows {
                windows.break_over(position);
            }
        }
        for (unit, witness) in witnesses {
            if units.get(unit).is_some_and(|u| !u.state.is_settled()) {
                heard.entry(unit).or_default().push(witness);
            }
        }
        let mut job = Self {
            record,
            split,
            state,
            error,
            started,
            finished,
            paused,
            frames,
            guides,
            units,
            windows,
            evidence,
            witnesses: heard,
            pace,
        };
        let actions = if state.is_final() { Vec::new() } else { job.resumed((0..job.split.frames()).collect()) };
        Ok((job, actions))
    }

    /// What is to be done for frames that go on from what they have, and wait for nothing.
    pub(super) fn resumed(&mut self, frames: BTreeSet<u32>) -> Vec<Action> {
        let mut actions = Vec::new();
        for position in frames.iter().copied() {
            if self.frames[position as usize].state == FrameState::Assembling {
                actions.push(Action::Do(Errand::Assemble { frame: position }));
            }
            actions.extend(self.next_guide(position));
        }
        let all = self.windows.as_ref().map_or(0, |windows| windows.layout.len());
        actions.extend(self.begin_windows(0..all));
        for position in frames {
            if self.is_measured_now(position) {
                actions.push(Action::Do(Errand::Measure { frame: position }));
            } else if self.is_complete(position) {
                // Told to be assembled by what came last before a stop, or to be assembled again.
                actions.extend(self.finish_frame(position));
            }
        }
        actions
    }
}
