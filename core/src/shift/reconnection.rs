//! Reconnection: the offset path goes straight to a vertex of the base path.

use crate::math::{Vec3, segment};
use crate::path::{ShiftFailure, Vertex, turn};
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
