//! Lights without extent: points, spots and parallel light. Only sampling finds them.

use super::LightPoint;
use crate::math::{PI, Vec3};
use crate::spectrum::Spectrum;
use crate::texture::TexturePoint;

/// Light from one point, the same in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// World position.
    pub position: Vec3,
    /// Radiant intensity [W·sr⁻¹].
    pub intensity: Spectrum,
}

/// How a spot falls from full intensity to none; t runs from 0 at the outer angle to 1 at the inner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Falloff {
    /// t, linear in the angle.
    Linear,
    /// t²(3 − 2t), t linear in the cosine.
    Smoothstep,
    /// t², t linear in the cosine.
    Quadratic,
}

/// A cone of light from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotLight {
    /// World position.
    pub position: Vec3,
    /// Unit direction that it shines to.
    pub axis: Vec3,
    /// Radiant intensity along the axis [W·sr⁻¹].
    pub intensity: Spectrum,
    /// Angle from the axis up to which the intensity is full [rad].
    pub inner: f32,
    /// Angle past which there is none [rad].
    pub outer: f32,
    /// What lies between.
    pub falloff: Falloff,
}

/// Parallel light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    /// Unit direction *to* where the light comes from.
    pub towards: Vec3,
    /// Irradiance of a surface that faces it [W·m⁻²].
    pub irradiance: Spectrum,
}

impl PointLight {
    #[inline]
    pub(super) fn point(&self, light: u32) -> LightPoint {
        place(light, self.position)
    }

    /// What arrives at `from` [W·m⁻²].
    #[inline]
    pub(super) fn received(&self, from: Vec3) -> Spectrum {
        self.intensity / (self.position - from).length_squared()
    }

    pub(super) fn power(&self) -> f32 {
        4.0 * self.intensity.mean()
    }
}

impl SpotLight {
    #[inline]
    pub(super) fn point(&self, light: u32) -> LightPoint {
        place(light, self.position)
    }

    /// What arrives at `from` [W·m⁻²].
    #[inline]
    pub(super) fn received(&self, from: Vec3) -> Spectrum {
        let away = from - self.position;
        let distance2 = away.length_squared();
        let cos = (away.dot(self.axis) / distance2.sqrt()).clamp(-1.0, 1.0);
        self.intensity * (self.share(cos) / distance2)
    }

    /// Share of the full intensity at an angle of this cosine from the axis.
    fn share(&self, cos: f32) -> f32 {
        let (cos_inner, cos_outer) = (libm::cosf(self.inner), libm::cosf(self.outer));
        if cos >= cos_inner {
            return 1.0;
        }
        if cos <= cos_outer {
            return 0.0;
        }
        match self.falloff {
            Falloff::Linear => (self.outer - libm::acosf(cos)) / (self.outer - self.inner),
            Falloff::Smoothstep => {
                let t = (cos - cos_outer) / (cos_inner - cos_outer);
                t * t * (3.0 - 2.0 * t)
            }
            Falloff::Quadratic => {
                let t = (cos - cos_outer) / (cos_inner - cos_outer);
                t * t
            }
        }
    }

    pub(super) fn power(&self) -> f32 {
        // Solid angle of the cone half-way between both angles, over π like the power of every other light.
        2.0 * (1.0 - libm::cosf(0.5 * (self.inner + self.outer))) * self.intensity.mean()
    }
}

impl DirectionalLight {
    #[inline]
    pub(super) fn point(&self, light: u32) -> LightPoint {
        LightPoint { infinite: true, ..place(light, self.towards) }
    }

    pub(super) fn power(&self, radius: f32) -> f32 {
        // Irradiance over the disk that the scene fills, over π.
        self.irradiance.mean() * radius * radius
    }
}

#[inline]
fn place(light: u32, position: Vec3) -> LightPoint {
    let error = position.abs().max_element() * (4.0 * f32::EPSILON);
    LightPoint { light, position, error, normal: Vec3::ZERO, at: TexturePoint::default(), infinite: false, delta: true }
}

/// Radians of an angle in degrees.
pub fn radians(degrees: f64) -> f32 {
    (degrees / 180.0) as f32 * PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_fall_from_full_to_none_between_their_angles() {
        for falloff in [Falloff::Linear, Falloff::Smoothstep, Falloff::Quadratic] {
            let spot = SpotLight {
                position: Vec3::new(1.0, 2.0, 3.0),
                axis: -Vec3::Y,
                intensity: Spectrum::grey(8.0),
                inner: 0.3,
                outer: 0.5,
                falloff,
            };
            let at = |angle: f32| {
                let from = spot.position + Vec3::new(libm::sinf(angle), -libm::cosf(angle), 0.0) * 2.0;
                spot.received(from).mean()
            };
            // Full intensity over the squared distance, then less and less, then none.
            assert!((at(0.0) - 2.0).abs() < 1e-5 && (at(0.299) - 2.0).abs() < 1e-5 && at(0.501) == 0.0 && at(2.0) == 0.0);
            let samples: Vec<f32> = (0..=20).map(|k| at(0.3 + 0.01 * k as f32)).collect();
            assert!(samples.windows(2).all(|w| w[1] <= w[0] + 1e-4), "{falloff:?}: {samples:?}");
            let half = at(0.4) / 2.0;
            let cosine = (libm::cosf(0.4) - libm::cosf(0.5)) / (libm::cosf(0.3) - libm::cosf(0.5));
            let expected = match falloff {
                Falloff::Linear => 0.5,
                Falloff::Smoothstep => cosine * cosine * (3.0 - 2.0 * cosine),
                Falloff::Quadratic => cosine * cosine,
            };
            assert!((half - expected).abs() < 1e-4, "{falloff:?}: {half}, expected {expected}");
        }
    }
}
