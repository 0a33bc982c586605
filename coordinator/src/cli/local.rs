//! One job on a farm of its own, in this process: what `render` does once and `study` many times.

use std::collections::BTreeMap;

use bytes::Bytes;
use futures::StreamExt;
use gradfarm_core::plan::Request;
use gradfarm_core::scene::Loaded;

use super::error::Error;
use super::progress::Progress;
use super::scene;
use crate::embedded::Farm;
use crate::job::{FileKind, FrameState, JobId, JobState};
use crate::service::{AccuracyView, Frames, Handle, JobEvent, JobView, Submission};

/// A job to be done here.
#[derive(Clone, Debug)]
pub(super) struct LocalJob<'a> {
    /// What to call it.
    pub(super) name: String,
    /// The scene.
    pub(super) loaded: &'a Loaded,
    /// What to ask of the renderer.
    pub(super) request: Request,
    /// Edge of the tiles [pixels].
    pub(super) tile: u32,
    /// Rendering threads of each worker.
    pub(super) threads: &'a [usize],
}

/// A job that was done.
#[derive(Clone, Debug)]
pub(super) struct LocalDone {
    /// What the coordinator knows of it.
    pub(super) view: JobView,
    /// Its EXR file.
    pub(super) exr: Bytes,
    /// Its PNG file.
    pub(super) png: Bytes,
    /// What was counted, as JSON.
    pub(super) statistics: Bytes,
    /// What accuracy cost.
    pub(super) accuracy: AccuracyView,
}

impl LocalJob<'_> {
    /// Starts the farm, does the job, stops the farm.
    ///
    /// # Errors
    /// If the job fails or is interrupted, or the farm breaks.
    pub(super) async fn run(&self, progress: &Progress) -> Result<LocalDone, Error> {
        let state = tempfile::Builder::new().prefix("gradfarm-").tempdir();
        let state = state.map_err(|source| Error::Write { path: std::env::temp_dir(), source })?;
        let mut farm = Farm::start_for_one_job(state.path().to_path_buf(), self.threads).await?;
        let handle = farm.handle();
        let job = async {
            let job = self.submit(&handle).await?;
            follow(&handle, job, progress).await
        };
        let ended = tokio::select! {
            ended = job => ended,
            reason = farm.broken() => Err(Error::Failed(reason)),
            _ = tokio::signal::ctrl_c() => Err(Error::Interrupted),
        };
        let done = match ended {
            Ok(view) => files(&handle, view).await,
            Err(error) => Err(error),
        };
        // The farm goes first, so that it no longer writes into the folder that goes next.
        let stopped = farm.stop().await;
        let done = done?;
        stopped?;
        Ok(done)
    }

    async fn submit(&self, handle: &Handle) -> Result<JobId, Error> {
        let mut assets = BTreeMap::new();
        for name in self.loaded.description.assets() {
            let bytes = scene::read_asset(&self.loaded.assets, &name).await?;
            assets.insert(name, handle.put_asset(bytes).await?);
        }
        let submission = Submission {
            name: self.name.clone(),
            description: self.loaded.description.to_json(),
            assets,
            request: self.request.clone(),
            tile: self.tile,
            frames: Frames::default(),
            priority: 0,
            client_token: None,
        };
        Ok(handle.submit(submission).await?)
    }
}

/// Shows progress until the job is done.
async fn follow(handle: &Handle, job: JobId, progress: &Progress) -> Result<JobView, Error> {
    let mut events = handle.subscribe(job).await?;
    while let Some(event) = events.next().await {
        match event {
            JobEvent::Progress { samples, .. } => {
                progress.show(samples.done, samples.total);
            }
            JobEvent::Frame { state: FrameState::Rendering, .. } => progress.say("rendering"),
            JobEvent::Accuracy { point, target, seconds_left, .. } => progress.say_error(&point.error, target, seconds_left),
            JobEvent::Frame { state: FrameState::Assembling, .. } => progress.say("assembling"),
            JobEvent::State { state: JobState::Done, .. } => break,
            JobEvent::State { state, error } if state.is_final() => {
                let reason = error.unwrap_or_else(|| "no reason was given".to_owned());
                return Err(Error::Job(format!("the job is {}: {reason}", state.name())));
            }
            JobEvent::State { .. } | JobEvent::Frame { .. } | JobEvent::Tile { .. } | JobEvent::Window { .. } => {}
        }
    }
    Ok(handle.get(job).await?)
}

async fn files(handle: &Handle, view: JobView) -> Result<LocalDone, Error> {
    let (job, frame) = (view.summary.id, Frames::default().first);
    let exr = handle.frame_file(job, frame, FileKind::Exr).await?;
    let png = handle.frame_file(job, frame, FileKind::Png).await?;
    let statistics = handle.frame_file(job, frame, FileKind::Statistics).await?;
    let accuracy = handle.accuracy(job, frame).await?;
    Ok(LocalDone { view, exr, png, statistics, accuracy })
}
