//! What differences in time count against differences in space, from the noise of both.
//!
//! As for the weight of the primal, the least squares of least variance weighs measurements by the inverses of their variances: with those of
//! dx and dy as the unit,
//!
//! * w_t² = V(dx, dy) / V(dt), and
//! * w_m² = V(dx, dy) / V(D_t dx, D_t dy).
//!
//! The copies are independent, so that (dt₀ − dt₁)² / 2 estimates V(dt) of one of them. Noise counts relative to the picture, and no pixel
//! for more than the whole of it: v / (v + grey² + 10⁻³), averaged over the frame, one number for each pair of moments. A single measurement
//! has a share of one in as many as there are pixels in its own weight.

use super::difference::difference;
use super::links::Links;
use super::moment::{CopyFilm, HalfMoment, MomentFilm};
use crate::film::Image;

/// w_t² and w_m² where nothing tells of noise (Manzi et al. 2016).
pub(super) const TYPICAL: f64 = 1.0;
/// The least and the largest that is believed. Where nothing changes, differences in time have no noise at all; this many times the weight of
/// those in space makes one picture of ten moments within a few percent, and still can be solved for.
pub(super) const RANGE: [f64; 2] = [1.0 / 64.0, 256.0];
/// Added to the squared brightness, as in relMSE.
const DARK: f64 = 1e-3;

/// w_t² and w_m² of every pair of moments, alike for both copies.
pub(super) fn pairs(moments: &[&MomentFilm], links: &[Option<Links>]) -> Vec<[f64; 2]> {
    moments.windows(2).zip(links).map(|(pair, links)| between(pair[0], pair[1], links.as_ref())).collect()
}

/// w_t² and w_m² of a pair of moments.
fn between(earlier: &MomentFilm, later: &MomentFilm, links: Option<&Links>) -> [f64; 2] {
    let ([before_a, before_b], [after_a, after_b]) = (earlier.copies(), later.copies()) else { return [TYPICAL; 2] };
    let grey = Grey::new(&later.mean(CopyFilm::primal));
    let changes = [difference(after_a, before_a, links), difference(after_b, before_b, links)];
    let linked = |i: usize| links.is_none_or(|links| links.back(i).is_some());
    let noise = |image: fn(&HalfMoment) -> &Image| {
        let [a, b] = changes.each_ref().map(image);
        let squared = |i: usize| (0..3).map(|c| f64::from(a.plane(c)[i] - b.plane(c)[i]).powi(2)).sum::<f64>();
        grey.mean(linked, |i| 0.5 * squared(i))
    };
    let space: f64 = [before_a, before_b, after_a, after_b]
        .into_iter()
        .map(|copy| {
            let variance = copy.variance();
            0.125 * (grey.mean(linked, |i| f64::from(variance.dx.plane(0)[i])) + grey.mean(linked, |i| f64::from(variance.dy.plane(0)[i])))
        })
        .sum();
    let value = noise(|half| &half.primal);
    let slope = 0.5 * (noise(|half| &half.dx) + noise(|half| &half.dy));
    [value, slope].map(|time| if space > 0.0 { (space / time).clamp(RANGE[0], RANGE[1]) } else { TYPICAL })
}

/// Squared brightness of each pixel.
struct Grey(Vec<f64>);

impl Grey {
    fn new(image: &Image) -> Self {
        let grey = |i: usize| (0..3).map(|c| f64::from(image.plane(c)[i])).sum::<f64>() / 3.0;
        Self((0..image.extent().pixels()).map(|i| grey(i) * grey(i) + DARK).collect())
    }

    /// Mean of v / (v + grey²) over the pixels that `counts` says.
    fn mean(&self, counts: impl Fn(usize) -> bool, v: impl Fn(usize) -> f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0u64);
        for (i, grey) in self.0.iter().enumerate().filter(|(i, _)| counts(*i)) {
            let v = v(i);
            sum += v / (v + grey);
            count += 1;
        }
        sum / count.max(1) as f64
    }
}
