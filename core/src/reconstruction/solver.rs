//! The weighted screened Poisson operator on the lattice, and conjugate gradients for it.

use super::multigrid::Hierarchy;

/// A x = s·x + ∇ᵀ(w ∇x): a symmetric positive definite five-point stencil with a weight for each pixel and each edge.
///
/// `wx[i]` belongs to the edge from pixel i to the next column (0 in the last one), `wy[i]` to that to the next row.
#[derive(Clone, Debug, Default)]
pub(super) struct Stencil {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Weight of the pixel itself, > 0.
    pub(super) screen: Vec<f32>,
    /// Weight of the edge to the right, ≥ 0.
    pub(super) wx: Vec<f32>,
    /// Weight of the edge down, ≥ 0.
    pub(super) wy: Vec<f32>,
}

impl Stencil {
    /// Sum of the weights at a pixel: the diagonal.
    #[inline]
    pub(super) fn diagonal(&self, x: usize, y: usize) -> f32 {
        let i = y * self.width + x;
        let left = if x > 0 { self.wx[i - 1] } else { 0.0 };
        let above = if y > 0 { self.wy[i - self.width] } else { 0.0 };
        self.screen[i] + self.wx[i] + self.wy[i] + left + above
    }

    /// out = A x.
    pub(super) fn apply(&self, x: &[f32], out: &mut [f32]) {
        let w = self.width;
        for row in 0..self.height {
            for column in 0..w {
                let i = row * w + column;
                let here = x[i];
                let mut sum = self.screen[i] * here;
                if column + 1 < w {
                    sum += self.wx[i] * (here - x[i + 1]);
                }
                if column > 0 {
                    sum += self.wx[i - 1] * (here - x[i - 1]);
                }
                if row + 1 < self.height {
                    sum += self.wy[i] * (here - x[i + w]);
                }
                if row > 0 {
                    sum += self.wy[i - w] * (here - x[i - w]);
                }
                out[i] = sum;
            }
        }
    }
}

/// Inner product in f64, in blocks of fixed size, so that its rounding is small and always the same.
pub(super) fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.chunks(1024).zip(b.chunks(1024)).map(|(a, b)| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>()).sum()
}

/// Preconditioned conjugate gradients from the given x. Returns iterations and the relative residual ‖b − Ax‖ / ‖b‖ reached.
pub(super) fn conjugate_gradients(
    stencil: &Stencil,
    multigrid: &mut Hierarchy,
    b: &[f32],
    x: &mut [f32],
    tolerance: f64,
    most: u32,
) -> (u32, f64) {
    let n = b.len();
    let norm = dot(b, b).sqrt();
    if norm == 0.0 {
        x.fill(0.0);
        return (0, 0.0);
    }
    let mut r = vec![0.0f32; n];
    stencil.apply(x, &mut r);
    for (r, b) in r.iter_mut().zip(b) {
        *r = b - *r;
    }
    let mut z = vec![0.0f32; n];
    let mut p = vec![0.0f32; n];
    let mut ap = vec![0.0f32; n];
    let mut rz_before = 0.0;
    let mut residual = dot(&r, &r).sqrt() / norm;
    for iteration in 0..most {
        if residual <= tolerance {
            return (iteration, residual);
        }
        multigrid.precondition(&r, &mut z);
        let rz = dot(&r, &z);
        let beta = if iteration == 0 { 0.0 } else { (rz / rz_before) as f32 };
        rz_before = rz;
        for (p, z) in p.iter_mut().zip(&z) {
            *p = z + beta * *p;
        }
        stencil.apply(&p, &mut ap);
        let alpha = (rz / dot(&p, &ap)) as f32;
        if !alpha.is_finite() {
            return (iteration, residual);
        }
        for i in 0..n {
            x[i] += alpha * p[i];
            r[i] -= alpha * ap[i];
        }
        residual = dot(&r, &r).sqrt() / norm;
    }
    (most, residual)
}
