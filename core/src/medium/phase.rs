//! Phase functions.

use crate::math::{Frame, PI, Vec3, safe_sqrt, sin_cos};

/// Henyey and Greenstein's phase function; isotropic where the mean cosine is 0.
///
/// # Source
/// Henyey and Greenstein, "Diffuse radiation in the galaxy", Astrophysical Journal 93, 1941.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Mean cosine g of the angle of deflection, in (−1, 1).
    pub mean_cosine: f32,
}

/// Mean cosine past which a shift copies directions instead of joining paths.
const SHARP: f32 = 0.5;

impl Phase {
    /// Value and density of being scattered from coming along `-wo` to going along `wi` [sr⁻¹]; both are unit vectors that point away.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> f32 {
        let g = self.mean_cosine;
        let cos = -wo.dot(wi);
        let d = (1.0 + g * g - 2.0 * g * cos).max(1e-12);
        (1.0 - g * g) / (4.0 * PI * d * d.sqrt())
    }

    /// A direction distributed as [`evaluate`](Self::evaluate).
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let g = self.mean_cosine;
        let cos = if g.abs() < 1e-3 {
            1.0 - 2.0 * u[0]
        } else {
            let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u[0]);
            ((1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
        };
        let sin = safe_sqrt(1.0 - cos * cos);
        let (s, c) = sin_cos(2.0 * PI * u[1]);
        Frame::from_normal(-wo).to_world(Vec3::new(sin * c, sin * s, cos))
    }

    /// Whether it is too sharp to join paths at.
    #[inline]
    pub fn is_sharp(&self) -> bool {
        self.mean_cosine.abs() > SHARP
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sampling_has_its_density_and_its_mean_cosine() {
        for g in [-0.7f32, 0.0, 0.3, 0.9] {
            let phase = Phase { mean_cosine: g };
            let wo = Vec3::new(0.3, -0.5, 0.8).normalize();
            let n = 400;
            let (mut cosine, mut area) = (0.0f64, 0.0f64);
            for i in 0..n {
                for j in 0..n {
                    let u = [(i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32];
                    let wi = phase.sample(wo, u);
                    cosine -= f64::from(wo.dot(wi));
                    // ∫ 1/p p dω over the backward half: its solid angle, whatever p is.
                    if wo.dot(wi) > 0.0 {
                        area += 1.0 / f64::from(phase.evaluate(wo, wi));
                    }
                }
            }
            let samples = f64::from(n * n);
            assert!((cosine / samples - f64::from(g)).abs() < 2e-3, "g {g}: mean cosine {}", cosine / samples);
            let half = 2.0 * std::f64::consts::PI;
            // A sharp phase function leaves the backward half to few of the numbers.
            assert!((area / samples / half - 1.0).abs() < 0.02, "g {g}: half a sphere is {}", area / samples);
        }
    }
}
