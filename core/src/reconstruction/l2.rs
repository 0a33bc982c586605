//! Screened Poisson in the L2 norm: argmin ‖∇I − G‖² + α²‖I − P‖², solved exactly.
//!
//! The normal equations are (α² + Δ) I = α² P + ∇ᵀG with Neumann borders, which the two-dimensional cosine transform makes
//! diagonal. The image is linear in the measurements, so it is unbiased where they are, and keeps the mean of the primal.

use super::dct::Dct2;
use super::{Measurements, Reconstruct, ReconstructError, SolveReport};
use crate::film::Image;
use rayon::prelude::*;

/// Exact least squares.
pub(super) struct L2;

impl Reconstruct for L2 {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        true
    }

    fn solve(&self, own: &Measurements, _other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        let extent = own.extent;
        let mut image = Image::new(extent, 3);
        for c in 0..3 {
            for (v, x) in image.plane_mut(c).iter_mut().zip(solve_channel(own, c, alpha)) {
                *v = x as f32;
            }
        }
        Ok((image, SolveReport::default()))
    }
}

/// One channel of the image, before it is rounded.
pub(super) fn solve_channel(measurements: &Measurements, channel: usize, alpha: f32) -> Vec<f64> {
    let (w, h) = (measurements.extent.width as usize, measurements.extent.height as usize);
    let screen = f64::from(alpha) * f64::from(alpha);
    let mut b = right_hand_side(measurements, channel, screen);
    if b.is_empty() {
        return b;
    }
    let transform = Dct2::new(w, h);
    transform.forward(&mut b);
    // Transposed: columns of the image are rows here.
    let (ex, ey) = (eigenvalues(w), eigenvalues(h));
    b.par_chunks_mut(h).zip(&ex).for_each(|(column, ex)| {
        for (v, ey) in column.iter_mut().zip(&ey) {
            *v /= screen + ex + ey;
        }
    });
    transform.inverse(&mut b);
    b
}

/// α² P + ∇ᵀG of one channel.
fn right_hand_side(m: &Measurements, channel: usize, screen: f64) -> Vec<f64> {
    let w = m.extent.width as usize;
    let h = m.extent.height as usize;
    let (p, dx, dy) = (m.primal.plane(channel), m.dx.plane(channel), m.dy.plane(channel));
    let mut b: Vec<f64> = p.iter().map(|p| screen * f64::from(*p)).collect();
    for y in 0..h {
        for x in 0..w {
            let i = y * w + x;
            if x + 1 < w {
                b[i] -= f64::from(dx[i]);
                b[i + 1] += f64::from(dx[i]);
            }
            if y + 1 < h {
                b[i] -= f64::from(dy[i]);
                b[i + w] += f64::from(dy[i]);
            }
        }
    }
    b
}

/// Eigenvalues 4 sin²(πk / 2n) of the one-dimensional Neumann Laplacian.
pub(super) fn eigenvalues(n: usize) -> Vec<f64> {
    (0..n)
        .map(|k| {
            let s = libm::sin(std::f64::consts::PI * k as f64 / (2 * n) as f64);
            4.0 * s * s
        })
        .collect()
}
