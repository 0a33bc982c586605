//! Reconnection: the offset path goes straight to a point of the base path.

use crate::light::LightPoint;
use crate::math::{Vec3, segment};
use crate::path::{ShiftFailure, Vertex};
use crate::scene::Scene;

/// Joins the offset path to the base path at `target`, the first vertex that both share.
///
/// Returns the unit direction from the offset vertex and |T′| [1] in solid angle at it:
/// (|cosθ′| / |cosθ|) · (‖base edge‖² / ‖offset edge‖²), with cosines at `target` against its geometric normal.
///
/// # Errors
/// `Occluded` if the new edge is blocked.
///
/// # Source
/// Kettunen et al., "Gradient-Domain Path Tracing", ACM TOG 34(4), 2015, section 5.2.
#[inline]
pub fn reconnect(scene: &Scene, base: &Vertex, offset: &Vertex, target: &Vertex) -> Result<(Vec3, f64), ShiftFailure> {
    let (wi, jacobian) = turn(base.position, offset.position, target.position, target.normal).ok_or(ShiftFailure::LobeMismatch)?;
    if scene.world.occluded(&segment(offset.end(), target.end())) {
        return Err(ShiftFailure::Occluded);
    }
    Ok((wi, jacobian))
}

/// Direction and Jacobian of joining the offset path to a light point; visibility is part of the contribution and left to the caller.
/// `None` where the light point is seen edge-on or not at all.
#[inline]
pub fn connect(base: &Vertex, offset: &Vertex, point: &LightPoint) -> Option<(Vec3, f64)> {
    if point.infinite { Some((point.position, 1.0)) } else { turn(base.position, offset.position, point.position, point.normal) }
}

/// Unit direction from `offset` to `target`, and the ratio of solid angles that an area element at `target` fills seen from both.
#[inline]
fn turn(base: Vec3, offset: Vec3, target: Vec3, normal: Vec3) -> Option<(Vec3, f64)> {
    let (a, b) = (target - base, target - offset);
    let (a2, b2) = (f64::from(a.length_squared()), f64::from(b.length_squared()));
    let (cos_a, cos_b) = (f64::from(a.dot(normal).abs()), f64::from(b.dot(normal).abs()));
    // cosθ carries one edge length each: the remaining power is 3/2.
    let jacobian = (cos_b / cos_a) * (a2 * a2.sqrt()) / (b2 * b2.sqrt());
    (jacobian > 0.0 && jacobian.is_finite()).then(|| (b / b.length(), jacobian))
}
