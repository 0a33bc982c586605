//! Frames that grow until their estimated error says that they are good enough, from the core alone.

use gradfarm_core::accuracy::{Estimate, Point, Reason, Verdict, first_check, verdict};
use gradfarm_core::film::{FoldError, FrameFold, TileFold};
use gradfarm_core::lattice::Tile;
use gradfarm_core::metrics::rel_mse;
use gradfarm_core::plan::{Guide, Plan};
use gradfarm_core::reconstruction::{ReconstructError, Reconstructed, reconstruct};
use gradfarm_core::scene::Scene;
use rayon::prelude::*;

use crate::frame;

/// Edge of the tiles [pixels].
const TILE: u32 = 8;

/// Why a frame could not grow, which would be a fault of the core.
#[derive(Debug)]
pub enum Fault {
    /// Blocks do not fold.
    Fold(FoldError),
    /// The film cannot be reconstructed.
    Reconstruct(ReconstructError),
}

/// A frame that is rendered bit by bit.
#[derive(Debug)]
pub struct Growing<'a> {
    scene: &'a Scene,
    plan: &'a Plan,
    tiles: Vec<Tile>,
    /// All samples of each tile, and the even ones alone, which steer.
    folds: Vec<[TileFold; 2]>,
    guides: Vec<Guide>,
    samples: u32,
}

/// A frame that has stopped.
#[derive(Debug)]
pub struct Stopped {
    /// Its image and its error as it was told.
    pub done: Reconstructed,
    /// What was measured on the way, without times.
    pub points: Vec<Point>,
    /// Why it stopped.
    pub reason: Reason,
}

impl<'a> Growing<'a> {
    /// A frame without samples. The plan has one round, or a rule that makes its rounds double.
    pub fn new(scene: &'a Scene, plan: &'a Plan) -> Self {
        let (tiles, layout) = (plan.extent.tiles(TILE), plan.layout());
        let folds = tiles.iter().map(|tile| [(); 2].map(|()| TileFold::new(*tile, &layout))).collect();
        Self { scene, plan, tiles, folds, guides: Vec::new(), samples: 0 }
    }

    /// Renders the passes up to so many samples per pixel, and reconstructs what is there.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn grow(&mut self, samples: u32) -> Result<Reconstructed, Fault> {
        let passes = self.plan.passes();
        for pass in passes.iter().filter(|pass| pass.samples.first >= self.samples && pass.samples.end() <= samples) {
            let round = self.guides.len() as u32 + 1;
            if round < self.plan.rounds && pass.samples.first == self.plan.steered_until(round) {
                let noise = self.frame(1)?.noise().map_err(Fault::Fold)?;
                self.guides.push(Guide::new(self.plan, 0, round, &noise, &self.guides));
            }
            let render = |([all, even], tile): (&mut [TileFold; 2], &Tile)| {
                let block = frame::block(self.scene, self.plan, *tile, pass, &self.guides);
                if pass.slice.is_none() {
                    even.add(&block)?
                } else {
                    even.skip(pass.samples)
                }
                all.add(&block)
            };
            self.folds.par_iter_mut().zip(&self.tiles).try_for_each(render).map_err(Fault::Fold)?;
        }
        self.samples = samples;
        let film = self.frame(0)?.finish().map_err(Fault::Fold)?;
        reconstruct(&film, self.plan.reconstruction, self.plan.alpha).map_err(Fault::Reconstruct)
    }

    /// The whole frame as it is, of all samples or of those that steer.
    fn frame(&self, which: usize) -> Result<FrameFold, Fault> {
        let mut frame = FrameFold::new(self.plan.extent, &self.plan.layout());
        self.folds.iter().try_for_each(|folds| frame.place(&folds[which])).map_err(Fault::Fold)?;
        Ok(frame)
    }
}

/// Renders frame 0 of a plan until it stops, as the farm would; time plays no part.
///
/// # Errors
/// [`Fault`].
pub fn run(scene: &Scene, plan: &Plan) -> Result<Stopped, Fault> {
    let mut frame = Growing::new(scene, plan);
    let mut points = Vec::new();
    let mut samples = first_check(plan.samples, plan.batch);
    loop {
        let done = frame.grow(samples)?;
        let error = done.error.as_ref().map_or(Estimate { relmse: 0.0, low: 0.0, high: 0.0 }, |error| {
            let [low, high] = error.interval.unwrap_or([0.0, f64::INFINITY]);
            Estimate { relmse: error.relmse, low, high }
        });
        points.push(Point { samples, cpu_seconds: 0.0, wall_seconds: 0.0, check_seconds: 0.0, error });
        match verdict(&plan.stop, plan.samples, plan.batch, &points) {
            Verdict::Stop(reason) => return Ok(Stopped { done, points, reason }),
            Verdict::Continue { samples: next } => samples = next,
        }
    }
}

/// How one frame ended, and how good it truly is.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Samples per pixel.
    pub samples: u32,
    /// What was told at the end.
    pub told: Estimate,
    /// relMSE against the mean of the other frames' images: too large by their own error, a share of about one over their number.
    pub found: f64,
}

/// Runs the same frame with so many seeds, from `first` on, until each stops; compares each image with the others. At least three.
///
/// # Errors
/// [`Fault`].
pub fn outcomes(scene: &Scene, plan: &Plan, first: u64, seeds: u64) -> Result<Vec<Outcome>, Fault> {
    let frames: Vec<Stopped> =
        (first..first + seeds).map(|seed| run(scene, &Plan { seed, ..plan.clone() })).collect::<Result<_, Fault>>()?;
    let samples = |frame: &Stopped| frame.points.last().map_or(0, |point| point.samples);
    let mut outcomes = Vec::with_capacity(frames.len());
    for (own, frame) in frames.iter().enumerate() {
        let others = || frames.iter().enumerate().filter(|(other, _)| *other != own).map(|(_, other)| other);
        let all: f64 = others().map(|other| f64::from(samples(other))).sum();
        let mut reference = frame.done.image.clone();
        for (i, value) in reference.data_mut().iter_mut().enumerate() {
            let mean: f64 = others().map(|other| f64::from(samples(other)) / all * f64::from(other.done.image.data()[i])).sum();
            *value = mean as f32;
        }
        let found = rel_mse(&frame.done.image, &reference).unwrap_or(f64::INFINITY);
        let told = frame.points.last().map_or(Estimate { relmse: 0.0, low: 0.0, high: 0.0 }, |point| point.error);
        outcomes.push(Outcome { samples: samples(frame), told, found });
    }
    Ok(outcomes)
}
