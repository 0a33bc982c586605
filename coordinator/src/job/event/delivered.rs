//! A result arrives. It counts if and only if its epoch is the unit's, once.

use crate::clock::Timestamp;
use crate::job::record::DeliveredRecord;
use crate::job::unit::UnitState;
use crate::job::{Action, Answer, Change, Job, News, Seconds, WorkerId};

pub(super) fn apply(job: &mut Job, unit: u32, epoch: u32, worker: WorkerId, result: DeliveredRecord, now: Timestamp) -> Vec<Action> {
    let superseded = vec![Action::Answer(Answer::Superseded)];
    let Some(held) = job.unit(unit).copied() else { return superseded };
    // A witness stays one while others are asked, under epochs of their own.
    if let Some(given) = job.witnesses(unit).iter().find(|witness| witness.epoch == epoch) {
        return if given.content == result.content { vec![Action::Answer(Answer::Accepted)] } else { superseded };
    }
    if held.epoch != epoch || epoch == 0 {
        return superseded;
    }
    match held.state {
        // Delivered again because the first answer was lost.
        UnitState::Done { content, .. } if content == result.content => return vec![Action::Answer(Answer::Accepted)],
        UnitState::Done { .. } | UnitState::GivenUp => return superseded,
        UnitState::Ready | UnitState::Leased { .. } if job.state.is_final() => return superseded,
        UnitState::Ready | UnitState::Leased { .. } => {}
    }
    let mut actions = Vec::new();
    if job.is_verified(unit) {
        let (found, counts) = job.hear_witness(unit, epoch, worker, &result, now);
        if !counts {
            return found;
        }
        actions = found;
    }
    job.units.set(unit, UnitState::Done { content: result.content, worker: Some(worker) });
    actions.extend([
        Action::Keep(Change::Delivered { job: job.record.id, unit, epoch, worker, result }),
        Action::Answer(Answer::Accepted),
        Action::Praise(worker),
    ]);
    let place = job.split.place(unit);
    let samples = job.split.samples(unit);
    job.pace.note(result.render);
    let frame = &mut job.frames[place.frame as usize];
    frame.units += 1;
    frame.samples += samples;
    frame.seconds += Seconds { load: result.load, compile: result.compile, render: result.render, ..Seconds::default() };
    frame.seconds.render_span = frame.started.map_or(0.0, |started| now.seconds_since(started));
    actions.push(Action::Tell(News::Tile { frame: place.frame, tile: place.tile }));
    actions.extend(job.settled(place));
    actions
}
