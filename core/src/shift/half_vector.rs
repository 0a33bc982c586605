//! Half-vector copy: the offset path scatters about the same microfacet normal, in its own tangent frame.

use crate::math::{Vec3, safe_sqrt};
use crate::path::{ShiftFailure, Step, Vertex};
use crate::scene::Scene;

/// Copies the half vector of a base step to the offset vertex.
///
/// Returns the offset's unit world direction and |T′| [1] in solid angle: for a reflection |ωᵢ′·h| / |ωᵢ·h|; for a refraction
/// (η/η′)² · (‖h̃′‖² / ‖h̃‖²) · (|ωᵢ·h| / |ωᵢ′·h|), with h̃ = ωₒ + η ωᵢ not normalised; 1 for delta lobes, and inside media, where
/// the direction is copied.
///
/// # Errors
/// `TotalReflection` if the offset cannot refract; `LobeMismatch` if one of both is a delta and the other not, if they lie on
/// different sides, if an index of 1 leaves no half vector, or if the copied direction is on the wrong side.
///
/// # Source
/// Kettunen et al., "Gradient-Domain Path Tracing", ACM TOG 34(4), 2015, section 5.2; Jacobians from Walter et al., EGSR 2007,
/// eqs. 14 and 17, which give the factor (η/η′)² where the two indices differ.
#[inline]
pub fn half_vector(scene: &Scene, base: &Vertex, step: &Step, offset: &Vertex) -> Result<(Vec3, f64), ShiftFailure> {
    match (base.medium(), offset.medium()) {
        // There is no half vector: the direction keeps its place about the direction that light came from.
        (Some(_), Some(_)) => return Ok((offset.frame.to_world(base.frame.to_local(step.wi)).normalize(), 1.0)),
        (None, None) => {}
        _ => return Err(ShiftFailure::LobeMismatch),
    }
    if base.delta != offset.delta || base.wo.z * offset.wo.z <= 0.0 {
        return Err(ShiftFailure::LobeMismatch);
    }
    let (wo, wi) = (base.wo, base.frame.to_local(step.wi));
    let wo_offset = offset.wo;
    let (local, jacobian) = if step.transmits {
        let (eta, eta_offset) = (base.relative_ior(scene), offset.relative_ior(scene));
        if eta == 1.0 && eta_offset == 1.0 && step.delta {
            // Straight on: there is no half vector, and none is needed.
            return Ok((offset.frame.to_world(-wo_offset).normalize(), 1.0));
        }
        if eta == 1.0 || eta_offset == 1.0 {
            return Err(ShiftFailure::LobeMismatch);
        }
        let raw = wo + wi * eta;
        let length = raw.length();
        let h = if step.delta { Vec3::Z } else { raw / length };
        let refracted = refract(wo_offset, h, eta_offset).ok_or(ShiftFailure::TotalReflection)?;
        let raw_offset = wo_offset + refracted * eta_offset;
        let ratio = |a: f32, b: f32| f64::from(a) / f64::from(b);
        let jacobian = ratio(raw_offset.length_squared(), raw.length_squared())
            * ratio(wi.dot(h).abs(), refracted.dot(h).abs())
            * ratio(eta * eta, eta_offset * eta_offset);
        (refracted, jacobian)
    } else {
        let h = if step.delta { Vec3::Z } else { (wo + wi).normalize() };
        let reflected = h * (2.0 * wo_offset.dot(h)) - wo_offset;
        (reflected, f64::from(reflected.dot(h).abs()) / f64::from(wi.dot(h).abs()))
    };
    let crosses = local.z * wo_offset.z < 0.0;
    if crosses != step.transmits || local.z == 0.0 {
        return Err(ShiftFailure::LobeMismatch);
    }
    let jacobian = if step.delta { 1.0 } else { jacobian };
    if !(jacobian > 0.0 && jacobian.is_finite()) {
        return Err(ShiftFailure::LobeMismatch);
    }
    Ok((offset.frame.to_world(local).normalize(), jacobian))
}

/// Refracts at a microfacet normal of either orientation; `eta` is the index of the far side over that of the side of `wo`. `None` under total reflection.
#[inline]
fn refract(wo: Vec3, h: Vec3, eta: f32) -> Option<Vec3> {
    let h = if wo.dot(h) < 0.0 { -h } else { h };
    let cos = wo.dot(h);
    let sin2_t = (1.0 - cos * cos).max(0.0) / (eta * eta);
    (sin2_t < 1.0).then(|| h * (cos / eta - safe_sqrt(1.0 - sin2_t)) - wo / eta)
}
