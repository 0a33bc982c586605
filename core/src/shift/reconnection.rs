//! Reconnection: the offset path goes straight to a vertex of the base path.

use crate::math::Vec3;
use crate::path::{Passage, ShiftFailure, Vertex, passage_between, turn};
use crate::scene::Scene;

/// Joins the offset path to the base path at `target`, the first vertex that both share.
///
/// Returns the unit direction from the offset vertex and |T′| [1] in solid angle at it:
/// (|cosθ′| / |cosθ|) · (‖base edge‖² / ‖offset edge‖²), with cosines at `target` against its geometric normal, and without them
/// where it lies inside a medium; and what lies along the new edge.
///
/// # Errors
/// `Occluded` if the new edge is blocked.
///
/// # Source
/// Kettunen et al., "Gradient-Domain Path Tracing", ACM TOG 34(4), 2015, section 5.2.
#[inline]
pub fn reconnect(scene: &Scene, base: &Vertex, offset: &Vertex, target: &Vertex) -> Result<(Vec3, f64, Passage), ShiftFailure> {
    let (wi, jacobian) = turn(base.position, offset.position, target.position, target.normal).ok_or(ShiftFailure::LobeMismatch)?;
    let passage = passage_between(scene, offset, target);
    if !passage.is_open() {
        return Err(ShiftFailure::Occluded);
    }
    Ok((wi, jacobian, passage))
}
