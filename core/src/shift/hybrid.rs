//! The shift of gradient-domain path tracing: reconnect at the first chance, copy half vectors until then.
//!
//! # Source
//! Kettunen et al., "Gradient-Domain Path Tracing", ACM TOG 34(4), 2015, section 5.2.

use super::half_vector::half_vector;
use super::reconnection::reconnect;
use crate::light::LightPoint;
use crate::math::Ray;
use crate::medium::MediumId;
use crate::path::{Arrival, OffsetEnd, OffsetStep, OffsetSubpath, Passage, ShiftFailure, ShiftMap, Stop, Subpath, Vertex, follow};
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

impl HybridShift {
    /// Follows a ray to where the base path's leg stopped. `None` where it cannot stop there; no vertex where both left the scene.
    #[inline]
    fn follow(&self, scene: &Scene, ray: &Ray, medium: MediumId, stop: Stop, out: &mut OffsetSubpath) -> Option<Followed> {
        out.rays += 1;
        let (passage, arrival) = follow(scene, ray, medium, stop)?;
        let vertex = Vertex::arrived(scene, &arrival, ray.direction, self.threshold).map(|vertex| {
            let emitter = match &arrival {
                Arrival::Surface(landing) => scene.light_point(&landing.surface),
                Arrival::Medium(_) | Arrival::Escaped => None,
            };
            (vertex, emitter)
        });
        Some(Followed { passage, vertex })
    }
}

/// Where a leg led that was followed.
struct Followed {
    passage: Passage,
    /// The vertex at its end, and its light point.
    vertex: Option<(Vertex, Option<LightPoint>)>,
}

impl ShiftMap for HybridShift {
    fn shift(&self, scene: &Scene, base: &Subpath, camera: &Ray, out: &mut OffsetSubpath) {
        out.clear();
        let followed = self.follow(scene, camera, scene.around, base.camera.stop, out);
        let Some(Followed { passage, vertex: Some((mut vertex, emitter)) }) = followed else {
            out.end = OffsetEnd::Failed { at: 0, why: ShiftFailure::Escaped };
            return;
        };
        out.camera = passage;
        let possible = base.vertices.first().is_none_or(|first| vertex.decide_as(scene, first.delta));
        out.vertices.push(vertex);
        out.emitters.push(emitter);
        if !possible {
            out.end = OffsetEnd::Failed { at: 0, why: ShiftFailure::LobeMismatch };
            return;
        }
        for (k, step) in base.steps.iter().enumerate() {
            let (from, to) = (&base.vertices[k], base.vertices.get(k + 1));
            let offset = out.vertices[k];
            let own = match self.chance {
                Chance::Common => from.connectable && offset.connectable,
                Chance::Own => from.connectable,
            };
            // Light at infinity is connectable.
            if own && !offset.connectable && to.is_none_or(|target| target.connectable) {
                out.end = OffsetEnd::Failed { at: k + 1, why: ShiftFailure::Irreversible };
                return;
            }
            match to {
                Some(target) if own && target.connectable => {
                    out.rays += 1;
                    out.end = match reconnect(scene, from, &offset, target) {
                        Ok((wi, jacobian, passage)) => {
                            out.steps.push(OffsetStep { wi, jacobian, passage });
                            OffsetEnd::Rejoined { at: k + 1 }
                        }
                        Err(why) => OffsetEnd::Failed { at: k + 1, why },
                    };
                    return;
                }
                // The joint reconnects, and nothing follows.
                None if own => return,
                _ => {}
            }
            // The shift back would reconnect here, if the next vertex is connectable too.
            let back = offset.connectable && (own || self.chance == Chance::Own);
            let failed = |why| OffsetEnd::Failed { at: k + 1, why };
            let (wi, jacobian) = match half_vector(scene, from, step, &offset) {
                Ok(turned) => turned,
                Err(why) => {
                    out.end = failed(why);
                    return;
                }
            };
            let Some(Followed { passage, vertex }) = self.follow(scene, &offset.leave(wi), offset.medium_towards(wi), step.leg.stop, out)
            else {
                out.end = failed(ShiftFailure::Escaped);
                return;
            };
            match (vertex, to) {
                (Some((mut vertex, emitter)), Some(target)) => {
                    // The light that this step met does not depend on what the walk decides there, so the step stands either way.
                    let possible = vertex.decide_as(scene, target.delta);
                    if back && vertex.connectable {
                        out.end = failed(ShiftFailure::Irreversible);
                        return;
                    }
                    out.steps.push(OffsetStep { wi, jacobian, passage });
                    out.vertices.push(vertex);
                    out.emitters.push(emitter);
                    if !possible {
                        out.end = OffsetEnd::Failed { at: k + 1, why: ShiftFailure::LobeMismatch };
                        return;
                    }
                }
                (None, None) if back => {
                    out.end = failed(ShiftFailure::Irreversible);
                    return;
                }
                (None, None) => {
                    out.steps.push(OffsetStep { wi, jacobian, passage });
                    out.end = OffsetEnd::Followed { escaped: true };
                    return;
                }
                (None, Some(_)) | (Some(_), None) => {
                    out.end = failed(ShiftFailure::Escaped);
                    return;
                }
            }
        }
    }
}
