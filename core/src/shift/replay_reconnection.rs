//! Replay, then reconnection: the offset path takes the base path's numbers until both are rough and far enough to join.
//!
//! Joining is bad where a lobe is sharp, and where the edge is short: then a small displacement turns it far, and |T′| and the
//! lobe's value with it. How far is told by the displacement of the two vertices that are joined to the same target. It is the
//! footprint of the pixel carried to that place, so that the criterion needs no length of its own and no scale of the scene.

use super::chain::{Course, Rule, Turn, shift_by};
use super::replay::{decide, replay};
use crate::math::{Ray, Vec3};
use crate::path::{OffsetSubpath, ShiftFailure, ShiftMap, Subpath, Vertex};
use crate::sampling::SampleStream;
use crate::scene::Scene;

/// Replays until base vertex, offset vertex and next base vertex are all connectable, and both edges to the latter are at least
/// `stretch` times as long as the displacement between the former two.
///
/// # Source
/// Lin et al., "Generalized Resampled Importance Sampling", ACM TOG 41(4), 2022, section 7: replay, then reconnection, there by fixed
/// roughness and distance.
#[derive(Clone, Copy, Debug)]
pub struct ReplayReconnectionShift {
    /// Roughness at and above which a vertex is connectable.
    pub threshold: f32,
    /// Least length of an edge that joins over the displacement of its start [1].
    pub stretch: f32,
}

impl ShiftMap for ReplayReconnectionShift {
    fn shift(&self, scene: &Scene, base: &Subpath, camera: &Ray, out: &mut OffsetSubpath) {
        shift_by(self, scene, base, camera, out);
    }
}

impl Rule for ReplayReconnectionShift {
    fn threshold(&self) -> f32 {
        self.threshold
    }

    #[inline]
    fn course(&self, base: &Vertex, offset: &Vertex, target: Option<&Vertex>) -> Course {
        let joins = base.connectable
            && offset.connectable
            && target.is_none_or(|target| target.connectable && is_far(base, offset, target, self.stretch));
        if joins { Course::Join } else { Course::Walk }
    }

    #[inline]
    fn decide(&self, scene: &Scene, base: &Vertex, offset: &mut Vertex, k: usize, stream: &SampleStream) -> Option<f32> {
        decide(scene, base, offset, k, stream)
    }

    #[inline]
    fn turn(&self, scene: &Scene, _: &Vertex, offset: &Vertex, turned: &Turn) -> Result<(Vec3, f64), ShiftFailure> {
        replay(scene, offset, turned)
    }
}

/// Whether both edges to `target` are at least `stretch` times as long as the displacement of their starts.
#[inline]
pub(super) fn is_far(base: &Vertex, offset: &Vertex, target: &Vertex, stretch: f32) -> bool {
    let displacement = base.position.distance_squared(offset.position);
    let edges = base.position.distance_squared(target.position).min(offset.position.distance_squared(target.position));
    edges >= stretch * stretch * displacement
}
