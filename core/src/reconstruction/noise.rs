//! The weight of the primal that noise calls for.
//!
//! In every mode of the lattice with eigenvalue λ, least squares averages two estimates: the primal's with variance V(P), and the integrated
//! differences' with variance V(G) / λ. The mean of least variance weighs them by the inverses of these, α² : λ with α² = V(G) / V(P),
//! alike for all modes: the best weight follows from the noise alone, whatever the image. Noise is taken relative to brightness, as
//! errors are.

use super::Measurements;
use crate::film::Image;

/// Where nothing tells of noise (Kettunen et al. 2015).
pub(super) const TYPICAL: f32 = 0.2;
/// The least and the largest weight that noise may call for: estimates of few samples are noisy themselves.
const RANGE: [f64; 2] = [0.02, 2.0];
/// Added to the squared brightness, as in relMSE.
const DARK: f64 = 1e-3;

/// √(V(G) / V(P)) from the relative variances of a whole film.
pub(super) fn alpha(m: &Measurements) -> f32 {
    let brightness = Brightness::of(m.primal);
    let Some(variance) = m.variance else { return TYPICAL };
    let primal: f64 = (0..3).map(|c| brightness.relative(variance.primal.plane(c))).sum();
    let (w, h) = (f64::from(m.extent.width), f64::from(m.extent.height));
    // The last column and the last row hold no difference.
    let gradients = match m.graph {
        Some(graph) => {
            let sum: f64 =
                graph.links.iter().zip(&graph.variances).map(|([i, _], v)| f64::from(*v) / brightness.floored(*i as usize)).sum();
            sum / graph.links.len().max(1) as f64
        }
        None => {
            (brightness.relative(variance.dx.plane(0)) + brightness.relative(variance.dy.plane(0))) * w * h / (2.0 * w * h - w - h).max(1.0)
        }
    };
    let ratio = (gradients / primal).sqrt();
    if primal > 0.0 && gradients > 0.0 && ratio.is_finite() { ratio.clamp(RANGE[0], RANGE[1]) as f32 } else { TYPICAL }
}

/// The brightness of a film's pixels.
struct Brightness<'a> {
    planes: [&'a [f32]; 3],
}

impl<'a> Brightness<'a> {
    fn of(image: &'a Image) -> Self {
        Self { planes: std::array::from_fn(|c| image.plane(c)) }
    }

    /// Squared grey of a pixel, and a bit.
    fn floored(&self, pixel: usize) -> f64 {
        let grey = self.planes.iter().map(|plane| f64::from(plane[pixel])).sum::<f64>() / 3.0;
        grey * grey + DARK
    }

    /// Mean of a plane of variances relative to the brightness.
    fn relative(&self, variances: &[f32]) -> f64 {
        variances.iter().enumerate().map(|(i, v)| f64::from(*v) / self.floored(i)).sum::<f64>() / variances.len().max(1) as f64
    }
}
