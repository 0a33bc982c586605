//! What leaves of several lobes share: the choice among them, and the turn to the side that is lit.

use super::bsdf::{Evaluation, Scatter};
use crate::math::{INV_PI, Vec3};
use crate::sampling::warp::{cosine_hemisphere, uniform_sphere};

/// Takes the first of two branches with probability `p`: whether, and the number stretched to [0, 1) again.
#[inline]
pub(super) fn split(choice: f32, p: f32) -> (bool, f32) {
    const BELOW_ONE: f32 = 1.0 - f32::EPSILON;
    if choice < p { (true, (choice / p).min(BELOW_ONE)) } else { (false, ((choice - p) / (1.0 - p)).clamp(0.0, BELOW_ONE)) }
}

/// `w` mirrored at the surface if `side` lies below it.
#[inline]
pub(super) fn upper(w: Vec3, side: Vec3) -> Vec3 {
    if side.z < 0.0 { Vec3::new(w.x, w.y, -w.z) } else { w }
}

/// Whether a surface that only reflects is lit on the side of `wo`.
#[inline]
pub(super) fn reflects(wo: Vec3, two_sided: bool) -> bool {
    wo.z > 0.0 || (wo.z < 0.0 && two_sided)
}

/// Both directions turned to the upper hemisphere; `None` where they lie on different sides or on one that is not lit.
#[inline]
pub(super) fn facing(wo: Vec3, wi: Vec3, two_sided: bool) -> Option<(Vec3, Vec3)> {
    (wo.z * wi.z > 0.0 && reflects(wo, two_sided)).then(|| (upper(wo, wo), upper(wi, wo)))
}

/// Density cosθ/π [sr⁻¹] of [`diffuse`].
#[inline]
pub(super) fn diffuse_density(wi: Vec3) -> f32 {
    wi.z.abs() * INV_PI
}

/// A direction of the upper hemisphere, distributed by its cosine; `None` on the horizon.
#[inline]
pub(super) fn diffuse(u: [f32; 2]) -> Option<Vec3> {
    let wi = cosine_hemisphere(u);
    (wi.z > 0.0).then_some(wi)
}

/// A direction of the upper hemisphere, uniform with density 1/2π [sr⁻¹]; `None` on the horizon.
#[inline]
pub(super) fn uniform(u: [f32; 2]) -> Option<Vec3> {
    let mut wi = uniform_sphere(u);
    wi.z = wi.z.abs();
    (wi.z > 0.0).then_some(wi)
}

/// The scattering by a lobe that is no delta, unless it carries nothing.
#[inline]
pub(super) fn scattered(wi: Vec3, evaluation: Evaluation) -> Option<Scatter> {
    (evaluation.density > 0.0).then_some(Scatter { wi, evaluation, delta: false })
}
