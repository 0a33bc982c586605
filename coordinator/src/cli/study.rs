//! `gradfarm study`: what accuracy costs in time: methods against a reference, at equal time.

use std::path::{Path, PathBuf};

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::metrics;
use gradfarm_core::output::exr;
use gradfarm_core::plan::Request;
use gradfarm_core::scene::Loaded;
use serde::Serialize;

use super::error::Error;
use super::local::{LocalDone, LocalJob};
use super::method::Method;
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
path-traced reference of other random numbers, or with an image of your own. The ratio says how many times longer path tracing would \
need for the same error: (error x time of pt) / (error x time of the method), errors and times being means over the seeds. The \
reference's own error, estimated from its halves, stands in the last column.

A method is a technique with its reconstruction, and options after colons: gpt+l2, reuse+l1, gpt+l2:shift=replay:rounds=4. \
Options: shift, survival, alpha, reuse-edge, links, rounds, max-depth.

Times on a busy machine are noisy: compare rows of one run, not runs.

Examples:
  gradfarm study tests/scenes/cornell-box.json tests/scenes/hall.json tests/scenes/door-ajar.json
  gradfarm study scene.xml --methods gpt+l2,gpt+l2:rounds=4 --seeds 3 --reference reference.exr --json")]
pub(super) struct Study {
    /// Scenes: gradfarm JSON, Mitsuba XML, glTF or pbrt
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// What to compare with path tracing
    #[arg(long, value_name = "METHOD,...", value_delimiter = ',', default_value = "gpt+l2,gpt+l1")]
    methods: Vec<Method>,
    /// Samples a pixel of path tracing, which set the time budget
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..))]
    samples: u32,
    /// Samples a pixel of the reference
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(2..))]
    reference_samples: u32,
    /// An image of the same size to compare with, instead of rendering one; for a single scene
    #[arg(long, value_name = "FILE.exr", conflicts_with = "reference_samples")]
    reference: Option<PathBuf>,
    /// Size of the images in pixels
    #[arg(long, value_name = "WxH", default_value = "128x96", value_parser = request::size)]
    size: Extent,
    /// First seed; the reference uses another
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// How many seeds each method is run with
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// Print one JSON object a row instead of a table
    #[arg(long)]
    json: bool,
}

/// One method on one scene: means over the seeds.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    method: String,
    /// Samples a pixel.
    samples: u32,
    /// Tracing on all threads, stitching and reconstruction [s].
    seconds: f64,
    /// Camera samples per second of tracing.
    samples_per_second: f64,
    relmse: f64,
    /// Largest relMSE over the smallest, of the seeds.
    spread: f64,
    /// (relMSE · seconds) of path tracing over that of this method.
    ratio: f64,
    /// Estimated relMSE of the reference.
    reference_relmse: Option<f64>,
}

/// What a scene is compared with.
struct Reference {
    image: Image,
    /// Its own estimated relMSE, where it was rendered here.
    relmse: Option<f64>,
}

impl Study {
    /// Renders everything and prints the table.
    pub(super) fn run(self) -> Result<(), Error> {
        telemetry::start("warn", telemetry::Format::Text).map_err(Error::Usage)?;
        if self.reference.is_some() && self.scenes.len() > 1 {
            return Err(Error::Usage(format!("--reference is an image of one scene, found {} scenes", self.scenes.len())));
        }
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
        let path = Method::path_tracing();
        let reference = match &self.reference {
            Some(file) => Reference { image: read(file, self.size)?, relmse: None },
            None => {
                let (done, _) = self.render(name, loaded, &path, self.reference_samples, self.seed.wrapping_sub(1)).await?;
                Reference { image: image(&done)?, relmse: done.view.frames.first().and_then(|f| f.estimated_relmse) }
            }
        };
        let pt = self.measure(name, loaded, &path, self.samples, &reference).await?;
        let (budget, base) = (pt.seconds, pt.relmse * pt.seconds);
        self.tell(&pt)?;
        for method in &self.methods {
            let trial = (self.samples / 8).max(4);
            let (_, cost) = self.render(name, loaded, method, trial, self.seed.wrapping_sub(2)).await?;
            let samples = ((budget - cost.fixed) / (cost.tracing / f64::from(trial))).round().max(2.0) as u32;
            let mut row = self.measure(name, loaded, method, samples, &reference).await?;
            row.ratio = base / (row.relmse * row.seconds);
            self.tell(&row)?;
        }
        Ok(())
    }

    /// Runs a method once with each seed.
    async fn measure(&self, name: &str, loaded: &Loaded, method: &Method, samples: u32, reference: &Reference) -> Result<Row, Error> {
        let (mut errors, mut seconds, mut tracing) = (Vec::new(), 0.0, 0.0);
        for k in 0..self.seeds {
            let (done, cost) = self.render(name, loaded, method, samples, self.seed.wrapping_add(u64::from(k))).await?;
            errors.push(metrics::rel_mse(&image(&done)?, &reference.image).map_err(|fault| Error::Failed(fault.to_string()))?);
            seconds += cost.total();
            tracing += cost.tracing;
        }
        let runs = f64::from(self.seeds);
        let (least, most) = errors.iter().fold((f64::INFINITY, 0.0f64), |(least, most), e| (least.min(*e), most.max(*e)));
        Ok(Row {
            scene: name.to_owned(),
            method: method.to_string(),
            samples,
            seconds: seconds / runs,
            samples_per_second: runs * f64::from(samples) * self.size.pixels() as f64 / tracing,
            relmse: errors.iter().sum::<f64>() / runs,
            spread: most / least,
            ratio: 1.0,
            reference_relmse: reference.relmse,
        })
    }

    async fn render(&self, name: &str, loaded: &Loaded, method: &Method, samples: u32, seed: u64) -> Result<(LocalDone, Cost), Error> {
        let request = method.request(Request { samples: Some(samples), extent: Some(self.size), seed, ..Request::default() });
        let threads = embedded::threads(2, None);
        let job = LocalJob { name: name.to_owned(), loaded, request, tile: Submission::TILE / 2, threads: &threads };
        let progress = Progress::new(&format!("{name} {method}"));
        let done = job.run(&progress).await?;
        let seconds = done.view.seconds;
        let threads = threads.iter().sum::<usize>().max(1) as f64;
        let cost = Cost { tracing: seconds.render / threads, fixed: seconds.stitch + seconds.reconstruct };
        Ok((done, cost))
    }

    fn tell(&self, row: &Row) -> Result<(), Error> {
        if self.json {
            return terminal::json(row);
        }
        let reference = row.reference_relmse.map_or(String::new(), |e| format!("{e:.1e}"));
        terminal::line(format_args!(
            "| {} | {} | {} | {:.2} s | {:.2} M | {:.2e} | {:.1} | {reference} |",
            row.scene,
            row.method.replacen('+', " + ", 1),
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

fn read(file: &Path, size: Extent) -> Result<Image, Error> {
    let named = |fault: String| Error::Usage(format!("{}: {fault}", file.display()));
    let bytes = std::fs::read(file).map_err(|fault| named(fault.to_string()))?;
    let image = exr::read_rgb(&bytes).map_err(|fault| named(fault.to_string()))?;
    let found = image.extent();
    if found != size {
        return Err(named(format!("{} pixels, expected {} (--size)", request::size_text(found), request::size_text(size))));
    }
    Ok(image)
}
