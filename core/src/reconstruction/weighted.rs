//! Screened Poisson with inverse variances as weights: the least squares that noise calls for, where it differs from place to place and
//! from direction to direction.
//!
//! Each measurement counts for one over its variance. The variances are estimated from the *other* half's samples, so that weights are
//! independent of what they weigh and the image stays unbiased; and they are smoothed over pixels, because a variance of few samples is
//! itself very noisy and is too small wherever the rare bright path is still missing.
//!
//! # Source
//! Weights by variances: Rousselle et al., "Image-space Control Variates for Rendering", ACM TOG 35(6), 2016, section 5; cross weighting of halves there as well.

use super::field::Field;
use super::multigrid::{Cycle, Hierarchy};
use super::normal::{Weights, weigh};
use super::solver::{ConjugateGradients, Squares};
use super::stencil::Stencil;
use super::variances::Variances;
use super::{Measurements, Reconstruct, ReconstructError, ReconstructionKind, SolveReport, noise};
use crate::film::Image;

/// Least squares by inverse variances.
pub(super) struct WeightedL2;

/// Relative residual ‖b − Ax‖ / ‖b‖ at which the image is good enough: far below noise.
const TOLERANCE: f64 = 1e-5;
/// Iterations at most.
const MOST: u32 = 200;

impl Reconstruct for WeightedL2 {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        true
    }

    /// Measurements weighted by what they are worth need no further weight. Where nothing tells what that is, all count alike but for it.
    fn alpha(&self, source: &Measurements) -> f32 {
        let varies = |image: &Image| image.data().iter().any(|v| *v > 0.0);
        let known = source.variance.is_some_and(|v| varies(v.primal) || varies(v.dx) || varies(v.dy));
        if known { 1.0 } else { noise::TYPICAL }
    }

    fn solve(&self, own: &Measurements, other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        let mut image = own.primal.clone();
        let (w, h) = (own.extent.width as usize, own.extent.height as usize);
        if w * h == 0 {
            return Ok((image, SolveReport::default()));
        }
        let source = other.unwrap_or(own);
        let variance = source.variance.ok_or(ReconstructError::NoVariances { wanted: ReconstructionKind::WeightedL2.name() })?;
        let variances = Variances::new(&variance);
        let set = |y: usize, row: Weights| {
            variances.weigh(y, alpha, row);
            0.0
        };
        let (mut stencil, mut gradients) = (Stencil::new(w, h), ConjugateGradients::new(w, h));
        // The residual of a black image is the right-hand side.
        let black = Field::new(w, h);
        let (_, b) = weigh(own, &black, &mut stencil, gradients.residual(), |y, _, row| set(y, row));
        let mut x = black;
        x.copy_from(&image);
        let (_, residual) = weigh(own, &x, &mut stencil, gradients.residual(), |y, _, row| set(y, row));
        drop(variances);
        let mut hierarchy = Hierarchy::new(w, h);
        hierarchy.adapt(&stencil);
        let mut cycle = Cycle { stencil: &stencil, hierarchy: &mut hierarchy };
        let solved = gradients.improve(&stencil, Some(&mut cycle), &mut x, Squares { b, residual }, TOLERANCE, MOST);
        if !solved.residual.is_finite() {
            return Err(ReconstructError::Diverged { iterations: solved.iterations, residual: solved.residual });
        }
        x.copy_to(&mut image);
        Ok((image, SolveReport { iterations: solved.iterations, residual: solved.residual, alpha }))
    }
}

#[cfg(test)]
pub(super) mod tests;
