//! `gradfarm render`: a whole farm for one image, in this process.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use futures::StreamExt;
use gradfarm_core::plan;
use gradfarm_core::scene::Loaded;

use super::error::Error;
use super::files::{ImageTarget, Target};
use super::options::RenderOptions;
use super::progress::Progress;
use super::report::{Clock, Report};
use super::{scene, terminal};
use crate::embedded::{self, Farm};
use crate::job::{FileKind, FrameState, JobId, JobState};
use crate::service::{Frames, Handle, JobEvent, JobView, Submission};
use crate::telemetry;

/// Arguments of `gradfarm render`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Writes OUT.exr (the image in the default layer, and what it was made from in named layers) and OUT.png beside it. The same scene, \
options and seed give the same pixels bit for bit, whatever --workers, --threads and --tile are.

With --json, the last line on standard output is one JSON object: samples_per_second (camera samples over the time spent \
tracing), seconds by phase, samples, width, height, technique, reconstruction, estimated_relmse, statistics, output.

Examples:
  gradfarm render tests/scenes/cornell-box.json -o cornell.exr
  gradfarm render scene.xml -o a.exr --technique pt --samples 256 --size 640x480
  gradfarm render scene.json -o a.exr --json | jq .samples_per_second")]
pub(super) struct Render {
    /// The scene: gradfarm JSON, or Mitsuba 3 XML
    scene: PathBuf,
    /// The image to write; its name ends in .exr
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    #[command(flatten)]
    options: RenderOptions,
    /// Edge of the tiles in pixels; changes how work is shared, never the image
    #[arg(long, value_name = "N", default_value_t = Submission::TILE, value_parser = clap::value_parser!(u32).range(1..=1024))]
    tile: u32,
    /// Workers to start
    #[arg(long, value_name = "N", default_value_t = 2,
          value_parser = clap::value_parser!(u16).range(1..=i64::from(embedded::WORKERS_MOST)))]
    workers: u16,
    /// Rendering threads of each worker [default: the cores shared out]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(embedded::THREADS_MOST)))]
    threads: Option<u16>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

impl Render {
    /// Renders, writes both images and prints where the time went.
    pub(super) fn run(self) -> Result<(), Error> {
        telemetry::start("warn", telemetry::Format::Text).map_err(Error::Usage)?;
        let outputs = Target::check_image(&self.output)?;
        let mut clock = Clock::start();
        let loaded = scene::read(&self.scene)?;
        // The coordinator plans again; this only tells at once what it would refuse.
        plan::resolve(&loaded.description, &self.options.request())?;
        clock.loaded();
        let report = super::runtime()?.block_on(self.render(&loaded, &outputs, clock))?;
        if self.json { terminal::json(&report.json()) } else { report.print() }
    }

    async fn render(&self, loaded: &Loaded, outputs: &ImageTarget, mut clock: Clock) -> Result<Report, Error> {
        let state = tempfile::Builder::new().prefix("gradfarm-").tempdir();
        let state = state.map_err(|source| Error::Write { path: std::env::temp_dir(), source })?;
        let threads = embedded::threads(self.workers, self.threads);
        let mut farm = Farm::start_for_one_job(state.path().to_path_buf(), &threads).await?;
        let handle = farm.handle();
        let job = async {
            let job = self.submit(&handle, loaded).await?;
            follow(&handle, job).await
        };
        let ended = tokio::select! {
            ended = job => ended,
            reason = farm.broken() => Err(Error::Failed(reason)),
            _ = tokio::signal::ctrl_c() => Err(Error::Interrupted),
        };
        let files = match &ended {
            Ok(view) => Some(files(&handle, view).await?),
            Err(_) => None,
        };
        // The farm goes first, so that it no longer writes into the folder that goes next.
        let stopped = farm.stop().await;
        let view = ended?;
        stopped?;
        if let Some((exr, png)) = files {
            let writing = Instant::now();
            outputs.exr.write(&exr)?;
            outputs.png.write(&png)?;
            clock.wrote(writing.elapsed());
        }
        Ok(Report::new(&view, &threads, clock, outputs.exr.path(), outputs.png.path()))
    }

    async fn submit(&self, handle: &Handle, loaded: &Loaded) -> Result<JobId, Error> {
        let mut assets = BTreeMap::new();
        for name in loaded.description.assets() {
            let bytes = scene::read_asset(&loaded.assets, &name).await?;
            assets.insert(name, handle.put_asset(bytes).await?);
        }
        let submission = Submission {
            name: scene::job_name(&self.scene),
            description: loaded.description.to_json(),
            assets,
            request: self.options.request(),
            tile: self.tile,
            frames: Frames::default(),
            priority: 0,
            client_token: None,
        };
        Ok(handle.submit(submission).await?)
    }
}

/// Shows progress until the job is done.
async fn follow(handle: &Handle, job: JobId) -> Result<JobView, Error> {
    let progress = Progress::new("preparing");
    let mut events = handle.subscribe(job).await?;
    while let Some(event) = events.next().await {
        match event {
            JobEvent::Progress { samples, .. } => {
                progress.say("rendering");
                progress.show(samples.done, samples.total);
            }
            JobEvent::Frame { state: FrameState::Assembling, .. } => progress.say("assembling"),
            JobEvent::State { state: JobState::Done, .. } => break,
            JobEvent::State { state, error } if state.is_final() => {
                let reason = error.unwrap_or_else(|| "no reason was given".to_owned());
                return Err(Error::Job(format!("the job is {}: {reason}", state.name())));
            }
            JobEvent::State { .. } | JobEvent::Frame { .. } | JobEvent::Tile { .. } => {}
        }
    }
    Ok(handle.get(job).await?)
}

async fn files(handle: &Handle, view: &JobView) -> Result<(bytes::Bytes, bytes::Bytes), Error> {
    let (job, frame) = (view.summary.id, Frames::default().first);
    Ok((handle.frame_file(job, frame, FileKind::Exr).await?, handle.frame_file(job, frame, FileKind::Png).await?))
}
