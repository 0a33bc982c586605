//! The normal equations of weighted differences: weights and the residual b − A x at an image, in one walk through the measurements.
//!
//! With e_P = P − I and e_G = G − ∇I the residual is s·e_P + ∇ᵀ(w e_G). No right-hand side is stored, and nothing cancels that the
//! measurements themselves do not.

use super::Measurements;
use super::field::{BAND, Field, dot, total};
use super::stencil::Stencil;
use crate::film::Image;
use rayon::prelude::*;

/// What one row of pixels lacks: measurement minus image, for each channel.
pub(super) struct Errors {
    /// P − I.
    pub(super) primal: [Vec<f32>; 3],
    /// Of the difference to the next column; zero in the last one.
    pub(super) dx: [Vec<f32>; 3],
    /// Of the difference to the next row; zero in the last one.
    pub(super) dy: [Vec<f32>; 3],
}

/// The weights of one row of pixels, to be written.
pub(super) struct Weights<'a> {
    /// Of the primal, > 0.
    pub(super) screen: &'a mut [f32],
    /// Of the difference to the next column; what stands in the last one does not count.
    pub(super) wx: &'a mut [f32],
    /// Of the difference to the next row; what stands in the last one does not count.
    pub(super) wy: &'a mut [f32],
}

impl Errors {
    fn new(width: usize) -> Self {
        let rows = || std::array::from_fn(|_| vec![0.0; width]);
        Self { primal: rows(), dx: rows(), dy: rows() }
    }

    /// Those of row y of an image.
    pub(super) fn take_row(&mut self, m: &Measurements, image: &Field, y: usize) {
        let (w, h) = (image.width, image.height);
        for c in 0..3 {
            let line = |plane: &'_ Image| y * w..y * w + plane.extent().width as usize;
            let (p, dx) = (&m.primal.plane(c)[line(m.primal)], &m.dx.plane(c)[line(m.dx)]);
            let here = image.row(y, c);
            for (e, (p, here)) in self.primal[c].iter_mut().zip(p.iter().zip(here)) {
                *e = p - here;
            }
            for (e, (dx, pair)) in self.dx[c].iter_mut().zip(dx.iter().zip(here.windows(2))) {
                *e = dx - (pair[1] - pair[0]);
            }
            if y + 1 < h {
                let (dy, down) = (&m.dy.plane(c)[line(m.dy)], image.row(y + 1, c));
                for (e, (dy, (here, down))) in self.dy[c].iter_mut().zip(dy.iter().zip(here.iter().zip(down))) {
                    *e = dy - (down - here);
                }
            } else {
                self.dy[c].fill(0.0);
            }
        }
    }
}

/// Lets `weigh` set the weights of every row from its errors, and writes the residual under these weights. `weigh` returns its share of the
/// objective; it is called a second time for some rows and must answer alike. Returns the objective and the residual's squared norm by channel.
pub(super) fn weigh(
    m: &Measurements,
    image: &Field,
    stencil: &mut Stencil,
    residual: &mut Field,
    weigh: impl Fn(usize, &Errors, Weights) -> f64 + Sync,
) -> (f64, [f64; 3]) {
    let (w, h) = (stencil.width, stencil.height);
    let band = w * BAND;
    let Stencil { screen, wx, wy, .. } = stencil;
    let rows = screen.par_chunks_mut(band).zip(wx.par_chunks_mut(band)).zip(wy[w..].par_chunks_mut(band));
    let bands = residual.bands_mut().zip(rows).enumerate().map(|(k, (residual, ((screen, wx), wy)))| {
        let mut errors = Errors::new(w);
        // The weighted errors of the edges from above.
        let mut above: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; w]);
        if k > 0 {
            let mut scratch = [vec![0.0; w], vec![0.0; w], vec![0.0; w]];
            errors.take_row(m, image, k * BAND - 1);
            let [screen, wx, wy] = &mut scratch;
            weigh(k * BAND - 1, &errors, Weights { screen, wx, wy });
            for (above, e) in above.iter_mut().zip(&errors.dy) {
                weighted(wy, e, above);
            }
        }
        let (mut objective, mut squares) = (0.0, [0.0; 3]);
        let lines = screen.chunks_mut(w).zip(wx.chunks_mut(w)).zip(wy.chunks_mut(w)).zip(residual.chunks_mut(3 * w));
        for (line, (((screen, wx), wy), residual)) in lines.enumerate() {
            let y = k * BAND + line;
            errors.take_row(m, image, y);
            objective += weigh(y, &errors, Weights { screen, wx, wy });
            wx[w - 1] = 0.0;
            if y + 1 == h {
                wy.fill(0.0);
            }
            for (c, out) in residual.chunks_mut(w).enumerate() {
                let (p, dx, dy, above) = (&errors.primal[c][..w], &errors.dx[c][..w], &errors.dy[c][..w], &mut above[c][..w]);
                let (screen, wx, wy) = (&screen[..w], &wx[..w], &wy[..w]);
                for i in 0..w {
                    let below = wy[i] * dy[i];
                    out[i] = screen[i] * p[i] - wx[i] * dx[i] + (above[i] - below);
                    above[i] = below;
                }
                for i in 1..w {
                    out[i] += wx[i - 1] * dx[i - 1];
                }
                squares[c] += dot(out, out);
            }
        }
        (objective, squares)
    });
    let bands: Vec<(f64, [f64; 3])> = bands.collect();
    let squares: Vec<[f64; 3]> = bands.iter().map(|(_, squares)| *squares).collect();
    (bands.iter().map(|(objective, _)| objective).sum(), total(&squares))
}

fn weighted(weights: &[f32], errors: &[f32], out: &mut [f32]) {
    for (out, (w, e)) in out.iter_mut().zip(weights.iter().zip(errors)) {
        *out = w * e;
    }
}
