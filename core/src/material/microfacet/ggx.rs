//! The GGX (Trowbridge–Reitz) distribution.

use crate::math::{INV_PI, PI, Vec3, safe_sqrt, sin_cos};

#[inline]
pub(super) fn density_of_normals(h: Vec3, alpha_u: f32, alpha_v: f32) -> f32 {
    let (x, y) = (h.x / alpha_u, h.y / alpha_v);
    let e = x * x + y * y + h.z * h.z;
    INV_PI / (alpha_u * alpha_v * e * e)
}

/// `z` ≥ 0 and `across` are the parts of a stretched direction along and across the surface's normal.
#[inline]
pub(super) fn projected_area(z: f32, across: f32) -> f32 {
    0.5 * (z + safe_sqrt(z * z + across * across))
}

/// A normal of the surface of roughness 1, visible from the unit direction `wo`; not normalised.
///
/// # Source
/// Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023.
#[inline]
pub(super) fn sample(wo: Vec3, u: [f32; 2]) -> Vec3 {
    let z = (1.0 - u[0]) * (1.0 + wo.z) - wo.z;
    let r = safe_sqrt(1.0 - z * z);
    let (s, c) = sin_cos(2.0 * PI * u[1]);
    Vec3::new(r * c, r * s, z) + wo
}
