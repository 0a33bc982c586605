//! `gradfarm study`: what accuracy costs in time: techniques and reconstructions against a reference, at equal time.

use std::path::PathBuf;

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::metrics;
use gradfarm_core::output::exr;
use gradfarm_core::plan::{ReconstructionKind, Request, Technique};
use gradfarm_core::scene::Loaded;
use serde::Serialize;

use super::error::Error;
use super::local::{LocalDone, LocalJob};
use super::progress::Progress;
use super::{scene, terminal};
use crate::embedded;
use crate::request;
use crate::service::Submission;
use crate::telemetry;

/// Arguments of `gradfarm study`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each scene is rendered by path tracing with --samples samples a pixel; the time that takes (tracing on all threads, adding up, \
reconstruction) is the budget of every other method, whose sample count follows from a short trial. All are compared with a \
path-traced reference of other random numbers. The ratio says how many times longer path tracing would need for the same error: \
(error x time of pt) / (error x time of the method). The reference's own error, estimated from its halves, stands in the last column.

Times on a busy machine are noisy: compare rows of one run, not runs.

Examples:
  gradfarm study tests/scenes/cornell-box.json tests/scenes/hall.json tests/scenes/door-ajar.json
  gradfarm study scene.xml --samples 256 --reference-samples 65536 --json")]
pub(super) struct Study {
    /// Scenes: gradfarm JSON, Mitsuba XML, glTF or pbrt
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// Samples a pixel of path tracing, which set the time budget
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..))]
    samples: u32,
    /// Samples a pixel of the reference
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(2..))]
    reference_samples: u32,
    /// Size of the images in pixels
    #[arg(long, value_name = "WxH", default_value = "128x96", value_parser = request::size)]
    size: Extent,
    /// Seed; the reference uses another
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Print one JSON object a row instead of a table
    #[arg(long)]
    json: bool,
}

/// One method on one scene.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    technique: &'static str,
    reconstruction: &'static str,
    /// Samples a pixel.
    samples: u32,
    /// Tracing on all threads, stitching and reconstruction [s].
    seconds: f64,
    /// Camera samples per second of tracing.
    samples_per_second: f64,
    relmse: f64,
    /// (relMSE · seconds) of path tracing over that of this method.
    ratio: f64,
    /// Estimated relMSE of the reference.
    reference_relmse: Option<f64>,
}

/// What is compared with plain path tracing.
const METHODS: [(Technique, ReconstructionKind); 2] = [(Technique::Gpt, ReconstructionKind::L2), (Technique::Gpt, ReconstructionKind::L1)];

impl Study {
    /// Renders everything and prints the table.
    pub(super) fn run(self) -> Result<(), Error> {
        telemetry::start("warn", telemetry::Format::Text).map_err(Error::Usage)?;
        let scenes: Vec<(String, Loaded)> =
            self.scenes.iter().map(|path| Ok((scene::job_name(path), scene::read(path)?))).collect::<Result<_, Error>>()?;
        let runtime = super::runtime()?;
        if !self.json {
            terminal::line("| scene | method | samples | time | samples/s | relMSE | ratio | relMSE of reference |")?;
            terminal::line("|---|---|--:|--:|--:|--:|--:|--:|")?;
        }
        for (name, loaded) in &scenes {
            runtime.block_on(self.scene(name, loaded))?;
        }
        Ok(())
    }

    async fn scene(&self, name: &str, loaded: &Loaded) -> Result<(), Error> {
        let path = (Technique::Pt, ReconstructionKind::None);
        let (done, _) = self.render(name, loaded, path, self.reference_samples, self.seed.wrapping_add(0x5eed)).await?;
        let reference = image(&done)?;
        let reference_relmse = done.view.frames.first().and_then(|f| f.estimated_relmse);
        let (pt, cost) = self.render(name, loaded, path, self.samples, self.seed).await?;
        let budget = cost.total();
        let base = metrics::rel_mse(&image(&pt)?, &reference).map_err(|fault| Error::Failed(fault.to_string()))? * budget;
        self.tell(name, path, self.samples, &pt, cost, base, &reference, reference_relmse)?;
        for method in METHODS {
            let trial = (self.samples / 8).max(4);
            let (_, cost) = self.render(name, loaded, method, trial, self.seed.wrapping_add(1)).await?;
            let samples = ((budget - cost.fixed) / (cost.tracing / f64::from(trial))).round().max(2.0) as u32;
            let (done, cost) = self.render(name, loaded, method, samples, self.seed).await?;
            self.tell(name, method, samples, &done, cost, base, &reference, reference_relmse)?;
        }
        Ok(())
    }

    async fn render(
        &self,
        name: &str,
        loaded: &Loaded,
        (technique, reconstruction): (Technique, ReconstructionKind),
        samples: u32,
        seed: u64,
    ) -> Result<(LocalDone, Cost), Error> {
        let request = Request {
            technique: Some(technique),
            reconstruction: Some(reconstruction),
            samples: Some(samples),
            extent: Some(self.size),
            seed,
            ..Request::default()
        };
        let threads = embedded::threads(2, None);
        let job = LocalJob { name: name.to_owned(), loaded, request, tile: Submission::TILE / 2, threads: &threads };
        let progress = Progress::new(&format!("{name} {}", technique.name()));
        let done = job.run(&progress).await?;
        let seconds = done.view.seconds;
        let threads = threads.iter().sum::<usize>().max(1) as f64;
        let cost = Cost { tracing: seconds.render / threads, fixed: seconds.stitch + seconds.reconstruct };
        Ok((done, cost))
    }

    #[expect(clippy::too_many_arguments, reason = "one row of a table, told once")]
    fn tell(
        &self,
        name: &str,
        (technique, reconstruction): (Technique, ReconstructionKind),
        samples: u32,
        done: &LocalDone,
        cost: Cost,
        base: f64,
        reference: &Image,
        reference_relmse: Option<f64>,
    ) -> Result<(), Error> {
        let relmse = metrics::rel_mse(&image(done)?, reference).map_err(|fault| Error::Failed(fault.to_string()))?;
        let row = Row {
            scene: name.to_owned(),
            technique: technique.name(),
            reconstruction: reconstruction.name(),
            samples,
            seconds: cost.total(),
            samples_per_second: f64::from(samples) * self.size.pixels() as f64 / cost.tracing,
            relmse,
            ratio: base / (relmse * cost.total()),
            reference_relmse,
        };
        if self.json {
            return terminal::json(&row);
        }
        let method = if reconstruction == ReconstructionKind::None {
            row.technique.to_owned()
        } else {
            format!("{} + {}", row.technique, row.reconstruction)
        };
        let reference = row.reference_relmse.map_or(String::new(), |e| format!("{e:.1e}"));
        terminal::line(format_args!(
            "| {} | {method} | {} | {:.2} s | {:.2} M | {:.2e} | {:.1} | {reference} |",
            row.scene,
            row.samples,
            row.seconds,
            row.samples_per_second / 1e6,
            row.relmse,
            row.ratio
        ))
    }
}

/// What a render cost, as wall-clock time on all threads [s].
#[derive(Clone, Copy, Debug)]
struct Cost {
    /// Grows with the samples.
    tracing: f64,
    /// Stitching and reconstruction.
    fixed: f64,
}

impl Cost {
    fn total(self) -> f64 {
        self.tracing + self.fixed
    }
}

fn image(done: &LocalDone) -> Result<Image, Error> {
    exr::read_rgb(&done.exr).map_err(|fault| Error::Failed(fault.to_string()))
}
