//! Maps from the unit square to directions and points, with their densities.

use crate::math::{INV_PI, PI, Vec2, Vec3, safe_sqrt, sin_cos};

/// A point of the unit disk, uniform, by the concentric map (Shirley and Chiu, JGT 2(3), 1997), which keeps strata compact.
#[inline]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if a == 0.0 && b == 0.0 {
        return Vec2::ZERO;
    }
    let (radius, angle) = if a.abs() > b.abs() { (a, PI / 4.0 * (b / a)) } else { (b, PI / 2.0 - PI / 4.0 * (a / b)) };
    let (s, c) = sin_cos(angle);
    Vec2::new(radius * c, radius * s)
}

/// A direction of the upper hemisphere with density cosθ/π [sr⁻¹].
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = concentric_disk(u);
    Vec3::new(d.x, d.y, safe_sqrt(1.0 - d.length_squared()))
}

/// Density of [`cosine_hemisphere`] [sr⁻¹].
#[inline]
pub fn cosine_hemisphere_density(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * INV_PI
}

/// A direction of the sphere, uniform with density 1/4π [sr⁻¹].
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = safe_sqrt(1.0 - z * z);
    let (s, c) = sin_cos(2.0 * PI * u[1]);
    Vec3::new(r * c, r * s, z)
}

/// Density of [`uniform_sphere`] [sr⁻¹].
pub const UNIFORM_SPHERE_DENSITY: f32 = INV_PI / 4.0;

/// Barycentric coordinates (b1, b2) of a point uniform in a triangle.
///
/// # Source
/// Heitz, "A Low-Distortion Map Between Triangle and Square", 2019.
#[inline]
pub fn triangle(u: [f32; 2]) -> [f32; 2] {
    if u[1] > u[0] {
        let x = u[0] * 0.5;
        [x, u[1] - x]
    } else {
        let y = u[1] * 0.5;
        [u[0] - y, y]
    }
}
