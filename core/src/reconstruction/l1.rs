//! Screened Poisson in the L1 norm: argmin Σ ‖∇I − G‖ + Σ ‖α(I − P)‖, by iteratively reweighted least squares.
//!
//! The norm of a residual is taken over its three channels, so that all are weighted alike. Robust to the outliers that failed
//! shifts leave; not linear, so biased, and it loses the energy of isolated spikes.
//!
//! # Source
//! Lehtinen et al., "Gradient-Domain Metropolis Light Transport", ACM TOG 32(4), 2013; weights 1 / (‖r‖ + ε) with falling ε as in
//! Kettunen et al. 2015, here relative to the image's mean so that the exposure of a scene does not matter.

use super::l2::L2;
use super::multigrid::Hierarchy;
use super::solver::{Stencil, conjugate_gradients};
use super::{Measurements, Reconstruct, ReconstructError, SolveReport};
use crate::film::Image;
use rayon::prelude::*;

/// Reweighted least squares.
pub(super) struct L1;

/// Reweightings at most.
const REWEIGHTINGS: u32 = 20;
/// First ε over the mean of the primal's magnitude; it halves with each reweighting.
const FIRST_EPSILON: f64 = 0.05;
/// Relative residual demanded of each linear system.
const TOLERANCE: f64 = 1e-4;
/// The objective's relative fall below which reweighting stops.
const SETTLED: f64 = 1e-4;
const MOST_ITERATIONS: u32 = 200;

impl Reconstruct for L1 {
    fn is_linear(&self) -> bool {
        false
    }

    fn solve(&self, m: &Measurements, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        let (mut image, _) = L2.solve(m, alpha)?;
        let scale = mean_magnitude(m.primal);
        let mut report = SolveReport::default();
        if scale == 0.0 {
            return Ok((image, report));
        }
        let mut before = objective(m, &image, alpha);
        for k in 0..REWEIGHTINGS {
            let epsilon = (scale * FIRST_EPSILON / f64::from(1u32 << k)) as f32;
            let stencil = reweight(m, &image, alpha, epsilon);
            let results: Vec<(Vec<f32>, u32, f64)> = (0..3usize)
                .into_par_iter()
                .map(|c| {
                    let b = right_hand_side(m, c, &stencil);
                    let mut x = image.plane(c).to_vec();
                    let (iterations, residual) =
                        conjugate_gradients(&stencil, &mut Hierarchy::new(&stencil), &b, &mut x, TOLERANCE, MOST_ITERATIONS);
                    (x, iterations, residual)
                })
                .collect();
            report.residual = 0.0;
            for (c, (x, iterations, residual)) in results.into_iter().enumerate() {
                image.plane_mut(c).copy_from_slice(&x);
                report.iterations += iterations;
                report.residual = report.residual.max(residual);
            }
            if report.residual > 10.0 * TOLERANCE {
                return Err(ReconstructError::Diverged { iterations: report.iterations, residual: report.residual, tolerance: TOLERANCE });
            }
            let after = objective(m, &image, alpha);
            if before - after <= SETTLED * before {
                break;
            }
            before = after;
        }
        Ok((image, report))
    }
}

/// The residuals of a pixel: of the primal, and of the differences to the right and down, each by channel.
struct Residuals {
    primal: [f32; 3],
    dx: [f32; 3],
    dy: [f32; 3],
}

#[inline]
fn residuals(m: &Measurements, image: &Image, alpha: f32, x: usize, y: usize) -> Residuals {
    let (w, h) = (m.extent.width as usize, m.extent.height as usize);
    let i = y * w + x;
    let by_channel = |f: &dyn Fn(usize) -> f32| [f(0), f(1), f(2)];
    Residuals {
        primal: by_channel(&|c| alpha * (image.plane(c)[i] - m.primal.plane(c)[i])),
        dx: if x + 1 < w { by_channel(&|c| image.plane(c)[i + 1] - image.plane(c)[i] - m.dx.plane(c)[i]) } else { [0.0; 3] },
        dy: if y + 1 < h { by_channel(&|c| image.plane(c)[i + w] - image.plane(c)[i] - m.dy.plane(c)[i]) } else { [0.0; 3] },
    }
}

#[inline]
fn norm(r: [f32; 3]) -> f32 {
    (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt()
}

fn pixels(m: &Measurements) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (w, h) = (m.extent.width as usize, m.extent.height as usize);
    (0..h).flat_map(move |y| (0..w).map(move |x| (x, y)))
}

/// The sum that is minimised.
pub(super) fn objective(m: &Measurements, image: &Image, alpha: f32) -> f64 {
    pixels(m)
        .map(|(x, y)| {
            let r = residuals(m, image, alpha, x, y);
            f64::from(norm(r.primal)) + f64::from(norm(r.dx)) + f64::from(norm(r.dy))
        })
        .sum()
}

/// Weights 1 / (‖r‖ + ε) of all rows at the present image, scaled by ε so that they stay within (0, 1].
fn reweight(m: &Measurements, image: &Image, alpha: f32, epsilon: f32) -> Stencil {
    let (w, h) = (m.extent.width as usize, m.extent.height as usize);
    let mut stencil = Stencil { width: w, height: h, screen: vec![0.0; w * h], wx: vec![0.0; w * h], wy: vec![0.0; w * h] };
    let weight = |r| epsilon / (norm(r) + epsilon);
    for (x, y) in pixels(m) {
        let i = y * w + x;
        let r = residuals(m, image, alpha, x, y);
        stencil.screen[i] = alpha * alpha * weight(r.primal);
        if x + 1 < w {
            stencil.wx[i] = weight(r.dx);
        }
        if y + 1 < h {
            stencil.wy[i] = weight(r.dy);
        }
    }
    stencil
}

/// Weighted α²P + ∇ᵀG.
fn right_hand_side(m: &Measurements, channel: usize, stencil: &Stencil) -> Vec<f32> {
    let (w, h) = (stencil.width, stencil.height);
    let (p, dx, dy) = (m.primal.plane(channel), m.dx.plane(channel), m.dy.plane(channel));
    let mut b: Vec<f32> = p.iter().zip(&stencil.screen).map(|(p, s)| p * s).collect();
    for (x, y) in pixels(m) {
        let i = y * w + x;
        if x + 1 < w {
            let flow = stencil.wx[i] * dx[i];
            b[i] -= flow;
            b[i + 1] += flow;
        }
        if y + 1 < h {
            let flow = stencil.wy[i] * dy[i];
            b[i] -= flow;
            b[i + w] += flow;
        }
    }
    b
}

fn mean_magnitude(image: &Image) -> f64 {
    image.data().iter().map(|v| f64::from(v.abs())).sum::<f64>() / image.data().len().max(1) as f64
}
