//! The walk that shifts share: turn the offset path step by step beside the base path until both can join.
//!
//! What a shift has of its own is its [`Rule`]: where paths join, and how a step is turned until then.

use super::reconnection::reconnect;
use crate::light::LightPoint;
use crate::math::{Ray, Vec3};
use crate::medium::MediumId;
use crate::path::{Arrival, OffsetEnd, OffsetStep, OffsetSubpath, Passage, ShiftFailure, Step, Stop, Subpath, Vertex, follow};
use crate::sampling::SampleStream;
use crate::scene::Scene;

/// What becomes of an offset path at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Course {
    /// It joins the base path at its next vertex.
    Join,
    /// It goes on beside the base path.
    Walk,
    /// It cannot go on: the shift back would do something else.
    Never,
}

/// What a shift has of its own.
///
/// All of it must depend on both paths alike, so that the shift back from the offset path does the same.
pub(super) trait Rule: Send + Sync {
    /// Roughness at and above which a vertex is connectable.
    fn threshold(&self) -> f32;

    /// Whether the offset path joins at `target`, the base path's next vertex; `None` where the base path leaves the scene.
    fn course(&self, base: &Vertex, offset: &Vertex, target: Option<&Vertex>) -> Course;

    /// Decides about delta lobes at offset vertex `k`, as the base path did there. `None` where it cannot; else what
    /// [`turn`](Self::turn) needs to know of the decision.
    fn decide(&self, scene: &Scene, base: &Vertex, offset: &mut Vertex, k: usize, stream: &SampleStream) -> Option<f32>;

    /// Turns step `k` at the offset vertex: unit world direction, and the step's factor on |∂T/∂x|, > 0 [1].
    fn turn(&self, scene: &Scene, from: &Vertex, offset: &Vertex, turned: &Turn) -> Result<(Vec3, f64), ShiftFailure>;
}

/// A step that is to be turned.
pub(super) struct Turn<'a> {
    /// The base path's step.
    pub(super) step: &'a Step,
    /// Index of the vertex that it leaves.
    pub(super) k: usize,
    /// What [`Rule::decide`] gave there.
    pub(super) decision: f32,
    /// The numbers that the base path was drawn with.
    pub(super) stream: &'a SampleStream,
}

/// Where a leg led that was followed.
struct Followed {
    passage: Passage,
    /// The vertex at its end, and its light point; `None` where it left the scene.
    vertex: Option<(Vertex, Option<LightPoint>)>,
}

/// Follows a ray to where the base path's leg stopped. `None` where it cannot stop there.
#[inline]
fn follow_leg(scene: &Scene, ray: &Ray, medium: MediumId, stop: Stop, threshold: f32, out: &mut OffsetSubpath) -> Option<Followed> {
    out.rays += 1;
    let (passage, arrival) = follow(scene, ray, medium, stop)?;
    let vertex = Vertex::arrived(scene, &arrival, ray.direction, threshold).map(|vertex| {
        let emitter = match &arrival {
            Arrival::Surface(landing) => scene.light_point(&landing.surface),
            Arrival::Medium(_) | Arrival::Escaped => None,
        };
        (vertex, emitter)
    });
    Some(Followed { passage, vertex })
}

/// Shifts `base` along a camera ray by a rule.
#[inline]
pub(super) fn shift_by(rule: &impl Rule, scene: &Scene, base: &Subpath, camera: &Ray, out: &mut OffsetSubpath) {
    out.clear();
    let followed = follow_leg(scene, camera, scene.around, base.camera.stop, rule.threshold(), out);
    let Some(Followed { passage, vertex: Some((mut vertex, emitter)) }) = followed else {
        out.end = OffsetEnd::Failed { at: 0, why: ShiftFailure::Escaped };
        return;
    };
    out.camera = passage;
    let mut decided = base.vertices.first().map_or(Some(0.0), |first| rule.decide(scene, first, &mut vertex, 0, &base.stream));
    out.vertices.push(vertex);
    out.emitters.push(emitter);
    for (k, step) in base.steps.iter().enumerate() {
        // The light that the step before met does not depend on what the walk decides there, so that step stands either way.
        let Some(decision) = decided else {
            out.end = OffsetEnd::Failed { at: k, why: ShiftFailure::LobeMismatch };
            return;
        };
        let (from, to) = (&base.vertices[k], base.vertices.get(k + 1));
        let offset = out.vertices[k];
        let failed = |why| OffsetEnd::Failed { at: k + 1, why };
        match (rule.course(from, &offset, to), to) {
            (Course::Join, Some(target)) => {
                out.rays += 1;
                out.end = match reconnect(scene, from, &offset, target) {
                    Ok((wi, jacobian, passage)) => {
                        out.steps.push(OffsetStep { wi, jacobian, passage });
                        OffsetEnd::Rejoined { at: k + 1 }
                    }
                    Err(why) => failed(why),
                };
                return;
            }
            // Light at infinity: the joint reconnects, and nothing follows.
            (Course::Join, None) => return,
            (Course::Never, _) => {
                out.end = failed(ShiftFailure::Irreversible);
                return;
            }
            (Course::Walk, _) => {}
        }
        let (wi, jacobian) = match rule.turn(scene, from, &offset, &Turn { step, k, decision, stream: &base.stream }) {
            Ok(turned) => turned,
            Err(why) => {
                out.end = failed(why);
                return;
            }
        };
        let ray = offset.leave(wi);
        let Some(Followed { passage, vertex }) = follow_leg(scene, &ray, offset.medium_towards(wi), step.leg.stop, rule.threshold(), out)
        else {
            out.end = failed(ShiftFailure::Escaped);
            return;
        };
        // The shift back stands before the same choice, with the offset's next vertex as its target.
        let back = rule.course(&offset, from, vertex.as_ref().map(|(vertex, _)| vertex));
        match (vertex, to) {
            (None, Some(_)) | (Some(_), None) => {
                out.end = failed(ShiftFailure::Escaped);
                return;
            }
            _ if back != Course::Walk => {
                out.end = failed(ShiftFailure::Irreversible);
                return;
            }
            (Some((mut vertex, emitter)), Some(target)) => {
                decided = rule.decide(scene, target, &mut vertex, k + 1, &base.stream);
                out.steps.push(OffsetStep { wi, jacobian, passage });
                out.vertices.push(vertex);
                out.emitters.push(emitter);
            }
            (None, None) => {
                out.steps.push(OffsetStep { wi, jacobian, passage });
                out.end = OffsetEnd::Followed { escaped: true };
                return;
            }
        }
    }
    if decided.is_none() {
        out.end = OffsetEnd::Failed { at: out.vertices.len() - 1, why: ShiftFailure::LobeMismatch };
    }
}
