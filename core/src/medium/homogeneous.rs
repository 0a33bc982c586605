//! A medium that is the same everywhere.

use super::Phase;
use crate::spectrum::Spectrum;

/// A homogeneous medium.
#[derive(Clone, Debug, PartialEq)]
pub struct Homogeneous {
    /// Extinction σₜ [m⁻¹].
    pub extinction: Spectrum,
    /// Single-scattering albedo σₛ / σₜ [1].
    pub albedo: Spectrum,
    /// How it scatters.
    pub phase: Phase,
}

impl Homogeneous {
    /// Beer and Lambert's law: exp(−σₜ d).
    #[inline]
    pub(super) fn transmittance(&self, distance: f32) -> Spectrum {
        // Finite, so that a channel without extinction stays clear over any distance.
        let distance = distance.min(f32::MAX);
        self.extinction.map(|extinction| libm::expf(-extinction * distance))
    }

    /// Scattering coefficient σₛ [m⁻¹].
    #[inline]
    pub(super) fn scattering(&self) -> Spectrum {
        self.extinction * self.albedo
    }

    /// Each of the three channels chooses the distance for a third of the walks.
    #[inline]
    pub(super) fn sample(&self, u: f32) -> f32 {
        let scaled = u * 3.0;
        let channel = (scaled as usize).min(2);
        let extinction = self.extinction.to_rgb()[channel];
        if extinction == 0.0 {
            return f32::INFINITY;
        }
        // What is left of u is uniform again; 1 − rest lies in (0, 1].
        -libm::logf(1.0 - (scaled - channel as f32).min(1.0 - f32::EPSILON)) / extinction
    }
}

#[cfg(test)]
mod tests {
    use super::super::Medium;
    use super::*;

    #[test]
    fn collisions_have_their_density() {
        let medium = Medium::Homogeneous(Homogeneous {
            extinction: Spectrum::rgb(0.2, 1.0, 3.0),
            albedo: Spectrum::WHITE,
            phase: Phase { mean_cosine: 0.0 },
        });
        // The fraction of stratified numbers that pass a distance is its density of passing.
        let n = 300_000;
        for distance in [0.1f32, 0.7, 2.0, 9.0] {
            let passed = (0..n).filter(|k| medium.sample((*k as f32 + 0.5) / n as f32) > distance).count();
            let expected = medium.pass_density(medium.transmittance(distance));
            assert!((passed as f32 / n as f32 - expected).abs() < 1e-3, "{distance}: {passed} of {n}, expected {expected}");
        }
        // And the density of colliding is its derivative.
        let (a, b) = (medium.pass_density(medium.transmittance(0.5)), medium.pass_density(medium.transmittance(0.501)));
        let (_, density) = medium.collision(medium.transmittance(0.5005));
        assert!(((a - b) / 0.001 / density - 1.0).abs() < 1e-2);
    }

    #[test]
    fn a_channel_without_extinction_is_clear_over_any_distance() {
        let medium = Homogeneous { extinction: Spectrum::rgb(0.0, 1.0, 1.0), albedo: Spectrum::WHITE, phase: Phase { mean_cosine: 0.0 } };
        assert_eq!(medium.transmittance(f32::INFINITY).to_rgb(), [1.0, 0.0, 0.0]);
        assert_eq!(medium.sample(0.1), f32::INFINITY);
    }
}
