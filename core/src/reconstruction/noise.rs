//! The weight of the primal that noise calls for.
//!
//! In every mode of the lattice with eigenvalue λ, least squares averages two estimates: the primal's with variance V(P), and the integrated
//! differences' with variance V(G) / λ. The mean of least variance weighs them by the inverses of these, α² : λ with α² = V(G) / V(P),
//! alike for all modes: the best weight follows from the noise alone, whatever the image.
//!
//! That holds where noise is independent from pixel to pixel and alike everywhere. Of a rendered film two things must be kept out. The
//! rare brightest paths make nearly all of the variance, but primal and differences have them in common, so that no weight averages them
//! away: the noisiest tenth of the pixels is left out. And what remains of the noise is shared by neighbours, so that √(V(G) / V(P)) errs
//! to both sides: the weight is the geometric mean of it and what is best for most films.

use super::Measurements;
use crate::film::Image;

/// Where nothing tells of noise (Kettunen et al. 2015).
pub(super) const TYPICAL: f32 = 0.2;
/// What is best for most films: between 0.25 and 0.6 on scenes of 16 to 512 samples.
const CENTRE: f64 = 0.3;
/// The least and the largest ratio of deviations that is believed.
const RANGE: [f64; 2] = [0.03, 3.0];
/// How much of the pixels is not left out as too noisy.
const KEPT: f64 = 0.9;
/// Added to the squared brightness, as in relMSE.
const DARK: f64 = 1e-3;

/// √(0.3 √(V(G) / V(P))) from the relative variances of a film without its noisiest tenth.
pub(super) fn alpha(m: &Measurements) -> f32 {
    let Some(variance) = m.variance else { return TYPICAL };
    let (w, h) = (m.extent.width as usize, m.extent.height as usize);
    let brightness: Vec<f64> = (0..w * h).map(|i| brightness(m.primal, i)).collect();
    let relative = |v: f64, pixel: usize| (v / brightness[pixel]) as f32;
    let primal = (0..w * h).map(|i| relative((0..3).map(|c| f64::from(variance.primal.plane(c)[i])).sum(), i)).collect();
    let gradients = match m.graph {
        Some(graph) => graph.links.iter().zip(&graph.variances).map(|([i, _], v)| relative(f64::from(*v), *i as usize)).collect(),
        None => {
            // The last column and the last row hold no difference.
            let along = |image: &'_ Image, i: usize| relative(f64::from(image.plane(0)[i]), i);
            let dx = (0..w * h).filter(|i| i % w + 1 < w).map(|i| along(variance.dx, i));
            dx.chain((0..w * h).filter(|i| i / w + 1 < h).map(|i| along(variance.dy, i))).collect()
        }
    };
    let ratio = (usual(gradients) / usual(primal)).sqrt();
    if ratio > 0.0 && ratio.is_finite() { (CENTRE * ratio.clamp(RANGE[0], RANGE[1])).sqrt() as f32 } else { TYPICAL }
}

/// Squared grey of a pixel, and a bit.
fn brightness(image: &Image, pixel: usize) -> f64 {
    let grey = (0..3).map(|c| f64::from(image.plane(c)[pixel])).sum::<f64>() / 3.0;
    grey * grey + DARK
}

/// The mean without the largest tenth.
fn usual(values: Vec<f32>) -> f64 {
    let kept = (values.len() as f64 * KEPT).ceil() as usize;
    if kept == 0 {
        return 0.0;
    }
    let mut sorted = values.clone();
    let (_, limit, _) = sorted.select_nth_unstable_by(kept - 1, f32::total_cmp);
    let limit = *limit;
    // In the order of the pixels, so that rounding is; of values that equal the limit as many as are kept.
    let (mut sum, mut count) = (0.0, 0);
    for v in values.into_iter().filter(|v| *v < limit) {
        sum += f64::from(v);
        count += 1;
    }
    (sum + (kept - count) as f64 * f64::from(limit)) / kept as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_tenth_is_left_out() {
        assert_eq!(usual(vec![]), 0.0);
        assert_eq!(usual(vec![3.0]), 3.0);
        let values: Vec<f32> = (0..100).map(|k| if k % 10 == 3 { 1e9 } else { k as f32 / 100.0 }).collect();
        let expected = values.iter().filter(|v| **v < 1.0).map(|v| f64::from(*v)).sum::<f64>() / 90.0;
        assert!((usual(values) - expected).abs() < 1e-12);
        assert_eq!(usual(vec![2.0; 50]), 2.0);
    }
}
