//! Least squares over the links between similar pixels: argmin Σ ‖Iⱼ − Iᵢ − Gᵢⱼ‖² + α² Σ ‖Iᵢ − Pᵢ‖².
//!
//! Solved by conjugate gradients, preconditioned by the diagonal. The image is linear in the measurements, so it is unbiased where they are. Pixels that links join keep the mean of their primal: a constant is in
//! the null space of the differences, and what the iteration leaves of that is put right at the end.
//!
//! # Source
//! Manzi, Rousselle, Kettunen, Lehtinen and Zwicker, "Improved Sampling for Gradient-Domain Metropolis Light Transport", ACM TOG 33(6), 2014.

use super::field::Field;
use super::solver::ConjugateGradients;
use super::sparse::Sparse;
use super::{Measurements, Reconstruct, ReconstructError, ReconstructionKind, SolveReport};
use crate::film::{Graph, Image};

#[cfg(test)]
mod tests;

/// Least squares over links.
pub(super) struct LeastSquares;

/// Relative residual ‖b − Ax‖ / ‖b‖ at which the image is good enough: far below noise.
const TOLERANCE: f64 = 1e-5;
/// Iterations at most.
const MOST: u32 = 1000;

impl Reconstruct for LeastSquares {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        true
    }

    fn solve(&self, own: &Measurements, _other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        let graph = own.graph.ok_or(ReconstructError::NoLinks { wanted: ReconstructionKind::Graph.name() })?;
        if let Some(index) = graph.differences.iter().flatten().position(|v| !v.is_finite()) {
            return Err(ReconstructError::NotFinite { plane: "differences along links", index });
        }
        weighted(own, graph, &vec![1.0; graph.links.len()], alpha)
    }
}

/// The same with a weight ≥ 0 for each link.
pub(super) fn weighted(
    measurements: &Measurements,
    graph: &Graph,
    weights: &[f32],
    alpha: f32,
) -> Result<(Image, SolveReport), ReconstructError> {
    let mut image = measurements.primal.clone();
    let (width, height) = (measurements.extent.width as usize, measurements.extent.height as usize);
    if width * height == 0 {
        return Ok((image, SolveReport::default()));
    }
    let operator = Sparse::new(width, height, alpha * alpha, &graph.links, weights);
    let b = Field::from_image(&right_hand_side(measurements.primal, graph, weights, alpha));
    let mut x = Field::from_image(measurements.primal);
    let solved = ConjugateGradients::new(width, height).solve(&operator, Some(&mut operator.diagonal()), &b, &mut x, TOLERANCE, MOST);
    if !solved.residual.is_finite() {
        return Err(ReconstructError::Diverged { iterations: solved.iterations, residual: solved.residual });
    }
    x.copy_to(&mut image);
    keep_means(measurements.primal, &graph.links, weights, &mut image);
    Ok((image, SolveReport { iterations: solved.iterations, residual: solved.residual, alpha }))
}

/// α² P + Σ of the differences, weighted.
fn right_hand_side(primal: &Image, graph: &Graph, weights: &[f32], alpha: f32) -> Image {
    let mut image = primal.clone();
    for c in 0..3 {
        let plane = image.plane_mut(c);
        plane.iter_mut().for_each(|v| *v *= alpha * alpha);
        for (([i, j], difference), weight) in graph.links.iter().zip(&graph.differences).zip(weights) {
            plane[*i as usize] -= weight * difference[c];
            plane[*j as usize] += weight * difference[c];
        }
    }
    image
}

/// Gives each set of pixels that links join the mean that it has in the primal.
fn keep_means(primal: &Image, links: &[[u32; 2]], weights: &[f32], image: &mut Image) {
    let roots = roots(primal.extent().pixels(), links.iter().zip(weights).filter(|(_, weight)| **weight > 0.0).map(|(link, _)| link));
    for c in 0..3 {
        let mut lacks = vec![(0.0f64, 0u32); roots.len()];
        for ((root, p), v) in roots.iter().zip(primal.plane(c)).zip(image.plane(c)) {
            let (sum, count) = &mut lacks[*root as usize];
            *sum += f64::from(*p) - f64::from(*v);
            *count += 1;
        }
        for (root, v) in roots.iter().zip(image.plane_mut(c)) {
            let (sum, count) = lacks[*root as usize];
            *v = (f64::from(*v) + sum / f64::from(count)) as f32;
        }
    }
}

/// For each pixel the first one that links join it to.
fn roots<'l>(pixels: usize, links: impl Iterator<Item = &'l [u32; 2]>) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..pixels as u32).collect();
    fn root(parents: &mut [u32], mut pixel: u32) -> u32 {
        while parents[pixel as usize] != pixel {
            let above = parents[parents[pixel as usize] as usize];
            parents[pixel as usize] = above;
            pixel = above;
        }
        pixel
    }
    for [i, j] in links {
        let (a, b) = (root(&mut parents, *i), root(&mut parents, *j));
        parents[a.max(b) as usize] = a.min(b);
    }
    (0..pixels as u32).map(|pixel| root(&mut parents, pixel)).collect()
}
