//! What holds for every job at every moment between two events.
//!
//! * I1: at most one live lease for each unit and epoch: a unit is ready, leased or done, and in the set of that name only.
//! * I2: a done unit stays done, and its digest never changes. (Between two states: see the tests of this module.)
//! * I3: a result counts if and only if its epoch is the unit's at that moment. (Between two states.)
//! * I4: the samples of a frame are the sum over its done units.
//! * I5: a frame is assembled if and only if all its units are settled (done or given up) and it is to have no more of them.
//! * I6: a job that is not over, paused or not, has a unit that is ready and waits for no guide, a live lease, or a frame that is being assembled,
//!   guided or measured, or a window that is being solved: it always has an owner.
//! * I7: a frame has units up to its goal and none beyond; its points come in the order of their samples, none beyond the goal.
//! * I8: of a job that is not over, a window is begun if and only if all its moments are rendered, and broken if and only if a unit of one of
//!   them is given up; one with a moment that is assembled is solved, unless that moment is under a broken one.
//! * I10: what is counted equals what is there: units given up of a frame, leases of a worker.
//! * I9: a job that is over holds no lease, and a cancelled job stays cancelled.

use super::guides::FrameGuides;
use super::state::{FrameState, JobState};
use super::unit::UnitState;
use super::windows::WindowState;
use super::{Frame, Job};

/// Checks the invariants that a single state can show, in time linear in the units.
///
/// # Errors
/// The first one that does not hold, in words.
pub fn check(job: &Job) -> Result<(), String> {
    let in_memory = job.units.all().next().is_some();
    let mut counted = vec![(0u32, 0u64, 0u32); job.frames.len()];
    for (index, unit) in job.units.all() {
        let (ready, leased) = (job.units.ready().contains(&index), job.units.leased().contains(&index));
        let expected = match unit.state {
            UnitState::Ready => (true, false),
            UnitState::Leased { .. } => (false, true),
            UnitState::Done { .. } | UnitState::GivenUp => (false, false),
        };
        if (ready, leased) != expected {
            return Err(format!("I1: unit {index} is {:?} but in sets {:?}", unit.state, (ready, leased)));
        }
        if unit.epoch == 0 && unit.state != UnitState::Ready {
            return Err(format!("I3: unit {index} is {:?} without ever being granted", unit.state));
        }
        if matches!(unit.state, UnitState::Done { .. }) {
            let place = job.split.place(index);
            let (units, samples, _) = &mut counted[place.frame as usize];
            *units += 1;
            *samples += job.split.samples(index);
        }
        if unit.state == UnitState::GivenUp {
            counted[job.split.place(index).frame as usize].2 += 1;
        }
    }
    let mut holders = std::collections::BTreeMap::new();
    for (_, unit) in job.leased() {
        if let UnitState::Leased { worker, .. } = unit.state {
            *holders.entry(worker).or_insert(0u32) += 1;
        }
    }
    if &holders != job.units.holders() {
        return Err(format!("I10: leases are counted as {:?}, there are {holders:?}", job.units.holders()));
    }
    if in_memory {
        for (position, (frame, (units, samples, given_up))) in job.frames.iter().zip(&counted).enumerate() {
            if (frame.units, frame.samples) != (*units, *samples) {
                return Err(format!(
                    "I4: frame {position} counts {} units and {} samples, its units say {units} and {samples}",
                    frame.units, frame.samples
                ));
            }
            let position = position as u32;
            if frame.failed_units != *given_up {
                return Err(format!("I10: frame {position} counts {} units given up, there are {given_up}", frame.failed_units));
            }
            if job.units.of_frame(position).len() != job.units_to_goal(position) as usize {
                return Err(format!("I7: frame {position} has {} units and a goal of {}", job.units.of_frame(position).len(), frame.goal));
            }
            let all = units + given_up == job.units_to_goal(position) && !job.is_measured_now(position);
            let complete = all && (!job.has_all_units(position) || job.is_complete(position));
            let assembled = matches!(frame.state, FrameState::Assembling | FrameState::Done | FrameState::Failed);
            if complete != assembled {
                return Err(format!("I5: frame {position} is {:?} with {units} units done", frame.state));
            }
        }
    }
    for (position, frame) in job.frames.iter().enumerate() {
        let samples = frame.points.iter().map(|point| point.samples);
        if !samples.clone().is_sorted_by(|a, b| a < b) || samples.clone().any(|samples| samples > frame.goal) {
            return Err(format!("I7: frame {position} with a goal of {} has points at {:?}", frame.goal, samples.collect::<Vec<_>>()));
        }
    }
    let in_work = |(position, frame): (u32, &Frame)| frame.state == FrameState::Assembling || job.is_measured_now(position);
    let in_work = (0..).zip(&job.frames).any(in_work) || job.guides.iter().any(FrameGuides::in_the_making);
    let in_work = in_work || job.windows().is_some_and(|windows| windows.states.contains(&WindowState::Solving));
    if !job.state.is_final() && job.open_units().next().is_none() && job.units.leased().is_empty() && !in_work {
        return Err("I6: nothing is ready, leased, being assembled, guided or measured, yet the job is not over".into());
    }
    for (window, state) in (0..).zip(job.windows().map_or(&[][..], |windows| &windows.states)) {
        let mut moments = job.windows().map(|windows| windows.layout.moments(window)).unwrap_or_default();
        let broken = moments.clone().any(|position| job.frames[position as usize].failed_units > 0);
        if broken != (*state == WindowState::Broken) {
            return Err(format!(
                "I8: window {window} is {} and {} of its moments is given up",
                state.name(),
                if broken { "a unit" } else { "no unit" }
            ));
        }
        let begun = *state != WindowState::Waiting;
        if !job.state.is_final() && !broken && begun != moments.clone().all(|position| job.is_in(position)) {
            return Err(format!("I8: window {window} is {} with not all, or all, of its moments", state.name()));
        }
        let apart = |position: u32| job.windows().is_some_and(|windows| windows.is_broken_over(position));
        let assembled = |position: u32| {
            matches!(job.frames[position as usize].state, FrameState::Assembling | FrameState::Done | FrameState::Failed)
                && !apart(position)
        };
        if !matches!(state, WindowState::Solved(_)) && moments.any(assembled) {
            return Err(format!("I8: window {window} is {} while moments of it are assembled", state.name()));
        }
        if job.state.is_final() && *state == WindowState::Solving {
            return Err(format!("I9: window {window} is solved for a job that is over"));
        }
    }
    if job.state.is_final() && !job.units.leased().is_empty() {
        return Err(format!("I9: the job is {:?} and still holds leases", job.state));
    }
    if job.state == JobState::Done && job.frames.iter().any(|frame| frame.state != FrameState::Done) {
        return Err("I5: the job is done, but not all its frames".into());
    }
    Ok(())
}
