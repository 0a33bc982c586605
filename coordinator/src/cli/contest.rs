//! A contest of methods on one scene: renders each with what its budget has time for, and measures.

use std::path::Path;

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::metrics;
use gradfarm_core::output::exr;
use gradfarm_core::plan::{ReconstructionKind, Request, Technique};
use gradfarm_core::scene::Loaded;

use super::error::Error;
use super::local::{FrameDone, LocalJob};
use super::method::Method;
use super::peer::Mitsuba;
use super::progress::Progress;
use crate::embedded;
use crate::request;
use crate::service::{Frames, Submission};
use crate::study::{Measured, MethodStudy, Run, SceneStudy};

/// What is compared on one scene.
pub(super) struct Contest<'a> {
    /// What to call the scene.
    pub(super) name: String,
    /// Its file.
    pub(super) path: &'a Path,
    /// Itself.
    pub(super) loaded: &'a Loaded,
    /// Size of the images.
    pub(super) size: Extent,
    /// Methods; the first is what the others are compared with.
    pub(super) methods: &'a [Method],
    /// The other renderer, where it reads the scene.
    pub(super) peer: Option<&'a Mitsuba>,
    /// Budgets of time [s], growing.
    pub(super) budgets: &'a [f64],
    /// Seeds of the runs.
    pub(super) seeds: Vec<u64>,
    /// A reference from outside.
    pub(super) reference: Option<Image>,
    /// How long to render one otherwise [s].
    pub(super) reference_seconds: f64,
}

/// The images of a contest.
pub(super) struct Shown {
    /// What all were compared with.
    pub(super) reference: Image,
    /// By method: its image at the largest budget with the first seed.
    pub(super) images: Vec<(String, Image)>,
}

/// Who renders.
#[derive(Clone, Copy)]
enum Entrant<'a> {
    Method(&'a Method),
    Peer(&'a Mitsuba),
}

impl Entrant<'_> {
    fn name(self) -> String {
        match self {
            Entrant::Method(method) => method.to_string(),
            Entrant::Peer(_) => "mitsuba".to_owned(),
        }
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

/// A render, whoever did it.
struct Rendered {
    image: Image,
    cost: Cost,
    told: Option<f64>,
}

/// Share of the least budget that a trial must trace for, so that its speed means something.
const TRIAL: f64 = 0.1;

impl Contest<'_> {
    /// Renders everything.
    ///
    /// # Errors
    /// If a render fails or is interrupted.
    pub(super) async fn hold(self) -> Result<(SceneStudy, Shown), Error> {
        let (reference, origin, reference_relmse) = self.reference().await?;
        let entrants: Vec<Entrant> = self.methods.iter().map(Entrant::Method).chain(self.peer.map(Entrant::Peer)).collect();
        let mut speeds = Vec::with_capacity(entrants.len());
        for entrant in &entrants {
            speeds.push(self.speed(*entrant, self.budgets[0]).await?);
        }
        let mut methods: Vec<MethodStudy> =
            entrants.iter().map(|entrant| MethodStudy { name: entrant.name(), points: Vec::new() }).collect();
        let mut images = Vec::new();
        for budget in self.budgets {
            methods.iter_mut().for_each(|method| method.points.push(Measured { budget: *budget, runs: Vec::new() }));
            // Methods take turns, so that what else the machine does falls on all of them.
            for seed in &self.seeds {
                for ((entrant, speed), method) in entrants.iter().zip(&speeds).zip(&mut methods) {
                    let samples = samples(*speed, *budget);
                    let rendered = self.render(*entrant, samples, *seed, &format!("{budget} s, seed {seed}")).await?;
                    let run = measured(&rendered, &reference, samples, *seed)?;
                    if let Some(point) = method.points.last_mut() {
                        point.runs.push(run);
                    }
                    if Some(budget) == self.budgets.last() && Some(seed) == self.seeds.first() {
                        images.push((entrant.name(), rendered.image));
                    }
                }
            }
        }
        let Extent { width, height } = self.size;
        let scene = SceneStudy { name: self.name, width, height, reference: origin, reference_relmse, methods };
        Ok((scene, Shown { reference, images }))
    }

    /// The reference, where it came from, and its own estimated relMSE.
    async fn reference(&self) -> Result<(Image, String, Option<f64>), Error> {
        if let Some(given) = &self.reference {
            return Ok((given.clone(), "an image that was given".to_owned(), None));
        }
        let method = Method::pair(Technique::Gpt, ReconstructionKind::L2);
        let entrant = Entrant::Method(&method);
        let samples = samples(self.speed(entrant, self.reference_seconds).await?, self.reference_seconds);
        // Runs have this seed and those that follow.
        let seed = self.seeds.first().map_or(u64::MAX, |first| first.wrapping_sub(1));
        let rendered = self.render(entrant, samples, seed, "reference").await?;
        Ok((rendered.image, format!("{method} with {samples} samples per pixel"), rendered.told))
    }

    /// Seconds that a sample per pixel takes, and seconds besides.
    async fn speed(&self, entrant: Entrant<'_>, budget: f64) -> Result<Cost, Error> {
        let mut samples = 4;
        loop {
            let seed = self.seeds.first().map_or(0, |first| first.wrapping_sub(2));
            let cost = self.render(entrant, samples, seed, "trial").await?.cost;
            if cost.tracing >= TRIAL * budget || samples >= 1 << 16 {
                return Ok(Cost { tracing: cost.tracing / f64::from(samples), fixed: cost.fixed });
            }
            // A little more than what was lacking, but not by a wild guess from a few samples.
            let lacking = 1.5 * TRIAL * budget / cost.tracing.max(1e-9);
            samples = (f64::from(samples) * lacking.clamp(2.0, 16.0)) as u32;
        }
    }

    async fn render(&self, entrant: Entrant<'_>, samples: u32, seed: u64, what: &str) -> Result<Rendered, Error> {
        match entrant {
            Entrant::Method(method) => self.render_here(method, samples, seed, what).await,
            Entrant::Peer(mitsuba) => {
                let (mitsuba, scene, size) = (mitsuba.clone(), self.path.to_path_buf(), self.size);
                let work = tokio::task::spawn_blocking(move || mitsuba.render(&scene, samples, seed, size));
                let (image, tracing) = work.await.map_err(|fault| Error::Failed(fault.to_string()))??;
                Ok(Rendered { image, cost: Cost { tracing, fixed: 0.0 }, told: None })
            }
        }
    }

    async fn render_here(&self, method: &Method, samples: u32, seed: u64, what: &str) -> Result<Rendered, Error> {
        let request = method.request(Request { samples: Some(samples), extent: Some(self.size), seed, ..Request::default() });
        let threads = embedded::threads(2, None);
        let (name, frames) = (self.name.clone(), Frames::default());
        let job = LocalJob { name, loaded: self.loaded, request, frames, tile: Submission::TILE / 2, threads: &threads };
        let progress = Progress::new(&format!("{} {method}, {what}", self.name));
        let mut image = None;
        let keep = |frame: FrameDone| {
            image = Some(decode(&frame.exr)?);
            Ok(())
        };
        let view = job.run(&progress, keep).await?;
        let image = image.ok_or_else(|| Error::Failed("the job has no frame".to_owned()))?;
        let seconds = view.seconds;
        let threads = threads.iter().sum::<usize>().max(1) as f64;
        let cost = Cost { tracing: seconds.render / threads, fixed: seconds.stitch + seconds.reconstruct };
        let told = view.frames.first().and_then(|frame| frame.estimated_relmse);
        Ok(Rendered { image, cost, told })
    }
}

/// How many samples per pixel a budget has time for.
fn samples(speed: Cost, budget: f64) -> u32 {
    ((budget - speed.fixed) / speed.tracing).round().clamp(2.0, 1e6) as u32
}

fn measured(rendered: &Rendered, reference: &Image, samples: u32, seed: u64) -> Result<Run, Error> {
    let failed = |fault: metrics::MetricError| Error::Failed(fault.to_string());
    Ok(Run {
        seed,
        samples,
        seconds: rendered.cost.tracing + rendered.cost.fixed,
        relmse: metrics::rel_mse(&rendered.image, reference).map_err(failed)?,
        flip: metrics::flip(&rendered.image, reference).map_err(failed)?,
        estimated_relmse: rendered.told,
    })
}

fn decode(file: &[u8]) -> Result<Image, Error> {
    exr::read_rgb(file).map_err(|fault| Error::Failed(fault.to_string()))
}

/// Reads a reference of this size.
///
/// # Errors
/// If the file cannot be read, or is of another size.
pub(super) fn read(file: &Path, size: Extent) -> Result<Image, Error> {
    let named = |fault: String| Error::Usage(format!("{}: {fault}", file.display()));
    let bytes = std::fs::read(file).map_err(|fault| named(fault.to_string()))?;
    let image = exr::read_rgb(&bytes).map_err(|fault| named(fault.to_string()))?;
    let found = image.extent();
    if found != size {
        return Err(named(format!("{} pixels, expected {} (--size)", request::size_text(found), request::size_text(size))));
    }
    Ok(image)
}
