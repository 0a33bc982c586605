//! What each shift is worth on a scene: variance of the measured differences and of the L2 image, and what they cost.
//!
//! Arguments: files of scenes. `just shifts` runs it. Renders run one after the other with the same samples, so that only the shift
//! differs; cost is rays, which a busy machine does not blur, with times beside them.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use gradfarm_core::film::{Counter, Film, Image};
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{Plan, ReconstructionKind, Request, ShiftKind, Technique, resolve};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::scene::{Scene, load};
use gradfarm_tests::frame::render;
use gradfarm_tests::statistics::Estimate;

type Fault = Box<dyn std::error::Error>;

/// Independent renders of each shift.
const SEEDS: u64 = 8;
/// Pixels on the longer side.
const SIDE: u32 = 64;
/// Samples per pixel of each render.
const SAMPLES: u32 = 16;

/// What one method did, as means over its seeds.
struct Worth {
    /// Mean over pixels of the differences' variance over that of path tracing's own differences.
    differences: f64,
    /// relMSE of the L2 image: its variance over seeds, over its squared mean.
    image: f64,
    /// The same of the primal.
    primal: f64,
    /// Rays a sample.
    rays: f64,
    /// Time a sample [µs], all threads together.
    time: f64,
    /// Share of shifts that have an answer [1].
    there: f64,
}

fn main() -> ExitCode {
    for file in std::env::args().skip(1) {
        if let Err(fault) = table(Path::new(&file)) {
            eprintln!("{file}: {fault}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

fn table(file: &Path) -> Result<(), Fault> {
    let loaded = load(file)?;
    let scene = Scene::compile(&loaded.description, &loaded.assets)?;
    let (width, height) = loaded.description.film.rendered();
    let longer = width.max(height).max(1);
    let scaled = |side: u32| (u64::from(side) * u64::from(SIDE) / u64::from(longer)).max(1) as u32;
    let request = Request {
        technique: Some(Technique::Gpt),
        extent: Some(Extent { width: scaled(width), height: scaled(height) }),
        samples: Some(SAMPLES),
        ..Request::default()
    };
    let mut out = std::io::stdout().lock();
    let name = loaded.description.about.split('.').next().unwrap_or_default().to_owned();
    writeln!(out, "\n{} ({name})\n", file.display())?;
    writeln!(out, "| shift | answers | rays | µs | variance of differences | relMSE of L2 | of primal | differences × rays | L2 × rays |")?;
    writeln!(out, "|---|--:|--:|--:|--:|--:|--:|--:|--:|")?;
    let mut first = None;
    for kind in ShiftKind::ALL {
        let plan = resolve(&loaded.description, &Request { shift: Some(kind), ..request.clone() })?;
        let worth = measure(&scene, &plan)?;
        let (d, i) = (worth.differences * worth.rays, worth.image * worth.rays);
        let (d0, i0) = *first.get_or_insert((d, i));
        writeln!(
            out,
            "| {} | {:.1} % | {:.1} | {:.1} | {:.4} | {:.3e} | {:.3e} | {:.2} | {:.2} |",
            kind.name(),
            100.0 * worth.there,
            worth.rays,
            worth.time,
            worth.differences,
            worth.image,
            worth.primal,
            d / d0,
            i / i0
        )?;
        out.flush()?;
    }
    Ok(())
}

/// Renders with every seed.
fn measure(scene: &Scene, plan: &Plan) -> Result<Worth, Fault> {
    let start = Instant::now();
    let films: Vec<Film> = (0..SEEDS)
        .map(|seed| render(scene, &Plan { seed, ..plan.clone() }))
        .collect::<Result<_, _>>()
        .map_err(|fault| fault.to_string())?;
    let time = start.elapsed().as_secs_f64();
    let images: Vec<Image> = films.iter().map(|film| indirect(film, plan.alpha)).collect::<Result<_, _>>()?;
    let primals: Vec<Image> = films.iter().map(|film| film.combined().primal).collect();
    let total = |counter| films.iter().map(|film| film.statistics.get(counter)).sum::<u64>() as f64;
    let samples = total(Counter::Samples);
    let failures = [
        Counter::ShiftEscaped,
        Counter::ShiftOccluded,
        Counter::ShiftLobeMismatch,
        Counter::ShiftTotalReflection,
        Counter::ShiftIrreversible,
    ];
    let answers =
        [Counter::ShiftReconnectedSurface, Counter::ShiftReconnectedMedium, Counter::ShiftReconnectedInfinity, Counter::ShiftFollowed];
    let [failed, there] = [failures.into_iter().map(total).sum::<f64>(), answers.into_iter().map(total).sum()];
    Ok(Worth {
        differences: spread(&films),
        image: rel_mse(&images),
        primal: rel_mse(&primals),
        rays: total(Counter::Rays) / samples,
        time: 1e6 * time / samples,
        there: there / (there + failed),
    })
}

/// The L2 image without directly visible emission, whose edges are as noisy whatever the shift.
fn indirect(film: &Film, alpha: Option<f32>) -> Result<Image, Fault> {
    let mut image = reconstruct(film, ReconstructionKind::L2, alpha)?.image;
    for (value, direct) in image.data_mut().iter_mut().zip(film.combined().direct.data()) {
        *value -= direct;
    }
    Ok(image)
}

/// Variance of the measured differences over that of the differences of the primal, both as the films estimate them.
fn spread(films: &[Film]) -> f64 {
    let (mut differences, mut primal) = (0.0, 0.0);
    for film in films {
        let film = film.combined();
        let sum = |image: &Image| image.data().iter().map(|v| f64::from(*v)).sum::<f64>();
        // A difference of two pixels has the variance of both.
        primal += 4.0 * sum(&film.primal_variance);
        differences += film.gradients.map_or(0.0, |g| sum(&g.dx_variance) + sum(&g.dy_variance));
    }
    differences / primal
}

/// Variance over seeds of each value over its squared mean, which 0.01 keeps from zero: the mean over values.
fn rel_mse(images: &[Image]) -> f64 {
    let values = images[0].data().len();
    let one = |k: usize| {
        let runs: Vec<f64> = images.iter().map(|image| f64::from(image.data()[k])).collect();
        let estimate = Estimate::of(&runs);
        estimate.variance * images.len() as f64 / (estimate.mean * estimate.mean + 1e-2)
    };
    (0..values).map(one).sum::<f64>() / values as f64
}
