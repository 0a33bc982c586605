//! Sums of one pixel over the samples of a unit, in f64.

use crate::film::PlaneKind;
use crate::spectrum::Spectrum;

/// Everything that is summed for a pixel.
#[derive(Default)]
pub(super) struct PixelSums {
    pub(super) halves: [HalfSums; 2],
    pub(super) albedo: [f64; 3],
    pub(super) normal: [f64; 3],
    pub(super) depth: [f64; 3],
}

/// What each half of the film has of its own.
#[derive(Default)]
pub(super) struct HalfSums {
    pub(super) count: [f64; 3],
    pub(super) primal: [f64; 3],
    pub(super) primal_squared: [f64; 3],
    pub(super) direct: [f64; 3],
    pub(super) gradient: [[f64; 3]; 4],
    pub(super) gradient_squared: [[f64; 3]; 4],
}

impl PixelSums {
    /// The sums behind a plane, and how many of the three are used.
    pub(super) fn of(&self, kind: PlaneKind) -> (&[f64; 3], usize) {
        let sums = match kind {
            PlaneKind::Primal(h) => &self.halves[h.index()].primal,
            PlaneKind::PrimalSquared(h) => &self.halves[h.index()].primal_squared,
            PlaneKind::Direct(h) => &self.halves[h.index()].direct,
            PlaneKind::Gradient(h, o) => &self.halves[h.index()].gradient[o.index()],
            PlaneKind::GradientSquared(h, o) => &self.halves[h.index()].gradient_squared[o.index()],
            PlaneKind::Albedo => &self.albedo,
            PlaneKind::Normal => &self.normal,
            PlaneKind::Depth => &self.depth,
            PlaneKind::Count(h) => &self.halves[h.index()].count,
        };
        (sums, kind.channels())
    }
}

/// Adds a colour.
#[inline]
pub(super) fn add(sum: &mut [f64; 3], value: Spectrum) {
    for (sum, v) in sum.iter_mut().zip(value.to_rgb()) {
        *sum += f64::from(v);
    }
}
