//! Screened Poisson in the L1 norm: argmin Σ ‖∇I − G‖ + Σ ‖α(I − P)‖, by iteratively reweighted least squares.
//!
//! The norm of a residual is taken over its three channels, so that all are weighted alike. Robust to the outliers that failed
//! shifts leave; not linear, so biased, and it loses the energy of isolated spikes.
//!
//! # Source
//! Lehtinen et al., "Gradient-Domain Metropolis Light Transport", ACM TOG 32(4), 2013; weights 1 / (‖r‖ + ε) with falling ε as in
//! Kettunen et al. 2015, here relative to the image's mean so that the exposure of a scene does not matter.

use super::field::Field;
use super::l2::L2;
use super::multigrid::{Cycle, Hierarchy};
use super::normal::{Errors, Weights, weigh};
use super::solver::{ConjugateGradients, Precondition, Squares};
use super::stencil::Stencil;
use super::{Measurements, Reconstruct, ReconstructError, SolveReport, noise};
use crate::film::Image;

/// Reweighted least squares.
pub(super) struct L1;

/// How far the minimisation goes.
pub(super) struct Effort {
    /// Reweightings at most.
    pub(super) reweightings: u32,
    /// Linear iterations of each. A few are enough, because the next ones start where they end: each lowers the objective, and so
    /// more reweightings of two iterations get further in the same time than fewer of many.
    pub(super) iterations: u32,
    /// The objective's relative fall in one reweighting below which it stops.
    pub(super) settled: f64,
    /// Whether the linear iterations are preconditioned.
    pub(super) multigrid: bool,
}

/// Ends within about half a percent of the least objective on noisy frames. To go further costs several times as much and brings the
/// image no nearer to the truth.
pub(super) const EFFORT: Effort = Effort { reweightings: 24, iterations: 2, settled: 5e-4, multigrid: true };
/// First ε over the mean of the primal's magnitude; it halves with each reweighting.
pub(super) const FIRST_EPSILON: f64 = 0.05;
/// Where ε stops falling: beyond, weights only differ by rounding.
pub(super) const LAST_EPSILON: f64 = 1e-6;

impl Reconstruct for L1 {
    fn joins_halves(&self) -> bool {
        false
    }

    fn is_unbiased(&self) -> bool {
        false
    }

    /// Noise does not decide it: the rule for squares is none for norms, and this one was within a few percent of the best on noisy films.
    fn alpha(&self, _source: &Measurements) -> f32 {
        noise::TYPICAL
    }

    fn solve(&self, own: &Measurements, _other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        minimise(own, &Alike { alpha }, alpha, &EFFORT, |_| {})
    }
}

/// What errors are multiplied by before their norms are taken.
pub(super) enum Share<'a> {
    /// All by the same.
    Alike(f32),
    /// Those of a row, pixel by pixel.
    Each(&'a [f32]),
}

/// What each error counts for.
pub(super) trait Shares: Sync {
    /// In row y: of differences to the next column and to the next row, and of the primal.
    fn row(&self, y: usize) -> [Share<'_>; 3];
}

/// Differences count 1, the primal α.
pub(super) struct Alike {
    pub(super) alpha: f32,
}

impl Shares for Alike {
    fn row(&self, _y: usize) -> [Share<'_>; 3] {
        [Share::Alike(1.0), Share::Alike(1.0), Share::Alike(self.alpha)]
    }
}

/// Minimises from the L2 solution of weight `alpha` on; `watch` sees the objective before each reweighting and after the last.
pub(super) fn minimise(
    m: &Measurements,
    shares: &impl Shares,
    alpha: f32,
    effort: &Effort,
    mut watch: impl FnMut(f64),
) -> Result<(Image, SolveReport), ReconstructError> {
    let (mut image, _) = L2.solve(m, None, alpha)?;
    let mut report = SolveReport::default();
    let scale = mean_magnitude(m.primal);
    if scale == 0.0 {
        return Ok((image, report));
    }
    let (w, h) = (m.extent.width as usize, m.extent.height as usize);
    let mut x = Field::from_image(&image);
    let (mut stencil, mut gradients) = (Stencil::new(w, h), ConjugateGradients::new(w, h));
    let mut hierarchy = effort.multigrid.then(|| Hierarchy::new(w, h));
    let mut before = f64::INFINITY;
    let mut epsilon = scale * FIRST_EPSILON;
    for k in 0..=effort.reweightings {
        let weights = Reweight { epsilon: epsilon as f32 };
        let row = |y: usize, errors: &Errors, row: Weights| weights.row(&shares.row(y), errors, row);
        let (objective, squared) = weigh(m, &x, &mut stencil, gradients.residual(), row);
        watch(objective);
        if !objective.is_finite() {
            return Err(ReconstructError::Diverged { iterations: report.iterations, residual: report.residual });
        }
        if k == effort.reweightings || objective == 0.0 || before.is_finite() && before - objective <= effort.settled * before {
            x.copy_to(&mut image);
            drop(hierarchy);
            report.residual = Squares { b: right_hand_side(m, &stencil, &mut x, gradients.residual()), residual: squared }.relative();
            break;
        }
        before = objective;
        if let Some(hierarchy) = &mut hierarchy {
            hierarchy.adapt(&stencil);
        }
        let mut cycle = hierarchy.as_mut().map(|hierarchy| Cycle { stencil: &stencil, hierarchy });
        let cycle = cycle.as_mut().map(|cycle| cycle as &mut dyn Precondition);
        // What it starts from stands for the right-hand side: to solve to a part of that is all that a step can use.
        let squares = Squares { b: squared, residual: squared };
        report.iterations += gradients.improve(&stencil, cycle, &mut x, squares, TOLERANCE, effort.iterations).iterations;
        epsilon = (0.5 * epsilon).max(scale * LAST_EPSILON);
    }
    Ok((image, report))
}

/// Part of the first residual at which a linear system counts as solved exactly: the rounding of f32.
pub(super) const TOLERANCE: f64 = 1e-6;

/// How errors are weighted: 1 / (‖e‖ + ε), scaled by ε so that weights stay within (0, 1] where errors count no more than they are.
struct Reweight {
    epsilon: f32,
}

impl Reweight {
    /// Weights of one row; returns the sum of its norms.
    fn row(&self, shares: &[Share; 3], errors: &Errors, row: Weights) -> f64 {
        let [dx, dy, primal] = shares;
        let edges = self.errors(&errors.dx, row.wx, dx) + self.errors(&errors.dy, row.wy, dy);
        edges + self.errors(&errors.primal, row.screen, primal)
    }

    /// The weights of one kind of errors.
    fn errors(&self, errors: &[Vec<f32>; 3], weights: &mut [f32], share: &Share) -> f64 {
        norms(errors, weights);
        let epsilon = self.epsilon;
        match share {
            Share::Alike(scale) => {
                let sum = weights.iter().map(|norm| f64::from(scale * norm)).sum();
                let factor = scale * scale;
                weights.iter_mut().for_each(|v| *v = factor * (epsilon / (scale * *v + epsilon)));
                sum
            }
            Share::Each(scales) => {
                let sum = weights.iter().zip(*scales).map(|(norm, scale)| f64::from(scale * norm)).sum();
                weights.iter_mut().zip(*scales).for_each(|(v, scale)| *v = scale * scale * (epsilon / (scale * *v + epsilon)));
                sum
            }
        }
    }
}

/// Lengths over the channels.
pub(super) fn norms([r, g, b]: &[Vec<f32>; 3], out: &mut [f32]) {
    for (out, (r, (g, b))) in out.iter_mut().zip(r.iter().zip(g.iter().zip(b))) {
        *out = (r * r + g * g + b * b).sqrt();
    }
}

/// The sum that is minimised.
#[cfg(test)]
pub(super) fn objective(m: &Measurements, image: &Image, alpha: f32) -> f64 {
    told(m, image, &Alike { alpha })
}

#[cfg(test)]
pub(super) fn told(m: &Measurements, image: &Image, shares: &impl Shares) -> f64 {
    let x = Field::from_image(image);
    let (mut stencil, mut residual) = (Stencil::new(x.width, x.height), Field::new(x.width, x.height));
    weigh(m, &x, &mut stencil, &mut residual, |y, errors, row| Reweight { epsilon: 1.0 }.row(&shares.row(y), errors, row)).0
}

/// Squared norm of the right-hand side by channel: of the residual of a black image, which `black` becomes. `b` is scratch.
fn right_hand_side(m: &Measurements, stencil: &Stencil, black: &mut Field, b: &mut Field) -> [f64; 3] {
    black.each_row(|row| row.values.fill(0.0));
    let mut same = stencil.clone();
    let copy = |y: usize, _: &Errors, row: Weights| {
        row.screen.copy_from_slice(stencil.line(&stencil.screen, y));
        row.wx.copy_from_slice(stencil.line(&stencil.wx, y));
        row.wy.copy_from_slice(stencil.line(&stencil.wy, y + 1));
        0.0
    };
    weigh(m, black, &mut same, b, copy).1
}

pub(super) fn mean_magnitude(image: &Image) -> f64 {
    image.data().iter().map(|v| f64::from(v.abs())).sum::<f64>() / image.data().len().max(1) as f64
}
