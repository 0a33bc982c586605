//! Russian roulette on shifting: base paths that carry little are shifted less often, and count for more when they are.
//!
//! # Source
//! The variant of the course "Gradient-Domain Light Transport" (SIGGRAPH Asia 2018, 3.2) bounds the survival by an absolute radiance;
//! here it is relative to the mean radiance of the film, so that the exposure of a scene does not matter.

use crate::integrator::PathIntegrator;
use crate::path::{Integrator, Subpath};
use crate::plan::Plan;
use crate::sampling::{Dimension, SampleKey, SampleStream};
use crate::scene::Scene;
use crate::sensor::View;
use crate::spectrum::Spectrum;

/// Decides whether a base path is shifted.
pub(super) struct ShiftRoulette {
    least: f32,
    /// Radiance from which paths are always shifted.
    full: f32,
}

/// Paths that the mean radiance is estimated from.
const PILOT: u32 = 256;
/// Their frame key: no frame of a job uses these numbers.
const PILOT_FRAME: u32 = u32::MAX;

impl ShiftRoulette {
    /// Estimates the film's mean radiance, where the plan asks for roulette; else every path is shifted.
    pub(super) fn new(scene: &Scene, plan: &Plan, view: &View, integrator: &PathIntegrator) -> Self {
        if plan.shift_survival >= 1.0 || !plan.technique.measures_gradients() {
            return Self { least: 1.0, full: 0.0 };
        }
        let mut base = Subpath::default();
        let mut sum = 0.0;
        for index in 0..PILOT {
            let stream = SampleStream::open(SampleKey { seed: plan.seed, frame: PILOT_FRAME, x: 0, y: 0, index });
            // The pixel is the sample's place on the whole film.
            let [u, v] = stream.pair(Dimension::PIXEL);
            let film = [u * plan.extent.width as f32, v * plan.extent.height as f32];
            integrator.generate(scene, &view.ray(film, [0.5; 2]), &stream, &mut base);
            let radiance = f64::from(base.primal().max());
            sum += if radiance.is_finite() { radiance } else { 0.0 };
        }
        Self { least: plan.shift_survival, full: (sum / f64::from(PILOT)) as f32 }
    }

    /// The probability with which a path that carries this radiance is shifted, in [least, 1].
    #[inline]
    pub(super) fn survival(&self, primal: Spectrum) -> f32 {
        if self.full > 0.0 { (primal.max() / self.full).clamp(self.least, 1.0) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survival_is_proportional_to_what_a_path_carries() {
        let roulette = ShiftRoulette { least: 0.1, full: 4.0 };
        let carries = |radiance| roulette.survival(Spectrum::rgb(0.0, radiance, 0.0));
        assert_eq!([0.0, 0.2, 1.0, 2.0, 4.0, 9.0].map(carries), [0.1, 0.1, 0.25, 0.5, 1.0, 1.0]);
        assert_eq!(ShiftRoulette { least: 1.0, full: 0.0 }.survival(Spectrum::BLACK), 1.0);
    }
}
