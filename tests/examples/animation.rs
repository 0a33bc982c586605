//! What gradients in time are worth: an animation by each method at equal total processor time, reconstruction counted, its relMSE a frame and its
//! flicker, the relative square error of the differences between frames; and how noisy differences in time are, over what they would be if
//! moments shared no numbers. Pixels that see a light are left out: directly visible emission is no matter of reconstruction.
//!
//! Arguments: file of an animated scene, frames per second, frames, samples per pixel of `pt`, samples per pixel of the reference, and a
//! film size such as 96x72. The reference is the least-squares image of one long render a frame; its own noise is taken off.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use gradfarm_core::film::{Film, Image};
use gradfarm_core::lattice::{Extent, Moment};
use gradfarm_core::plan::{Plan, ReconstructionKind, Request, Technique, Temporal, Timeline, resolve};
use gradfarm_core::reconstruction::window::{MomentFilm, Share, Windows, blend, finish, solve};
use gradfarm_core::reconstruction::{SolveReport, reconstruct};
use gradfarm_core::scene::{Instants, Scene, load};
use gradfarm_tests::animation::{copies, whole};
use gradfarm_tests::effort::Effort;

type Fault = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    match study(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::FAILURE
        }
    }
}

/// Image and variance of each of its values, and which pixels see a light.
struct Known {
    image: Image,
    variance: Image,
    lights: Vec<bool>,
}

/// One way to render an animation.
#[derive(Clone, Copy)]
struct Method {
    name: &'static str,
    technique: Technique,
    reconstruction: ReconstructionKind,
    /// Whether frames are reconstructed together, and whether that follows what moves.
    temporal: Option<bool>,
    /// Whether frames share no numbers.
    apart: bool,
}

const METHODS: [Method; 6] = [
    Method::of("pt, frames apart", Technique::Pt, ReconstructionKind::None, None, true),
    Method::of("gpt+l2, frames apart", Technique::Gpt, ReconstructionKind::L2, None, true),
    Method::of("gpt+l2", Technique::Gpt, ReconstructionKind::L2, None, false),
    Method::of("temporal l2", Technique::Gpt, ReconstructionKind::L2, Some(false), false),
    Method::of("temporal l2, motion", Technique::Gpt, ReconstructionKind::L2, Some(true), false),
    Method::of("temporal weighted-l2, motion", Technique::Gpt, ReconstructionKind::WeightedL2, Some(true), false),
];

impl Method {
    const fn of(name: &'static str, technique: Technique, reconstruction: ReconstructionKind, temporal: Option<bool>, apart: bool) -> Self {
        Self { name, technique, reconstruction, temporal, apart }
    }
}

fn study(arguments: &[String]) -> Result<(), Fault> {
    let expected = "expected: scene, frames per second, frames, samples of pt, samples of the reference, size";
    let [file, fps, frames, samples, long, size] = arguments else { return Err(expected.into()) };
    let (fps, frames): (f64, u32) = (fps.parse()?, frames.parse()?);
    let (samples, long): (u32, u32) = (samples.parse()?, long.parse()?);
    let (width, height) = size.split_once('x').ok_or(expected)?;
    let extent = Extent { width: width.parse()?, height: height.parse()? };
    let loaded = load(Path::new(file))?;
    let scenes: Vec<Scene> = (0..frames)
        .map(|frame| Ok(Scene::compile(&loaded.description.at(f64::from(frame) / fps)?, &loaded.assets)?))
        .collect::<Result<_, Fault>>()?;
    let request = |method: &Method, samples: u32, seed: u64| Request {
        technique: Some(method.technique),
        reconstruction: Some(method.reconstruction),
        samples: Some(samples),
        extent: Some(extent),
        seed,
        frames,
        timeline: Some(Timeline { fps, ..Timeline::default() }),
        temporal: Some(method.temporal.is_some()),
        motion: method.temporal,
        ..Request::default()
    };
    let plan = |method: &Method, samples: u32, seed: u64| resolve(&loaded.description, &request(method, samples, seed));
    let references: Vec<Known> = scenes
        .iter()
        .zip(0u64..)
        .map(|(scene, frame)| reference(scene, &plan(&METHODS[1], long, 1000 + frame)?))
        .collect::<Result<_, Fault>>()?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "\n{file}: {frames} frames at {fps} a second, {width} × {height}\n")?;
    writeln!(out, "| method | samples | CPU s | relMSE | × pt | flicker | × pt |")?;
    writeln!(out, "|---|--:|--:|--:|--:|--:|--:|")?;
    let mut budget: Option<f64> = None;
    let mut first: Option<[f64; 2]> = None;
    for method in &METHODS {
        // A short run tells how many samples the budget holds.
        let samples = match budget {
            None => samples,
            Some(budget) => {
                let pilot = samples.div_ceil(8).next_multiple_of(4);
                let (_, seconds) = animate(&scenes, &plan(method, pilot, 5)?, method.apart)?;
                ((budget / seconds * f64::from(pilot) / 4.0).round() as u32).max(1) * 4
            }
        };
        let (images, seconds) = animate(&scenes, &plan(method, samples, 7)?, method.apart)?;
        let share = seconds / *budget.get_or_insert(seconds);
        // To the same time, by error × time = constant.
        let errors = [error(&images, &references) * share, flicker(&images, &references) * share];
        let first = *first.get_or_insert(errors);
        writeln!(
            out,
            "| {} | {samples} | {seconds:.2} | {:.3e} | {:.2} | {:.3e} | {:.2} |",
            method.name,
            errors[0],
            first[0] / errors[0],
            errors[1],
            first[1] / errors[1],
        )?;
        out.flush()?;
    }
    Ok(())
}

fn reference(scene: &Scene, plan: &Plan) -> Result<Known, Fault> {
    let film = whole(&scene.into(), plan, Moment::of(0))?;
    let direct = film.combined().direct;
    let lights = (0..direct.extent().pixels()).map(|i| (0..3).any(|c| direct.plane(c)[i] > 0.0)).collect();
    let done = reconstruct(&film, ReconstructionKind::L2, plan.alpha)?;
    let [a, b] = done.halves.ok_or("a reference needs two samples")?;
    let mut variance = a;
    variance.data_mut().iter_mut().zip(b.data()).for_each(|(a, b)| *a = 0.25 * (*a - b) * (*a - b));
    Ok(Known { image: done.image, variance, lights })
}

/// The images of all frames, and the processor seconds they took.
fn animate(scenes: &[Scene], plan: &Plan, apart: bool) -> Result<(Vec<Image>, f64), Fault> {
    let start = Effort::start();
    let images = match plan.temporal {
        None => {
            let one = |(scene, frame): (&Scene, u32)| {
                let plan = &Plan { seed: plan.seed + if apart { 1000 * u64::from(frame) } else { 0 }, ..plan.clone() };
                Ok::<_, Fault>(reconstruct(&whole(&scene.into(), plan, Moment::of(frame))?, plan.reconstruction, plan.alpha)?.image)
            };
            scenes.iter().zip(0..).map(one).collect::<Result<Vec<_>, _>>()?
        }
        Some(temporal) => {
            let mut moments = Vec::new();
            let mut noise = Noise::default();
            for (frame, scene) in (0u32..).zip(scenes) {
                let before = frame.checked_sub(1).map(|frame| &scenes[frame as usize]);
                let both = copies(&Instants { before, ..scene.into() }, plan, Moment::of(frame))?;
                moments.push(MomentFilm::new(&[&both[0], &both[1]])?);
                noise.add(both);
            }
            noise.tell();
            together(&moments, temporal, plan)?
        }
    };
    Ok((images, start.seconds()))
}

/// Squares that tell how noisy differences in time are.
#[derive(Default)]
struct Noise {
    before: Option<[Film; 2]>,
    of_differences: f64,
    of_halves: f64,
    partners: usize,
    pixels: usize,
}

impl Noise {
    /// Compares the copies of a moment and of the one before.
    fn add(&mut self, now: [Film; 2]) {
        if let Some(before) = &self.before {
            let extent = now[0].extent;
            let motion = now[0].motion.as_ref();
            for (x, y) in (0..extent.height).flat_map(|y| (0..extent.width).map(move |x| (x, y))) {
                self.pixels += 1;
                if motion.is_some_and(|motion| motion.at(x, y, 2) != 1.0) {
                    continue;
                }
                self.partners += 1;
                let by = |c: usize| motion.map_or(0, |motion| motion.at(x, y, c) as i64);
                let (px, py) = ((i64::from(x) + by(0)) as u32, (i64::from(y) + by(1)) as u32);
                for c in 0..3 {
                    let half_a = |copy: usize| f64::from(now[copy].halves[0].primal.at(x, y, c));
                    let half_b = |copy: usize| f64::from(before[copy].halves[1].primal.at(px, py, c));
                    let bright = (half_a(0) + half_a(1) + half_b(0) + half_b(1)).powi(2) / 16.0 + 1e-3;
                    let (a, b) = (half_a(0) - half_a(1), half_b(0) - half_b(1));
                    self.of_differences += (a - b) * (a - b) / bright;
                    self.of_halves += (a * a + b * b) / bright;
                }
            }
        }
        self.before = Some(now);
    }

    fn tell(&self) {
        let share = 100.0 * self.partners as f64 / self.pixels.max(1) as f64;
        eprintln!(
            "noise of differences in time, over that of independent ones: {:.3}; {share:.1} % of pixels have a partner",
            self.of_differences / self.of_halves
        );
    }
}

/// Solves window by window and blends.
fn together(moments: &[MomentFilm], temporal: Temporal, plan: &Plan) -> Result<Vec<Image>, Fault> {
    let windows = Windows::new(moments.len() as u32, temporal.window, temporal.stride);
    let mut shares: Vec<Vec<Share>> = moments.iter().map(|_| Vec::new()).collect();
    for k in 0..windows.len() {
        let range = windows.moments(k);
        let inside: Vec<&MomentFilm> = moments[range.start as usize..range.end as usize].iter().collect();
        for (moment, mut share) in range.zip(solve(&inside, plan.reconstruction, plan.alpha)?.moments) {
            share.scale(windows.weight(k, moment));
            shares[moment as usize].push(share);
        }
    }
    let image = |(shares, film): (Vec<Share>, &MomentFilm)| {
        let share = blend(shares)?.ok_or("a moment without a window")?;
        Ok::<_, Fault>(finish(share, film, plan.reconstruction, SolveReport::default())?.image)
    };
    shares.into_iter().zip(moments).map(image).collect()
}

/// relMSE, mean over frames, without what the references' own noise adds.
fn error(images: &[Image], references: &[Known]) -> f64 {
    let frames = images.iter().zip(references);
    let of = |(image, known): (&Image, &Known)| {
        relative([known, known], |k| {
            let off = f64::from(image.data()[k]) - f64::from(known.image.data()[k]);
            off * off - f64::from(known.variance.data()[k])
        })
    };
    frames.map(of).sum::<f64>() / images.len() as f64
}

/// The same of the differences from frame to frame.
fn flicker(images: &[Image], references: &[Known]) -> f64 {
    let pairs = images.windows(2).zip(references.windows(2));
    let of = |(image, known): (&[Image], &[Known])| {
        relative([&known[0], &known[1]], |k| {
            let step = |images: [&Image; 2]| f64::from(images[1].data()[k]) - f64::from(images[0].data()[k]);
            let off = step([&image[0], &image[1]]) - step([&known[0].image, &known[1].image]);
            off * off - f64::from(known[0].variance.data()[k]) - f64::from(known[1].variance.data()[k])
        })
    };
    pairs.map(of).sum::<f64>() / (images.len() - 1).max(1) as f64
}

/// Mean over channels and the pixels that see no light in either frame, over the squared brightness of both frames.
fn relative(of: [&Known; 2], value: impl Fn(usize) -> f64) -> f64 {
    let pixels = of[0].image.extent().pixels();
    let seen: Vec<usize> = (0..pixels).filter(|i| of.iter().all(|known| !known.lights[*i])).collect();
    let bright = |known: &Known, i: usize| ((0..3).map(|c| f64::from(known.image.plane(c)[i])).sum::<f64>() / 3.0).powi(2);
    let at = |i: &usize| {
        let scale = 0.5 * (bright(of[0], *i) + bright(of[1], *i)) + 1e-3;
        (0..3).map(|c| value(c * pixels + i)).sum::<f64>() / (3.0 * scale)
    };
    seen.iter().map(at).sum::<f64>() / seen.len().max(1) as f64
}
