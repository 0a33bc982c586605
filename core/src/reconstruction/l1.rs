//! Screened Poisson in the L1 norm: argmin Σ ‖∇I − G‖ + Σ ‖α(I − P)‖, by iteratively reweighted least squares.
//!
//! The norm of a residual is taken over its three channels, so that all are weighted alike. Robust to the outliers that failed
//! shifts leave; not linear, so biased, and it loses the energy of isolated spikes.
//!
//! # Source
//! Lehtinen et al., "Gradient-Domain Metropolis Light Transport", ACM TOG 32(4), 2013; weights 1 / (‖r‖ + ε) with falling ε as in
//! Kettunen et al. 2015, here relative to the image's mean so that the exposure of a scene does not matter.

use super::field::{Field, Row};
use super::l2::L2;
use super::multigrid::{Cycle, Hierarchy};
use super::solver::{ConjugateGradients, Precondition};
use super::stencil::Stencil;
use super::{Measurements, Reconstruct, ReconstructError, SolveReport};
use crate::film::Image;
use rayon::prelude::*;

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
const EFFORT: Effort = Effort { reweightings: 24, iterations: 2, settled: 5e-4, multigrid: true };
/// First ε over the mean of the primal's magnitude; it halves with each reweighting.
const FIRST_EPSILON: f64 = 0.05;
/// Where ε stops falling: beyond, weights only differ by rounding.
const LAST_EPSILON: f64 = 1e-6;

impl Reconstruct for L1 {
    fn joins_halves(&self) -> bool {
        false
    }

    fn is_unbiased(&self) -> bool {
        false
    }

    fn solve(&self, own: &Measurements, _other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        minimise(own, alpha, &EFFORT, |_| {})
    }
}

/// Minimises from the L2 solution on; `watch` sees the objective before each reweighting and after the last.
pub(super) fn minimise(
    m: &Measurements,
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
    let (mut stencil, mut b) = (Stencil::new(w, h), Field::new(w, h));
    let (mut hierarchy, mut gradients) = (effort.multigrid.then(|| Hierarchy::new(w, h)), ConjugateGradients::new(w, h));
    let mut before = f64::INFINITY;
    let mut epsilon = scale * FIRST_EPSILON;
    for k in 0..=effort.reweightings {
        let objective = reweight(m, &x, alpha, epsilon as f32, &mut stencil);
        watch(objective);
        if !objective.is_finite() {
            return Err(ReconstructError::Diverged { iterations: report.iterations, residual: report.residual });
        }
        if k == effort.reweightings || objective == 0.0 || before.is_finite() && before - objective <= effort.settled * before {
            break;
        }
        before = objective;
        right_hand_side(m, &stencil, &mut b);
        if let Some(hierarchy) = &mut hierarchy {
            hierarchy.adapt(&stencil);
        }
        let mut cycle = hierarchy.as_mut().map(|hierarchy| Cycle { stencil: &stencil, hierarchy });
        let cycle = cycle.as_mut().map(|cycle| cycle as &mut dyn Precondition);
        let solved = gradients.solve(&stencil, cycle, &b, &mut x, TOLERANCE, effort.iterations);
        report.iterations += solved.iterations;
        report.residual = solved.residual;
        epsilon = (0.5 * epsilon).max(scale * LAST_EPSILON);
    }
    x.copy_to(&mut image);
    Ok((image, report))
}

/// Relative residual at which a linear system counts as solved exactly: the rounding of f32.
const TOLERANCE: f64 = 1e-7;

/// The norms over channels of the residuals of one row of pixels: of the primal, and of the differences to the right and down.
struct Residuals {
    primal: Vec<f32>,
    dx: Vec<f32>,
    dy: Vec<f32>,
}

impl Residuals {
    fn of_row<'m>(m: &Measurements<'m>, image: &Field, alpha: f32, y: usize) -> Self {
        let (w, h) = (image.width, image.height);
        let mut out = Self { primal: vec![0.0; w], dx: vec![0.0; w], dy: vec![0.0; w] };
        for c in 0..3 {
            let line = |image: &'m Image| &image.plane(c)[y * w..(y + 1) * w];
            let (here, p, dx) = (image.row(y, c), line(m.primal), line(m.dx));
            for i in 0..w {
                let r = alpha * (here[i] - p[i]);
                out.primal[i] += r * r;
            }
            for i in 0..w - 1 {
                let r = here[i + 1] - here[i] - dx[i];
                out.dx[i] += r * r;
            }
            if y + 1 < h {
                let (down, dy) = (image.row(y + 1, c), line(m.dy));
                for i in 0..w {
                    let r = down[i] - here[i] - dy[i];
                    out.dy[i] += r * r;
                }
            }
        }
        for row in [&mut out.primal, &mut out.dx, &mut out.dy] {
            row.iter_mut().for_each(|v| *v = v.sqrt());
        }
        out
    }

    fn sum(&self) -> f64 {
        [&self.primal, &self.dx, &self.dy].into_iter().map(|row| row.iter().map(|v| f64::from(*v)).sum::<f64>()).sum()
    }
}

/// The sum that is minimised.
#[cfg(test)]
pub(super) fn objective(m: &Measurements, image: &Image, alpha: f32) -> f64 {
    let x = Field::from_image(image);
    (0..x.height).map(|y| Residuals::of_row(m, &x, alpha, y).sum()).sum()
}

/// Weights 1 / (‖r‖ + ε) of all rows at the present image, scaled by ε so that they stay within (0, 1]. Returns the sum that is minimised.
fn reweight(m: &Measurements, image: &Field, alpha: f32, epsilon: f32, stencil: &mut Stencil) -> f64 {
    let w = stencil.width;
    let (h, screen, wx, wy) = (stencil.height, &mut stencil.screen, &mut stencil.wx, &mut stencil.wy[w..]);
    let weight = |r: f32| epsilon / (r + epsilon);
    type Rows<'a> = ((&'a mut [f32], &'a mut [f32]), &'a mut [f32]);
    let row = |(y, ((screen, wx), wy)): (usize, Rows)| {
        let r = Residuals::of_row(m, image, alpha, y);
        for i in 0..w {
            screen[i] = alpha * alpha * weight(r.primal[i]);
            wx[i] = if i + 1 < w { weight(r.dx[i]) } else { 0.0 };
            wy[i] = if y + 1 < h { weight(r.dy[i]) } else { 0.0 };
        }
        r.sum()
    };
    let sums: Vec<f64> = screen.par_chunks_mut(w).zip(wx.par_chunks_mut(w)).zip(wy.par_chunks_mut(w)).enumerate().map(row).collect();
    sums.iter().sum()
}

/// Weighted α²P + ∇ᵀG.
fn right_hand_side(m: &Measurements, stencil: &Stencil, b: &mut Field) {
    let (w, h) = (stencil.width, stencil.height);
    b.each_row(|Row { y, channel, values }| {
        let line = |image: &Image, y: usize, i: usize| image.plane(channel)[y * w + i];
        let (screen, wx) = (stencil.line(&stencil.screen, y), stencil.line(&stencil.wx, y));
        let (above, below) = (stencil.line(&stencil.wy, y), stencil.line(&stencil.wy, y + 1));
        for i in 0..w {
            let mut v = screen[i] * line(m.primal, y, i) - wx[i] * line(m.dx, y, i);
            if i > 0 {
                v += wx[i - 1] * line(m.dx, y, i - 1);
            }
            if y > 0 {
                v += above[i] * line(m.dy, y - 1, i);
            }
            if y + 1 < h {
                v -= below[i] * line(m.dy, y, i);
            }
            values[i] = v;
        }
    });
}

fn mean_magnitude(image: &Image) -> f64 {
    image.data().iter().map(|v| f64::from(v.abs())).sum::<f64>() / image.data().len().max(1) as f64
}
