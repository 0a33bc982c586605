//! Light from infinitely far away, the same from every direction.

use super::LightPoint;
use crate::math::Vec3;
use crate::sampling::warp::{UNIFORM_SPHERE_DENSITY, uniform_sphere};
use crate::spectrum::Spectrum;
use crate::texture::TexturePoint;

/// A constant environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Radiance [W·m⁻²·sr⁻¹].
    pub radiance: Spectrum,
}

impl Environment {
    #[inline]
    pub(super) fn sample(&self, light: u32, u: [f32; 2]) -> (LightPoint, f32) {
        let position = uniform_sphere(u);
        (
            LightPoint { light, position, error: 0.0, normal: Vec3::ZERO, at: TexturePoint::default(), infinite: true, delta: false },
            UNIFORM_SPHERE_DENSITY,
        )
    }

    #[inline]
    pub(super) fn density(&self) -> f32 {
        UNIFORM_SPHERE_DENSITY
    }
}
