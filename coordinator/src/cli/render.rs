//! `gradfarm render`: a whole farm for one image or one batch of frames, in this process.

use std::path::PathBuf;
use std::time::Instant;

use gradfarm_core::plan::{self, Request, Stop};
use gradfarm_core::scene::{Loaded, SceneDescription};

use super::accuracy::CurveTarget;
use super::error::Error;
use super::files::FrameTarget;
use super::local::{FrameDone, LocalJob};
use super::options::RenderOptions;
use super::outputs::{FrameWriter, OutputOptions};
use super::progress::Progress;
use super::report::{Clock, Files, Report};
use super::{scene, terminal};
use crate::embedded;
use crate::service::Submission;
use crate::telemetry;

/// Arguments of `gradfarm render`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
-o names what to write: OUT.exr is the image in the default layer, and what it was made from in named layers, with OUT.png beside \
it; out.%04d.exr is one for each frame, written as soon as it is done; out.mp4 and out.webm are movies, where ffmpeg is installed; \
out.png is an animated PNG. The same scene, options and seed give the same pixels bit for bit, whatever --workers, --threads and \
--tile are.

With --json, the last line on standard output is one JSON object: samples_per_second (camera samples over the time spent \
tracing), seconds by phase, samples, width, height, technique, reconstruction, estimated_relmse, accuracy, statistics, output, and \
frames with number, samples, estimated_relmse and output of each.

With --error, --seconds or both the image stops at whichever is met first, or at --samples; the report says how far it got. What time \
decided can be had again bit for bit: ask for the samples that the report names.

Examples:
  gradfarm render tests/scenes/cornell-box.json -o cornell.exr
  gradfarm render scene.xml -o a.exr --technique pt --samples 256 --size 640x480
  gradfarm render scene.json -o a.exr --error 0.01 --seconds 60 --accuracy curve.svg
  gradfarm render scene.json -o a.exr --json | jq .samples_per_second
  gradfarm render dance.glb -o out/frame.%04d.exr --frames 0..48 --fps 24 --shutter 0.5
  gradfarm render dance.glb -o dance.mp4 -o dance.png --contact-sheet sheet.png --size 640x360")]
pub(super) struct Render {
    /// The scene: gradfarm JSON, Mitsuba XML, glTF or pbrt
    scene: PathBuf,
    #[command(flatten)]
    output: OutputOptions,
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
    /// Write what was counted, tile by tile, to this file: shifts by outcome and cause, rays, values that were not finite; with a
    /// number in its name, such as f.%04d.json, of each frame
    #[arg(long, value_name = "FILE.json")]
    statistics: Option<PathBuf>,
    /// Write what accuracy cost to this file: a plot if its name ends in .svg, numbers if it ends in .json; with a number in its name
    /// of each frame; implies --curve
    #[arg(long, value_name = "FILE")]
    accuracy: Option<PathBuf>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

impl Render {
    /// Renders, writes what was asked for and prints where the time went.
    pub(super) fn run(self) -> Result<(), Error> {
        telemetry::start("warn", telemetry::Format::Text).map_err(Error::Usage)?;
        let outputs = self.output.check_some()?;
        let statistics = self.statistics.as_deref().map(FrameTarget::check).transpose()?;
        let curve = self.accuracy.as_deref().map(CurveTarget::check).transpose()?;
        let mut clock = Clock::start();
        let loaded = scene::read(&self.scene)?;
        let request = self.request(&loaded.description);
        let frames = self.options.frames(&loaded.description);
        // The coordinator plans again; this only tells at once what it would refuse.
        let plan = plan::resolve(&loaded.description, &request)?;
        statistics.as_ref().map(|target| target.check_count(frames.count)).transpose()?;
        curve.as_ref().map(|target| target.check_count(frames.count)).transpose()?;
        let writer = outputs.open(frames, plan.timeline.unwrap_or_default().fps)?;
        clock.loaded();
        let work = Work { writer, statistics, curve };
        let report = super::runtime()?.block_on(self.render(&loaded, request, work, clock))?;
        if self.json {
            terminal::json(&report.json())?
        } else {
            report.print()?
        }
        match report.failed_units() {
            0 => Ok(()),
            failed => Err(Error::Flawed(format!("{failed} units were given up: what they should show is filled in from around"))),
        }
    }

    fn request(&self, scene: &SceneDescription) -> Request {
        let asked = self.options.request_for(scene);
        let stop = Stop { curve: asked.stop.curve || self.accuracy.is_some(), ..asked.stop };
        Request { stop, ..asked }
    }

    async fn render(&self, loaded: &Loaded, request: Request, work: Work, mut clock: Clock) -> Result<Report, Error> {
        let Work { mut writer, statistics, curve } = work;
        let threads = embedded::threads(self.workers, self.threads);
        let (name, frames) = (scene::job_name(&self.scene), writer.frames());
        let job = LocalJob { name, loaded, request, frames, tile: self.tile, threads: &threads };
        let mut accuracy = Vec::new();
        let write = |done: FrameDone| {
            let writing = Instant::now();
            writer.write(done.number, &done.exr, &done.png)?;
            statistics.as_ref().map(|target| target.write(done.number, &done.statistics)).transpose()?;
            curve.as_ref().map(|target| target.write(&done.accuracy)).transpose()?;
            accuracy.push(done.accuracy);
            clock.wrote(writing.elapsed());
            Ok(())
        };
        let view = job.run(&Progress::new("preparing"), write).await?;
        let writing = Instant::now();
        let files = Files::of(&writer);
        writer.finish()?;
        clock.wrote(writing.elapsed());
        Ok(Report::new(view, &accuracy, &threads, clock, files))
    }
}

/// Where the frames go.
struct Work {
    writer: FrameWriter,
    statistics: Option<FrameTarget>,
    curve: Option<CurveTarget>,
}
