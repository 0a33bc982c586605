//! Beckmann's distribution: slopes are normally distributed.

use super::error_function::{erf, inverse_erf};
use crate::math::{INV_PI, Vec3};

/// 1/√π.
const INV_SQRT_PI: f32 = 0.564_189_6;

#[inline]
pub(super) fn density_of_normals(h: Vec3, alpha_u: f32, alpha_v: f32) -> f32 {
    let z2 = h.z * h.z;
    if z2 < 1e-12 {
        return 0.0;
    }
    let (x, y) = (h.x / alpha_u, h.y / alpha_v);
    libm::expf(-(x * x + y * y) / z2) * INV_PI / (alpha_u * alpha_v * z2 * z2)
}

/// The exact ½(z (1 + erf a) + s exp(−a²)/√π), a = z/s, which the usual rational fit of G₁ approximates to 0.4 %.
#[inline]
pub(super) fn projected_area(z: f32, across: f32) -> f32 {
    if z >= 4.0 * across {
        // The facets that hide others are rarer than f32 can tell.
        return z;
    }
    let a = z / across;
    0.5 * (z * (1.0 + erf(a)) + across * libm::expf(-a * a) * INV_SQRT_PI)
}

/// A normal of the surface of roughness 1, visible from the unit direction `wo`; not normalised.
///
/// In the plane of `wo` the slope p ≤ cotθ has the cumulative distribution ∝ cosθ (1 + erf p) + sinθ exp(−p²)/√π, across it
/// the slope is normally distributed (Heitz and d'Eon, EGSR 2014). The first is inverted by Newton's method in b = erf p, in
/// which it is concave and nearly linear: from the second step on the iterates rise towards the root and cannot miss it. The
/// first guess is the fit of Jakob, "An Improved Visible Normal Sampling Routine for the Beckmann Distribution", 2014.
#[inline]
pub(super) fn sample(wo: Vec3, u: [f32; 2]) -> Vec3 {
    let across = (wo.x * wo.x + wo.y * wo.y).sqrt();
    let (u0, u1) = (u[0].clamp(1e-6, 1.0 - 1e-6), u[1].clamp(1e-6, 1.0 - 1e-6));
    let second = inverse_erf(2.0 * u1 - 1.0);
    if across < 1e-5 {
        return Vec3::new(-inverse_erf(2.0 * u0 - 1.0), -second, 1.0);
    }
    let first = visible_slope(wo.z, across, u0);
    let (cos_phi, sin_phi) = (wo.x / across, wo.y / across);
    Vec3::new(-(cos_phi * first - sin_phi * second), -(sin_phi * first + cos_phi * second), 1.0)
}

#[inline]
fn visible_slope(cos: f32, sin: f32, u: f32) -> f32 {
    const LOWEST: f32 = -1.0 + 1e-6;
    let cot = cos / sin;
    let last = erf(cot);
    let total = cos * (1.0 + last) + sin * libm::expf(-cot * cot) * INV_SQRT_PI;
    let theta = libm::atan2f(sin, cos);
    let power = 1.0 + theta * (-0.876 + theta * (0.4265 - 0.0594 * theta));
    let mut b = (last - (1.0 + last) * libm::powf(1.0 - u, power)).clamp(LOWEST, 1.0 - 1e-6);
    let mut p = inverse_erf(b);
    for _ in 0..12 {
        let excess = cos * (1.0 + b) + sin * libm::expf(-p * p) * INV_SQRT_PI - u * total;
        let slope = cos - p * sin;
        if excess.abs() < 2e-6 * total || slope <= 1e-6 {
            break;
        }
        b = (b - excess / slope).clamp(LOWEST, 1.0 - 1e-6);
        p = inverse_erf(b);
    }
    p.min(cot)
}
