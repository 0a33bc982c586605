//! One job on a farm of its own, in this process: what `render` does once and `study` many times.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use bytes::Bytes;
use futures::StreamExt;
use gradfarm_core::plan::Request;
use gradfarm_core::scene::Loaded;

use super::batch::Batch;
use super::error::Error;
use super::progress::Progress;
use super::scene;
use crate::embedded::Farm;
use crate::job::{FileKind, FrameState, JobId, JobState, Needs};
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
    /// Which frames.
    pub(super) frames: Frames,
    /// Edge of the tiles [pixels].
    pub(super) tile: u32,
    /// Rendering threads of each worker.
    pub(super) threads: &'a [usize],
}

/// A frame that was done.
#[derive(Clone, Debug)]
pub(super) struct FrameDone {
    /// Its number.
    pub(super) number: u32,
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
    /// Starts the farm, does the job, stops the farm. Each frame is handed over when it is done, while others are rendered.
    ///
    /// # Errors
    /// If the job fails or is interrupted, the farm breaks, or a frame is not taken.
    pub(super) async fn run(&self, progress: &Progress, each: impl FnMut(FrameDone) -> Result<(), Error>) -> Result<JobView, Error> {
        let state = tempfile::Builder::new().prefix("gradfarm-").tempdir();
        let state = state.map_err(|source| Error::Write { path: std::env::temp_dir(), source })?;
        let mut farm = Farm::start_for_one_job(state.path().to_path_buf(), self.threads).await?;
        let handle = farm.handle();
        let job = async {
            let job = self.submit(&handle).await?;
            Following { handle: &handle, job, missing: self.frames.range().collect(), each }.follow(progress, self.frames).await
        };
        let ended = tokio::select! {
            ended = job => ended,
            reason = farm.broken() => Err(Error::Failed(reason)),
            _ = tokio::signal::ctrl_c() => Err(Error::Interrupted),
        };
        // The farm goes first, so that it no longer writes into the folder that goes next.
        let stopped = farm.stop().await;
        let view = ended?;
        stopped?;
        Ok(view)
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
            frames: self.frames,
            priority: 0,
            client_token: None,
            needs: Needs::default(),
            verify: None,
            paused: false,
        };
        Ok(handle.submit(submission).await?)
    }
}

/// A job on its way.
struct Following<'a, F> {
    handle: &'a Handle,
    job: JobId,
    /// Frames that were not handed over yet.
    missing: BTreeSet<u32>,
    each: F,
}

impl<F: FnMut(FrameDone) -> Result<(), Error>> Following<'_, F> {
    /// Shows progress and hands frames over until the job is done.
    async fn follow(&mut self, progress: &Progress, frames: Frames) -> Result<JobView, Error> {
        let mut batch = Batch::new(frames.range());
        let mut events = self.handle.subscribe(self.job).await?;
        while let Some(event) = events.next().await {
            match event {
                JobEvent::Progress { samples, .. } => progress.show(samples.done, samples.total),
                JobEvent::Accuracy { point, target, seconds_left, .. } => progress.say_error(&point.error, target, seconds_left),
                JobEvent::Frame { frame, end, state } => {
                    batch.set(frame..end, state);
                    progress.say(&batch.told());
                    if state == FrameState::Done {
                        self.hand_over(frame..end).await?;
                    }
                }
                JobEvent::State { state: JobState::Done, .. } => break,
                JobEvent::State { state, error } if state.is_final() => {
                    let reason = error.unwrap_or_else(|| "no reason was given".to_owned());
                    return Err(Error::Job(format!("the job is {}: {reason}", state.name())));
                }
                JobEvent::Window { window } => {
                    batch.set_window(window.number, window.first..window.end, window.state);
                    progress.say(&batch.told());
                }
                JobEvent::State { .. } | JobEvent::Tile { .. } => {}
            }
        }
        // Events may be lost where there are many of them.
        self.hand_over(frames.range()).await?;
        Ok(self.handle.get(self.job).await?)
    }

    async fn hand_over(&mut self, frames: Range<u32>) -> Result<(), Error> {
        let (handle, job) = (self.handle, self.job);
        while let Some(number) = self.missing.range(frames.clone()).next().copied() {
            let file = |kind| handle.frame_file(job, number, kind);
            let (exr, png, statistics) = (file(FileKind::Exr).await?, file(FileKind::Png).await?, file(FileKind::Statistics).await?);
            let accuracy = handle.accuracy(job, number).await?;
            self.missing.remove(&number);
            (self.each)(FrameDone { number, exr, png, statistics, accuracy })?;
        }
        Ok(())
    }
}
