//! Reconnection: the offset path goes straight to a vertex of the base path.

use super::chain::{Course, Rule, Turn, shift_by};
use crate::math::{Ray, Vec3};
use crate::path::{OffsetSubpath, Passage, ShiftFailure, ShiftMap, Subpath, Vertex, passage_between, turn};
use crate::sampling::SampleStream;
use crate::scene::Scene;

/// Reconnects at the first vertex of both paths, or fails: the cheapest shift, for scenes without mirrors.
///
/// Where the first vertex of either path takes a delta lobe, or the base path's second is none to join at, base and offset count
/// against zero.
#[derive(Clone, Copy, Debug)]
pub struct ReconnectionShift {
    /// Roughness at and above which a vertex is connectable.
    pub threshold: f32,
}

impl ShiftMap for ReconnectionShift {
    fn shift(&self, scene: &Scene, base: &Subpath, camera: &Ray, out: &mut OffsetSubpath) {
        shift_by(self, scene, base, camera, out);
    }
}

impl Rule for ReconnectionShift {
    fn threshold(&self) -> f32 {
        self.threshold
    }

    #[inline]
    fn course(&self, base: &Vertex, offset: &Vertex, target: Option<&Vertex>) -> Course {
        let joins = base.connectable && offset.connectable && target.is_none_or(|target| target.connectable);
        if joins { Course::Join } else { Course::Never }
    }

    #[inline]
    fn decide(&self, scene: &Scene, base: &Vertex, offset: &mut Vertex, _: usize, _: &SampleStream) -> Option<f32> {
        offset.decide_as(scene, base.delta).then_some(0.0)
    }

    fn turn(&self, _: &Scene, _: &Vertex, _: &Vertex, _: &Turn) -> Result<(Vec3, f64), ShiftFailure> {
        Err(ShiftFailure::Irreversible)
    }
}

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
