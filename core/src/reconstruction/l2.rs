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
        let mut image = Image::new(own.extent, 3);
        let mut poisson = Poisson::new(own, alpha);
        for c in 0..3 {
            image.plane_mut(c).par_iter_mut().zip(poisson.channel(c)).for_each(|(v, x)| *v = *x as f32);
        }
        Ok((image, SolveReport::default()))
    }
}

/// Solves one channel after the other in the same memory.
pub(super) struct Poisson<'a> {
    measurements: &'a Measurements<'a>,
    /// α².
    screen: f64,
    transform: Dct2,
    along_x: Vec<f64>,
    along_y: Vec<f64>,
    solution: Vec<f64>,
    spare: Vec<f64>,
}

impl<'a> Poisson<'a> {
    pub(super) fn new(measurements: &'a Measurements<'a>, alpha: f32) -> Self {
        let (w, h) = (measurements.extent.width as usize, measurements.extent.height as usize);
        Self {
            measurements,
            screen: f64::from(alpha) * f64::from(alpha),
            transform: Dct2::new(w, h),
            along_x: eigenvalues(w),
            along_y: eigenvalues(h),
            solution: vec![0.0; w * h],
            spare: Vec::new(),
        }
    }

    /// One channel of the image, before it is rounded.
    pub(super) fn channel(&mut self, channel: usize) -> &Vec<f64> {
        let (along_y, screen) = (&self.along_y, self.screen);
        if self.solution.is_empty() {
            return &self.solution;
        }
        right_hand_side(self.measurements, channel, screen, &mut self.solution);
        self.transform.forward(&mut self.solution, &mut self.spare);
        // Transposed: columns of the image are rows here.
        self.solution.par_chunks_mut(along_y.len()).zip(&self.along_x).for_each(|(column, ex)| {
            for (v, ey) in column.iter_mut().zip(along_y) {
                *v /= screen + ex + ey;
            }
        });
        self.transform.inverse(&mut self.solution, &mut self.spare);
        &self.solution
    }
}

/// Writes α² P + ∇ᵀG of one channel.
fn right_hand_side(m: &Measurements, channel: usize, screen: f64, b: &mut [f64]) {
    let w = m.extent.width as usize;
    let (p, dx, dy) = (m.primal.plane(channel), m.dx.plane(channel), m.dy.plane(channel));
    b.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
        let first = y * w;
        for (x, b) in row.iter_mut().enumerate() {
            let i = first + x;
            *b = screen * f64::from(p[i]);
            if y > 0 {
                *b += f64::from(dy[i - w]);
            }
            if x > 0 {
                *b += f64::from(dx[i - 1]);
            }
            if x + 1 < w {
                *b -= f64::from(dx[i]);
            }
            if i + w < p.len() {
                *b -= f64::from(dy[i]);
            }
        }
    });
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
