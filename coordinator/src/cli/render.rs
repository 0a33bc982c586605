//! `gradfarm render`: a whole farm for one image, in this process.

use std::path::PathBuf;
use std::time::Instant;

use gradfarm_core::plan::{self, Request, Stop};
use gradfarm_core::scene::Loaded;

use super::accuracy::CurveTarget;
use super::error::Error;
use super::files::{ImageTarget, Target};
use super::local::LocalJob;
use super::options::RenderOptions;
use super::progress::Progress;
use super::report::{Clock, Report};
use super::{scene, terminal};
use crate::embedded;
use crate::service::Submission;
use crate::telemetry;

/// Arguments of `gradfarm render`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Writes OUT.exr (the image in the default layer, and what it was made from in named layers) and OUT.png beside it. The same scene, \
options and seed give the same pixels bit for bit, whatever --workers, --threads and --tile are.

With --json, the last line on standard output is one JSON object: samples_per_second (camera samples over the time spent \
tracing), seconds by phase, samples, width, height, technique, reconstruction, estimated_relmse, accuracy, statistics, output.

With --error, --seconds or both the image stops at whichever is met first, or at --samples; the report says how far it got. What time \
decided can be had again bit for bit: ask for the samples that the report names.

Examples:
  gradfarm render tests/scenes/cornell-box.json -o cornell.exr
  gradfarm render scene.xml -o a.exr --technique pt --samples 256 --size 640x480
  gradfarm render scene.json -o a.exr --error 0.01 --seconds 60 --accuracy curve.svg
  gradfarm render scene.json -o a.exr --json | jq .samples_per_second")]
pub(super) struct Render {
    /// The scene: gradfarm JSON, Mitsuba XML, glTF or pbrt
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
    /// Write what was counted, tile by tile, to this file: shifts by outcome and cause, rays, values that were not finite
    #[arg(long, value_name = "FILE.json")]
    statistics: Option<PathBuf>,
    /// Write what accuracy cost to this file: a plot if its name ends in .svg, numbers if it ends in .json; implies --curve
    #[arg(long, value_name = "FILE")]
    accuracy: Option<PathBuf>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

impl Render {
    /// Renders, writes both images and prints where the time went.
    pub(super) fn run(self) -> Result<(), Error> {
        telemetry::start("warn", telemetry::Format::Text).map_err(Error::Usage)?;
        let outputs = Target::check_image(&self.output)?;
        let statistics = self.statistics.as_deref().map(Target::check).transpose()?;
        let curve = self.accuracy.as_deref().map(CurveTarget::check).transpose()?;
        let mut clock = Clock::start();
        let loaded = scene::read(&self.scene)?;
        // The coordinator plans again; this only tells at once what it would refuse.
        plan::resolve(&loaded.description, &self.request())?;
        clock.loaded();
        let report = super::runtime()?.block_on(self.render(&loaded, &outputs, statistics.as_ref(), curve.as_ref(), clock))?;
        if self.json { terminal::json(&report.json()) } else { report.print() }
    }

    fn request(&self) -> Request {
        let asked = self.options.request();
        let stop = Stop { curve: asked.stop.curve || self.accuracy.is_some(), ..asked.stop };
        Request { stop, ..asked }
    }

    async fn render(
        &self,
        loaded: &Loaded,
        outputs: &ImageTarget,
        statistics: Option<&Target>,
        curve: Option<&CurveTarget>,
        mut clock: Clock,
    ) -> Result<Report, Error> {
        let threads = embedded::threads(self.workers, self.threads);
        let job = LocalJob { name: scene::job_name(&self.scene), loaded, request: self.request(), tile: self.tile, threads: &threads };
        let done = job.run(&Progress::new("preparing")).await?;
        let writing = Instant::now();
        outputs.exr.write(&done.exr)?;
        outputs.png.write(&done.png)?;
        statistics.map(|target| target.write(&done.statistics)).transpose()?;
        curve.map(|target| target.write(&done.accuracy)).transpose()?;
        clock.wrote(writing.elapsed());
        Ok(Report::new(&done, &threads, clock, outputs.exr.path(), outputs.png.path()))
    }
}
