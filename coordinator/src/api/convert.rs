//! From what the service shows to the JSON of the API.

use std::collections::BTreeMap;

use gradfarm_core::plan::Plan;

use super::json;
use crate::job::{FileKind, FrameState, JobId};
use crate::service::{Count, FrameView, JobEvent, JobSummary, JobView, Seconds, TileView, WindowView, WorkerView};

impl From<Count> for json::Count {
    fn from(count: Count) -> Self {
        Self { done: count.done, total: count.total }
    }
}

impl From<Seconds> for json::Seconds {
    fn from(seconds: Seconds) -> Self {
        let Seconds { load, compile, render, render_span, stitch, reconstruct, write } = seconds;
        Self { load, compile, render, render_span, stitch, reconstruct, write }
    }
}

impl From<&Plan> for json::PlanView {
    fn from(plan: &Plan) -> Self {
        Self {
            width: plan.extent.width,
            height: plan.extent.height,
            technique: plan.technique.name().to_owned(),
            reconstruction: plan.reconstruction.name().to_owned(),
            alpha: plan.alpha,
            clamp: plan.clamp,
            samples: plan.samples,
            batch: plan.batch,
            seed: plan.seed,
            max_depth: plan.max_depth,
            roulette_depth: plan.roulette_depth,
            shift: plan.shift.name().to_owned(),
            shift_threshold: plan.shift_threshold,
            shift_survival: plan.shift_survival,
            reuse_edge: plan.reuse_edge,
            links: plan.links,
            rounds: plan.rounds,
            stop_error: plan.stop.error,
            stop_seconds: plan.stop.seconds,
            timeline: plan.timeline.map(|time| json::Timeline { fps: time.fps, shutter: time.shutter, instants: time.instants() }),
            temporal: plan.temporal.map(|t| json::Temporal { window: t.window, stride: t.stride, motion: t.motion }),
            reasons: plan.reasons.clone(),
        }
    }
}

impl From<JobSummary> for json::JobSummary {
    fn from(job: JobSummary) -> Self {
        Self {
            id: job.id.to_string(),
            name: job.name,
            state: job.state.name().to_owned(),
            paused: job.paused,
            error: job.error,
            priority: job.priority,
            created_ms: job.created.millis(),
            started_ms: job.started.map(|time| time.millis()),
            finished_ms: job.finished.map(|time| time.millis()),
            frames_done: job.frames.done,
            frames_total: job.frames.total,
            failed_units: job.failed_units,
            progress: json::Progress { units: job.units.into(), samples: job.samples.into() },
        }
    }
}

impl From<JobView> for json::Job {
    fn from(job: JobView) -> Self {
        let id = job.summary.id;
        Self {
            summary: job.summary.into(),
            plan: (&job.plan).into(),
            scene: job.scene.to_string(),
            tile: job.tile,
            needs: job.needs.into(),
            waiting: job.waiting.as_ref().map(Into::into),
            frames: job.frames.iter().map(|frame| json::Frame::of(id, frame)).collect(),
            windows: job.windows.into_iter().map(Into::into).collect(),
            seconds: job.seconds.into(),
            statistics: job.statistics.by_name(),
        }
    }
}

impl From<WindowView> for json::Window {
    fn from(view: WindowView) -> Self {
        Self { number: view.number, first: view.first, end: view.end, state: view.state.to_owned(), seconds: view.seconds }
    }
}

impl From<TileView> for json::Tile {
    fn from(view: TileView) -> Self {
        let tile = view.tile;
        Self {
            x: tile.x,
            y: tile.y,
            width: tile.width,
            height: tile.height,
            units: view.units.into(),
            leased: view.leased,
            failed: view.failed,
            workers: view.workers.iter().map(ToString::to_string).collect(),
        }
    }
}

impl From<WorkerView> for json::Worker {
    fn from(worker: WorkerView) -> Self {
        Self {
            id: worker.id.to_string(),
            name: worker.name,
            version: worker.version,
            threads: worker.threads,
            pool: worker.capabilities.pool,
            tags: worker.capabilities.tags.into_iter().collect(),
            memory: worker.capabilities.memory,
            connected_ms: worker.connected.millis(),
            heard_ms: worker.heard.millis(),
            leases: worker.leases,
            delivered: worker.delivered,
            failed: worker.failed,
            set_aside_until_ms: worker.set_aside_until.map(|time| time.millis()),
            draining: worker.draining,
            lies: worker.lies,
        }
    }
}

impl From<JobEvent> for json::Event {
    fn from(event: JobEvent) -> Self {
        match event {
            JobEvent::State { state, error } => Self::State { state: state.name().to_owned(), error },
            JobEvent::Progress { units, samples, elapsed } => Self::Progress { units: units.into(), samples: samples.into(), elapsed },
            JobEvent::Tile { frame, tile, units } => Self::Tile { frame, tile, units: units.into() },
            JobEvent::Accuracy { frame, point, target, seconds_left } => {
                Self::Accuracy { frame, point: point.into(), target, seconds_left }
            }
            JobEvent::Window { window } => Self::Window(window.into()),
            JobEvent::Frame { frame, end, state } => Self::Frame { frame, end, state: state.name().to_owned() },
        }
    }
}

impl json::Frame {
    /// A frame of a job, with the addresses of its files once they are there.
    pub(super) fn of(job: JobId, frame: &FrameView) -> Self {
        let files: BTreeMap<String, String> = match frame.state {
            FrameState::Done => FileKind::ALL.iter().map(|kind| (kind.name().to_owned(), file_address(job, frame.number, *kind))).collect(),
            FrameState::Waiting | FrameState::Rendering | FrameState::Rendered | FrameState::Assembling | FrameState::Failed => {
                BTreeMap::new()
            }
        };
        Self {
            number: frame.number,
            moment: Some(json::Moment { first: frame.moment.first, end: frame.moment.end }),
            state: frame.state.name().to_owned(),
            progress: json::Progress { units: frame.units.into(), samples: frame.samples.into() },
            seconds: frame.seconds.into(),
            estimated_relmse: frame.estimated_relmse,
            choice: frame.choice.clone(),
            samples_per_pixel: frame.samples_per_pixel,
            stopped: frame.stopped.map(|reason| reason.name().to_owned()),
            error: frame.error.map(Into::into),
            failed: frame.failed.iter().map(Into::into).collect(),
            suspect_units: u64::from(frame.suspect_units),
            failure: frame.failure.clone(),
            statistics: frame.statistics.by_name(),
            files,
        }
    }
}

fn file_address(job: JobId, frame: u32, kind: FileKind) -> String {
    format!("{}/jobs/{job}/frames/{frame}/frame.{}", super::ROOT, kind.name())
}
