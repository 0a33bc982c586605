//! What each reconstruction is worth on a scene: its relMSE against a long render, its bias, and its time.
//!
//! Arguments: samples per pixel of the frames, samples per pixel of the reference, and files of scenes. The reference is the least-squares
//! image of one long render; what its own halves say of its noise is taken from every error, so that it need not be free of noise.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use gradfarm_core::film::{Film, Image};
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{Plan, ReconstructionKind, Request, Technique, resolve};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::scene::{Scene, load};
use gradfarm_tests::frame::render;

type Fault = Box<dyn std::error::Error>;

/// Independent frames.
const SEEDS: u64 = 3;
/// Pixels on the longer side.
const SIDE: u32 = 128;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize| arguments.get(k).and_then(|text| text.parse::<u32>().ok());
    let (Some(samples), Some(long)) = (number(0), number(1)) else {
        eprintln!("expected samples per pixel, samples per pixel of the reference, and files of scenes");
        return ExitCode::FAILURE;
    };
    for file in &arguments[2..] {
        if let Err(fault) = table(Path::new(file), samples, long) {
            eprintln!("{file}: {fault}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// A long render: an image and the variance of each of its values.
struct Reference {
    image: Image,
    variance: Image,
}

impl Reference {
    fn render(scene: &Scene, plan: &Plan) -> Result<Self, Fault> {
        let done = reconstruct(&render(scene, plan)?, ReconstructionKind::L2, plan.alpha)?;
        let [a, b] = done.halves.ok_or("a reference needs two samples")?;
        let mut variance = a;
        variance.data_mut().iter_mut().zip(b.data()).for_each(|(a, b)| *a = 0.25 * (*a - b) * (*a - b));
        Ok(Self { image: done.image, variance })
    }

    /// relMSE of an image, without what the reference's own noise adds.
    fn error(&self, image: &Image) -> f64 {
        self.mean(|k| {
            let off = f64::from(image.data()[k]) - f64::from(self.image.data()[k]);
            off * off - f64::from(self.variance.data()[k])
        })
    }

    /// Mean over values, relative as in relMSE.
    fn mean(&self, value: impl Fn(usize) -> f64) -> f64 {
        let pixels = self.image.extent().pixels();
        let of = |i: usize| {
            let grey = (0..3).map(|c| f64::from(self.image.plane(c)[i])).sum::<f64>() / 3.0;
            (0..3).map(|c| value(c * pixels + i)).sum::<f64>() / (3.0 * (grey * grey + 1e-3))
        };
        (0..pixels).map(of).sum::<f64>() / pixels as f64
    }
}

fn table(file: &Path, samples: u32, long: u32) -> Result<(), Fault> {
    let loaded = load(file)?;
    let scene = Scene::compile(&loaded.description, &loaded.assets)?;
    let (width, height) = loaded.description.film.rendered();
    let longer = width.max(height).max(1);
    let scaled = |side: u32| (u64::from(side) * u64::from(SIDE) / u64::from(longer)).max(1) as u32;
    let request = Request {
        technique: Some(Technique::Gpt),
        extent: Some(Extent { width: scaled(width), height: scaled(height) }),
        samples: Some(samples),
        ..Request::default()
    };
    let plan = resolve(&loaded.description, &request)?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "\n{} at {samples} samples\n", file.file_name().unwrap_or_default().display())?;
    writeln!(out, "| reconstruction | relMSE | over l2 | bias² of the mean | energy | estimated | s |")?;
    writeln!(out, "|---|--:|--:|--:|--:|--:|--:|")?;
    let reference = Reference::render(&scene, &Plan { samples: long, seed: 1 << 40, ..plan.clone() })?;
    let films: Vec<Film> = (0..SEEDS).map(|seed| render(&scene, &Plan { seed, ..plan.clone() })).collect::<Result<_, _>>()?;
    let mut first = None;
    for kind in ReconstructionKind::ALL.into_iter().filter(|kind| plan.technique.takes(*kind) && kind.is_reproducible()) {
        let start = Instant::now();
        let done: Vec<_> = films.iter().map(|film| reconstruct(film, kind, plan.alpha)).collect::<Result<_, _>>()?;
        let time = start.elapsed().as_secs_f64() / SEEDS as f64;
        let images: Vec<&Image> = done.iter().map(|done| &done.image).collect();
        let error = images.iter().map(|image| reference.error(image)).sum::<f64>() / SEEDS as f64;
        if kind == ReconstructionKind::L2 {
            first = Some(error);
        }
        let estimated = done.iter().filter_map(|done| done.error.as_ref().map(|e| e.relmse)).sum::<f64>() / SEEDS as f64;
        let energy = |image: &Image| image.data().iter().map(|v| f64::from(*v)).sum::<f64>();
        let kept = images.iter().map(|image| energy(image)).sum::<f64>() / SEEDS as f64 / energy(&reference.image);
        writeln!(
            out,
            "| {} | {error:.3e} | {:.2} | {:.3e} | {kept:.4} | {estimated:.3e} | {time:.3} |",
            kind.name(),
            first.map_or(1.0, |first| error / first),
            bias(&images, &reference),
        )?;
        out.flush()?;
    }
    Ok(())
}

/// Squared bias, relative as relMSE, without bias of its own: the product of two frames' errors, less the reference's variance.
fn bias(images: &[&Image], reference: &Reference) -> f64 {
    let pairs: Vec<(usize, usize)> = (0..images.len()).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
    let product = |(i, j): &(usize, usize)| {
        reference.mean(|k| {
            let off = |image: &Image| f64::from(image.data()[k]) - f64::from(reference.image.data()[k]);
            off(images[*i]) * off(images[*j]) - f64::from(reference.variance.data()[k])
        })
    };
    pairs.iter().map(product).sum::<f64>() / pairs.len() as f64
}
