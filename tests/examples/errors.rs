//! How well errors told without a reference agree with the errors that a reference shows.
//!
//! Arguments: files of scenes. `just errors` runs it. For each scene, sample count and reconstruction: the true relMSE, the estimated one,
//! their quotient, and how often the true one lay within the 95 % interval, over independent renders.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::metrics::rel_mse;
use gradfarm_core::plan::{ReconstructionKind, Request, Technique, resolve};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::scene::{Scene, load};
use gradfarm_tests::frame::render;

type Fault = Box<dyn std::error::Error>;

/// Independent renders of each row.
const SEEDS: u64 = 16;
/// Pixels on the longer side.
const SIDE: u32 = 64;
/// Samples per pixel of the rows.
const SAMPLES: [u32; 3] = [4, 16, 64];
/// Samples per pixel of the reference.
const REFERENCE: u32 = 2048;
/// What is told about.
const KINDS: [ReconstructionKind; 3] = [ReconstructionKind::None, ReconstructionKind::L2, ReconstructionKind::L1];

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
    let extent = Extent { width: scaled(width), height: scaled(height) };
    let film = |samples: u32, seed: u64| -> Result<_, Fault> {
        let request = Request { technique: Some(Technique::Gpt), extent: Some(extent), samples: Some(samples), seed, ..Request::default() };
        Ok(render(&scene, &resolve(&loaded.description, &request)?)?)
    };
    let reference: Image = reconstruct(&film(REFERENCE, u64::MAX)?, ReconstructionKind::L2, 0.3)?.image;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}\n  samples kind    true     told     told/true  within  reach   share of bias", file.display())?;
    for samples in SAMPLES {
        let films = (0..SEEDS).map(|seed| film(samples, seed)).collect::<Result<Vec<_>, _>>()?;
        for kind in KINDS {
            let (mut truth, mut told, mut within, mut reach, mut bias) = (0.0, 0.0, 0, 0.0, 0.0);
            for film in &films {
                let done = reconstruct(film, kind, 0.2)?;
                let error = done.error.ok_or("no halves")?;
                let found = rel_mse(&done.image, &reference)?;
                let [low, high] = error.interval.ok_or("no interval")?;
                truth += found;
                told += error.relmse;
                bias += error.bias;
                within += u32::from((low..=high).contains(&found));
                reach += (high / error.relmse) / SEEDS as f64;
            }
            let n = SEEDS as f64;
            writeln!(
                out,
                "  {samples:7} {:5} {:9.2e} {:9.2e} {:8.2} {within:5}/{SEEDS} {reach:7.2} {:7.2}",
                kind.name(),
                truth / n,
                told / n,
                told / truth,
                bias / told
            )?;
        }
    }
    Ok(())
}
