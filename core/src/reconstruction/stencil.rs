//! The weighted screened Poisson operator on the lattice: A x = s·x + ∇ᵀ(w ∇x).

use super::field::{Field, Row};
use super::solver::Operator;

/// A symmetric positive definite five-point stencil with a weight for each pixel and each edge, alike for all channels.
#[derive(Clone, Debug, Default)]
pub(super) struct Stencil {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Weight of the pixel itself, > 0.
    pub(super) screen: Vec<f32>,
    /// Weight of the edge to the next column, ≥ 0; zero in the last one.
    pub(super) wx: Vec<f32>,
    /// Weight of the edge from the row *above*, ≥ 0. One row more than the image; the first and the last are zero, so that
    /// every row has an edge above and one below.
    pub(super) wy: Vec<f32>,
}

impl Stencil {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let n = width * height;
        Self { width, height, screen: vec![0.0; n], wx: vec![0.0; n], wy: vec![0.0; n + width] }
    }

    /// One row of some weight.
    #[inline]
    pub(super) fn line<'a>(&self, weights: &'a [f32], y: usize) -> &'a [f32] {
        &weights[y * self.width..(y + 1) * self.width]
    }

    /// Sum of the weights at each pixel of a row: the diagonal.
    pub(super) fn diagonal(&self, y: usize, out: &mut [f32]) {
        let (screen, wx) = (self.line(&self.screen, y), self.line(&self.wx, y));
        let (above, below) = (self.line(&self.wy, y), self.line(&self.wy, y + 1));
        for x in 0..out.len() {
            let left = if x > 0 { wx[x - 1] } else { 0.0 };
            out[x] = screen[x] + wx[x] + left + above[x] + below[x];
        }
    }

    /// One row and channel of A x.
    #[inline]
    pub(super) fn apply_row(&self, x: &Field, y: usize, channel: usize, out: &mut [f32]) {
        let n = self.width;
        let (screen, wx) = (&self.line(&self.screen, y)[..n], &self.line(&self.wx, y)[..n]);
        let (above, below) = (&self.line(&self.wy, y)[..n], &self.line(&self.wy, y + 1)[..n]);
        let here = &x.row(y, channel)[..n];
        // Beyond the border stands the row itself; the weight there is zero.
        let up = &x.row(y.saturating_sub(1), channel)[..n];
        let down = &x.row((y + 1).min(self.height - 1), channel)[..n];
        let out = &mut out[..n];
        let own = |i: usize| screen[i] * here[i] + above[i] * (here[i] - up[i]) + below[i] * (here[i] - down[i]);
        if n == 1 {
            out[0] = own(0);
            return;
        }
        out[0] = own(0) + wx[0] * (here[0] - here[1]);
        for i in 1..n - 1 {
            out[i] = own(i) + (wx[i] * (here[i] - here[i + 1]) + wx[i - 1] * (here[i] - here[i - 1]));
        }
        out[n - 1] = own(n - 1) + wx[n - 2] * (here[n - 1] - here[n - 2]);
    }
}

impl Operator for Stencil {
    #[inline]
    fn row(&self, x: &Field, Row { y, channel, values }: &mut Row) {
        self.apply_row(x, *y, *channel, values);
    }
}
