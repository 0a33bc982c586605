//! Views of jobs for people.

use gradfarm_core::accuracy::Curve;
use gradfarm_core::lattice::Moment;

use super::dispatch::Dispatcher;
use super::roster::Roster;
use super::view::{AccuracyView, AttemptView, Count, FailedUnitView, FrameView, JobEvent, JobSummary, JobView, TileView, WindowView};
use crate::clock::Timestamp;
use crate::error::Error;
use crate::job::{Attempt, FrameState, Job, News, Seconds, UnitState, WindowState};
use crate::schedule::Place;

/// The line of a list.
pub(super) fn summary(job: &Job) -> JobSummary {
    let frames_of = |(frame, moment): (&crate::job::Frame, &Moment)| if frame.state == FrameState::Done { length(*moment) } else { 0 };
    let frames_done = job.frames.iter().zip(job.split.moments()).map(frames_of).sum();
    JobSummary {
        id: job.record.id,
        name: job.record.name.clone(),
        state: job.state,
        paused: job.paused,
        error: job.error.clone(),
        priority: job.record.priority,
        created: job.record.created,
        started: job.started,
        finished: job.finished,
        frames: Count { done: frames_done, total: u64::from(job.record.frame_count) },
        failed_units: job.frames.iter().map(|frame| u64::from(frame.failed_units)).sum(),
        units: units(job),
        samples: samples(job),
    }
}

fn failed_unit(job: &Job, unit: u32, roster: &Roster) -> FailedUnitView {
    let work = job.split.work(unit);
    let named = |attempt: &Attempt| AttemptView { name: roster.name(attempt.worker).map(str::to_owned), attempt: attempt.clone() };
    FailedUnitView { tile: work.tile, samples: work.samples, attempts: job.attempts(unit).iter().map(named).collect() }
}

/// A job in full.
pub(super) fn view(job: &Job, dispatcher: &Dispatcher) -> JobView {
    let roster = &dispatcher.roster;
    let frame = |(number, position): (u32, u32), frame: &crate::job::Frame| FrameView {
        number,
        moment: job.moment(position),
        state: told(job, position),
        units: Count { done: u64::from(frame.units), total: expected(job, position).0 },
        samples: Count { done: frame.samples, total: expected(job, position).1 },
        seconds: frame.seconds,
        estimated_relmse: frame.estimated_relmse,
        choice: frame.choice.clone(),
        statistics: frame.statistics,
        samples_per_pixel: frame.goal,
        stopped: frame.stopped,
        error: frame.points.last().map(|point| point.error),
        failed: job.given_up(position).map(|unit| failed_unit(job, unit, roster)).collect(),
        suspect_units: frame.suspect_units,
        failure: frame.failure.clone(),
    };
    let shown =
        (0u32..).zip(job.split.moments()).flat_map(|(position, moment)| (moment.first..moment.end).map(move |number| (number, position)));
    let mut seconds = Seconds::default();
    job.frames.iter().for_each(|frame| seconds += frame.seconds);
    seconds.render_span = span(job);
    JobView {
        summary: summary(job),
        plan: job.record.plan.clone(),
        scene: job.record.scene,
        tile: job.record.tile,
        needs: job.record.needs.clone(),
        waiting: dispatcher.why_waiting(job),
        frames: shown.map(|at| frame(at, &job.frames[at.1 as usize])).collect(),
        windows: windows(job),
        seconds,
        statistics: job.statistics(),
    }
}

/// The state of a moment, as it is told.
fn told(job: &Job, position: u32) -> FrameState {
    if job.is_rendered(position) { FrameState::Rendered } else { job.frames[position as usize].state }
}

/// All windows.
fn windows(job: &Job) -> Vec<WindowView> {
    let count = job.windows().map_or(0, |windows| windows.layout.len());
    (0..count).filter_map(|window| window_view(job, window)).collect()
}

fn window_view(job: &Job, number: u32) -> Option<WindowView> {
    let windows = job.windows()?;
    let (moments, state) = (windows.layout.moments(number), windows.states.get(number as usize)?);
    let (first, end) = (job.moment(moments.start).first, job.moment(moments.end.checked_sub(1)?).end);
    let seconds = match state {
        WindowState::Solved(solved) => Some(solved.stitch + solved.reconstruct),
        WindowState::Waiting | WindowState::Solving | WindowState::Broken => None,
    };
    Some(WindowView { number, first, end, state: state.name(), seconds })
}

/// What accuracy cost in a frame.
pub(super) fn accuracy(job: &Job, number: u32) -> Result<AccuracyView, Error> {
    let position = position(job, number)?;
    let frame = &job.frames[position as usize];
    Ok(AccuracyView {
        name: job.record.name.clone(),
        frame: number,
        state: frame.state,
        stop: job.record.plan.stop,
        most_samples: job.record.plan.samples,
        expected_samples: job.expected_samples(position),
        stopped: frame.stopped,
        curve: Curve::of(frame.points.clone()),
    })
}

/// Units and camera samples that a frame will have, as far as one can tell.
fn expected(job: &Job, position: u32) -> (u64, u64) {
    let samples = job.expected_samples(position);
    // Whole passes: the last one may lie beyond what is expected.
    let passes = job.split.passes();
    let count = passes.partition_point(|pass| pass.samples.first < samples);
    let samples = count.checked_sub(1).and_then(|last| passes.get(last)).map_or(0, |pass| pass.samples.end());
    (count as u64 * u64::from(job.split.units_per_pass()), job.split.pixels() * u64::from(samples))
}

/// From the job's first lease to its last result [s].
fn span(job: &Job) -> f64 {
    let Some(started) = job.started else { return 0.0 };
    let ends = job.frames.iter().filter_map(|frame| Some(frame.started?.seconds_since(started) + frame.seconds.render_span));
    ends.fold(0.0, f64::max)
}

/// The tiles of a frame.
pub(super) fn tiles(job: &Job, number: u32) -> Result<Vec<TileView>, Error> {
    let position = position(job, number)?;
    let whole = job.frames[position as usize].state == FrameState::Done;
    let passes = job.split.passes_within(job.frames[position as usize].goal);
    let view = |(index, tile): (usize, &gradfarm_core::lattice::Tile)| {
        let mut view =
            TileView { tile: *tile, units: Count { done: 0, total: u64::from(passes) }, leased: 0, failed: 0, workers: Vec::new() };
        for pass in 0..passes {
            match job.unit(job.split.unit(Place { frame: position, pass, tile: index as u32 })).map(|unit| unit.state) {
                Some(UnitState::Done { .. }) => view.units.done += 1,
                Some(UnitState::Leased { worker, .. }) => {
                    view.leased += 1;
                    if !view.workers.contains(&worker) {
                        view.workers.push(worker);
                    }
                }
                // Units of finished jobs are not kept in memory.
                None if whole => view.units.done += 1,
                Some(UnitState::GivenUp) => view.failed += 1,
                Some(UnitState::Ready) | None => {}
            }
        }
        view
    };
    Ok(job.split.tiles().iter().enumerate().map(view).collect())
}

/// The position of the moment that a frame shows, by the frame's number.
pub(super) fn position(job: &Job, number: u32) -> Result<u32, Error> {
    let first = job.record.first_frame;
    let last = first + job.record.frame_count - 1;
    job.split.moment_of(number).ok_or(Error::NoFrame { job: job.record.id, frame: number, first, last })
}

/// How many frames show a moment.
fn length(moment: Moment) -> u64 {
    u64::from(moment.end - moment.first)
}

/// The event of a job's state.
pub(super) fn state_event(job: &Job) -> JobEvent {
    JobEvent::State { state: job.state, error: job.error.clone() }
}

/// The event of a job's progress.
pub(super) fn progress_event(job: &Job, now: Timestamp) -> JobEvent {
    let until = job.finished.unwrap_or(now);
    JobEvent::Progress {
        units: units(job),
        samples: samples(job),
        elapsed: job.started.map_or(0.0, |started| until.seconds_since(started)),
    }
}

/// What news mean to a watcher, in order.
pub(super) fn events(job: &Job, news: News, now: Timestamp) -> Vec<JobEvent> {
    match news {
        News::Job => vec![progress_event(job, now), state_event(job)],
        News::Frame(position) => {
            let Moment { first, end } = job.moment(position);
            vec![JobEvent::Frame { frame: first, end, state: told(job, position) }]
        }
        News::Window(window) => window_view(job, window).map(|view| JobEvent::Window { window: view }).into_iter().collect(),
        News::Accuracy(position) => accuracy_event(job, position).into_iter().chain([progress_event(job, now)]).collect(),
        News::Tile { frame, tile } => {
            let number = job.moment(frame).first;
            let passes = job.split.passes_within(job.frames[frame as usize].goal);
            let done = |pass: &u32| {
                let unit = job.unit(job.split.unit(Place { frame, pass: *pass, tile }));
                unit.is_some_and(|unit| matches!(unit.state, UnitState::Done { .. }))
            };
            let units = Count { done: (0..passes).filter(done).count() as u64, total: u64::from(passes) };
            vec![JobEvent::Tile { frame: number, tile, units }, progress_event(job, now)]
        }
    }
}

fn units(job: &Job) -> Count {
    Count { done: job.units_done(), total: total(job, u64::from(job.split.units()), |expected| expected.0) }
}

fn samples(job: &Job) -> Count {
    Count {
        done: job.samples_done(),
        total: total(job, job.split.samples_per_frame() * u64::from(job.split.frames()), |expected| expected.1),
    }
}

/// A sum over the frames, as far as it can be told; `all` where each frame has all its samples.
fn total(job: &Job, all: u64, of: impl Fn((u64, u64)) -> u64) -> u64 {
    if !job.record.plan.stop.ends_early() {
        return all;
    }
    (0..job.split.frames()).map(|position| of(expected(job, position))).sum()
}

/// The event of a frame's last point.
fn accuracy_event(job: &Job, position: u32) -> Option<JobEvent> {
    let frame = &job.frames[position as usize];
    let point = *frame.points.last()?;
    let curve = Curve::of(frame.points.clone());
    let more = f64::from(job.expected_samples(position).saturating_sub(point.samples));
    let seconds_left = curve.cost.filter(|_| frame.stopped.is_none()).map(|cost| cost.each * more);
    Some(JobEvent::Accuracy { frame: job.moment(position).first, point, target: job.record.plan.stop.error, seconds_left })
}

/// Whether an event ends a watcher's stream.
pub(super) fn is_last(event: &JobEvent) -> bool {
    matches!(event, JobEvent::State { state, .. } if state.is_final())
}
