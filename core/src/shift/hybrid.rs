//! The shift of gradient-domain path tracing: reconnect at the first chance, copy half vectors until then.
//!
//! # Source
//! Kettunen et al., "Gradient-Domain Path Tracing", ACM TOG 34(4), 2015, section 5.2.

use super::half_vector::half_vector;
use super::reconnection::reconnect;
use crate::light::LightPoint;
use crate::math::Ray;
use crate::path::{OffsetEnd, OffsetStep, OffsetSubpath, ShiftFailure, ShiftMap, Subpath, Vertex};
use crate::scene::Scene;

/// Reconnects where base vertex, offset vertex and next base vertex are all connectable, and copies the half vector elsewhere.
///
/// The choice depends on both paths alike, so that the shift back from the offset path makes the same one; where it would not, the shift fails.
#[derive(Clone, Copy, Debug)]
pub struct HybridShift {
    /// Roughness at and above which a vertex is connectable.
    pub threshold: f32,
}

impl HybridShift {
    /// The vertex where a ray meets a surface, and its light point.
    #[inline]
    fn follow(&self, scene: &Scene, ray: &Ray, out: &mut OffsetSubpath) -> Option<(Vertex, Option<LightPoint>)> {
        out.rays += 1;
        let surface = scene.trace(ray)?;
        Some((Vertex::new(scene, &surface, ray.direction, self.threshold), scene.light_point(&surface)))
    }
}

impl ShiftMap for HybridShift {
    fn shift(&self, scene: &Scene, base: &Subpath, camera: &Ray, out: &mut OffsetSubpath) {
        out.clear();
        let Some((mut vertex, emitter)) = self.follow(scene, camera, out) else {
            out.end = OffsetEnd::Failed { at: 0, why: ShiftFailure::Escaped };
            return;
        };
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
            let both = from.connectable && offset.connectable;
            match to {
                Some(target) if both && target.connectable => {
                    out.rays += 1;
                    out.end = match reconnect(scene, from, &offset, target) {
                        Ok((wi, jacobian)) => {
                            out.steps.push(OffsetStep { wi, jacobian });
                            OffsetEnd::Rejoined { at: k + 1 }
                        }
                        Err(why) => OffsetEnd::Failed { at: k + 1, why },
                    };
                    return;
                }
                // Light at infinity is connectable: the joint reconnects, and nothing follows.
                None if both => return,
                _ => {}
            }
            let failed = |why| OffsetEnd::Failed { at: k + 1, why };
            let (wi, jacobian) = match half_vector(scene, from, step, &offset) {
                Ok(turned) => turned,
                Err(why) => {
                    out.end = failed(why);
                    return;
                }
            };
            let met = self.follow(scene, &offset.leave(wi), out);
            match (met, to) {
                (Some((mut vertex, emitter)), Some(target)) => {
                    // The light that this step met does not depend on what the walk decides there, so the step stands either way.
                    let possible = vertex.decide_as(scene, target.delta);
                    if both && vertex.connectable {
                        // The shift back would reconnect here.
                        out.end = failed(ShiftFailure::LobeMismatch);
                        return;
                    }
                    out.steps.push(OffsetStep { wi, jacobian });
                    out.vertices.push(vertex);
                    out.emitters.push(emitter);
                    if !possible {
                        out.end = OffsetEnd::Failed { at: k + 1, why: ShiftFailure::LobeMismatch };
                        return;
                    }
                }
                (None, None) => {
                    out.steps.push(OffsetStep { wi, jacobian });
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
