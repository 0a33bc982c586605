//! A worker was found to give wrong results. What it gave before without being checked is rendered again where its frame is still open, and
//! counted as suspect where it is not.

use crate::job::unit::UnitState;
use crate::job::{Action, Change, FrameState, Job, News, WindowState, WorkerId};

pub(super) fn apply(job: &mut Job, worker: WorkerId) -> Vec<Action> {
    if job.state.is_final() {
        return Vec::new();
    }
    let by = |state: UnitState| matches!(state, UnitState::Done { worker: Some(w), .. } if w == worker);
    let theirs: Vec<u32> = job.units.all().filter(|(unit, held)| by(held.state) && !job.is_verified(*unit)).map(|(unit, _)| unit).collect();
    let mut actions = Vec::new();
    let mut touched = std::collections::BTreeSet::new();
    for unit in theirs {
        let place = job.split.place(unit);
        touched.insert(place.frame);
        if !job.can_withdraw(place.frame) {
            job.frames[place.frame as usize].suspect_units += 1;
            continue;
        }
        // Under a new epoch, so that what the worker may still send under the old one does not count.
        job.units.note(unit, |u| (u.epoch, u.failed_on) = (u.epoch + 1, Some(worker)));
        job.units.set(unit, UnitState::Ready);
        let samples = job.split.samples(unit);
        let frame = &mut job.frames[place.frame as usize];
        (frame.units, frame.samples) = (frame.units - 1, frame.samples - samples);
        let epoch = job.unit(unit).map_or(0, |u| u.epoch);
        actions.push(Action::Keep(Change::Withdrawn { job: job.record.id, unit, epoch }));
        actions.push(Action::Tell(News::Tile { frame: place.frame, tile: place.tile }));
    }
    actions.extend(touched.into_iter().map(|frame| job.kept_frame(frame)));
    actions
}

impl Job {
    /// Whether results of a frame can still be taken back: nothing was made of them yet.
    fn can_withdraw(&self, position: u32) -> bool {
        let open = self.frames[position as usize].state == FrameState::Rendering && self.split.steering().is_empty();
        let begun = self
            .windows()
            .is_some_and(|windows| windows.layout.over(position).any(|window| windows.states[window as usize] != WindowState::Waiting));
        open && !begun
    }
}
