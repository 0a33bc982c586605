//! Takes a job up again from what the store kept.

use std::time::Duration;

use super::frame::{Frame, Seconds};
use super::record::StoredJob;
use super::state::FrameState;
use super::unit::{UnitState, Units};
use super::{Action, Job};
use crate::clock::Timestamp;
use crate::schedule::{Split, TooManyUnits};

impl Job {
    /// The job as it was when the last change became durable, and what was still to be done.
    ///
    /// Leases live on for `ttl` from `now`, so that workers who come back keep theirs. Sums of frames are counted again from their
    /// results, for they are only written when a frame is assembled.
    ///
    /// # Errors
    /// If the record cannot be split, which no accepted job's can.
    pub fn restore(stored: StoredJob, now: Timestamp, ttl: Duration) -> Result<(Self, Vec<Action>), TooManyUnits> {
        let StoredJob { record, state, error, started, finished, frames: kept, units: stored_units } = stored;
        let split = Split::new(&record.plan, record.first_frame, record.frame_count, record.tile)?;
        let mut frames = vec![Frame::waiting(); split.frames() as usize];
        for (position, frame) in kept {
            if let Some(place) = frames.get_mut(position as usize) {
                *place = frame;
            }
        }
        let mut units = Units::default();
        if !state.is_final() || !stored_units.is_empty() {
            units = Units::ready_all(split.units());
            for frame in &mut frames {
                if frame.state != FrameState::Done {
                    (frame.units, frame.samples) = (0, 0);
                    frame.seconds = Seconds { render_span: frame.seconds.render_span, ..Seconds::default() };
                }
            }
        }
        for stored in stored_units {
            units.note(stored.unit, |unit| (unit.epoch, unit.failures, unit.losses) = (stored.epoch, stored.failures, stored.losses));
            match (stored.result, stored.lease) {
                (Some(result), _) => {
                    units.set(stored.unit, UnitState::Done { content: result.content });
                    let frame = &mut frames[split.place(stored.unit).frame as usize];
                    if frame.state != FrameState::Done {
                        frame.units += 1;
                        frame.samples += split.samples(stored.unit);
                        frame.seconds +=
                            Seconds { load: result.load, compile: result.compile, render: result.render, ..Seconds::default() };
                    }
                }
                (None, Some(worker)) if !state.is_final() => units.set(stored.unit, UnitState::Leased { worker, until: now + ttl }),
                (None, _) => {}
            }
        }
        let pending = |(position, frame): (usize, &Frame)| {
            (!state.is_final() && frame.state == FrameState::Assembling).then_some(Action::Assemble { frame: position as u32 })
        };
        let actions = frames.iter().enumerate().filter_map(pending).collect();
        Ok((Self { record, split, state, error, started, finished, frames, units }, actions))
    }
}
