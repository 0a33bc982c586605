//! The shift of gradient-domain path tracing: reconnect at the first chance, copy half vectors until then.
//!
//! # Source
//! Kettunen et al., "Gradient-Domain Path Tracing", ACM TOG 34(4), 2015, section 5.2.

use super::chain::{Course, Rule, Turn, shift_by};
use super::half_vector::half_vector;
use crate::math::{Ray, Vec3};
use crate::path::{OffsetSubpath, ShiftFailure, ShiftMap, Subpath, Vertex};
use crate::sampling::SampleStream;
use crate::scene::Scene;

/// Reconnects at the first chance and copies half vectors until then; where the shift back would not do the same, it fails.
#[derive(Clone, Copy, Debug)]
pub struct HybridShift {
    /// Roughness at and above which a vertex is connectable.
    pub threshold: f32,
    /// What a chance is.
    pub chance: Chance,
}

/// Where the hybrid shift may reconnect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chance {
    /// Where base vertex, offset vertex and next base vertex are all connectable: the most shifts succeed.
    Common,
    /// Where vertex and next vertex of the base path are connectable; the offset path must have its first such pair at the same
    /// place. A property of each path alone, so that shifts compose: from i to k and on to m leads where i to m does.
    Own,
}

impl ShiftMap for HybridShift {
    fn shift(&self, scene: &Scene, base: &Subpath, camera: &Ray, out: &mut OffsetSubpath) {
        shift_by(self, scene, base, camera, out);
    }
}

impl Rule for HybridShift {
    fn threshold(&self) -> f32 {
        self.threshold
    }

    #[inline]
    fn course(&self, base: &Vertex, offset: &Vertex, target: Option<&Vertex>) -> Course {
        // Light at infinity is connectable.
        let own = base.connectable && target.is_none_or(|target| target.connectable);
        match (own, offset.connectable, self.chance) {
            (true, true, _) => Course::Join,
            (true, false, Chance::Own) => Course::Never,
            _ => Course::Walk,
        }
    }

    #[inline]
    fn decide(&self, scene: &Scene, base: &Vertex, offset: &mut Vertex, _: usize, _: &SampleStream) -> Option<f32> {
        offset.decide_as(scene, base.delta).then_some(0.0)
    }

    #[inline]
    fn turn(&self, scene: &Scene, from: &Vertex, offset: &Vertex, turned: &Turn) -> Result<(Vec3, f64), ShiftFailure> {
        half_vector(scene, from, turned.step, offset)
    }
}
