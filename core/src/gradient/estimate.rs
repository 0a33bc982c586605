//! The gradient of one base path towards one neighbour: walks base and offset side by side and adds the joints' differences.

use super::offset::{Shared, There, advance, connected, copied, passage_known, scatter};
use super::pair::Pair;
use crate::material::Evaluation;
use crate::math::Vec3;
use crate::path::{Joint, OffsetEnd, OffsetStep, OffsetSubpath, Step, Strategy, Subpath};
use crate::scene::Scene;
use crate::spectrum::Spectrum;

/// Estimate of (neighbour − this pixel) from one base path, and the shadow rays that it took.
///
/// How each joint x = (x₀ … xₖ, light point) is shifted follows from xₖ and its offset alone, whichever strategy found it:
/// * the paths have rejoined: the joint is shared;
/// * both vertices are connectable: the offset connects to the same light point, and both strategies compete on both paths;
/// * else the half vector is copied and the offset ends where its own ray does: only walking competes, and joints found by
///   next-event estimation are left to it;
/// * the light has no extent: the offset connects, whatever the vertices are;
/// * there is no offset: the base counts alone, against zero.
pub fn difference(scene: &Scene, base: &Subpath, offset: &OffsetSubpath) -> (Spectrum, u32) {
    let mut pair = Pair::start(&base.camera.passage, &offset.camera);
    let mut sum = Spectrum::BLACK;
    let mut rays = 0;
    let mut joints = &base.joints[..];
    for (k, vertex) in base.vertices.iter().enumerate() {
        let here = joints.iter().take_while(|j| j.vertex as usize == k).count();
        let (at_vertex, rest) = joints.split_at(here);
        joints = rest;
        let step = base.steps.get(k);
        match offset.end {
            OffsetEnd::Rejoined { at } if at == k => {
                let before = offset.vertices[k - 1].position;
                return (sum + rejoined(scene, base, k, before, pair, at_vertex), rays);
            }
            OffsetEnd::Failed { at, .. } if at == k => {
                // T(x) is undefined from here on: contribution zero, weight one.
                let alone = Pair { offset: Spectrum::BLACK, ratio: 0.0, ..pair };
                return (sum + alone.shared(base.radiance[k]), rays);
            }
            _ => {}
        }
        let shifted = &offset.vertices[k];
        let connectable = vertex.connectable && shifted.connectable;
        // Only next-event estimation finds lights without extent, so these joints are connected however sharp the lobes are.
        for joint in at_vertex.iter().filter(|joint| connectable || joint.point.delta) {
            let known = passage_known(offset, base, k, joint);
            let there = connected(scene, vertex, shifted, joint, known, &mut rays);
            sum += weighed(pair, (joint.value(), f64::from(joint.density())), there) / joint.survival;
        }
        if !connectable && let Some(step) = step {
            let hit = at_vertex.iter().find(|j| j.strategy == Strategy::Hit);
            let value = hit.map_or(Spectrum::BLACK, Joint::value);
            let density = f64::from(step.evaluation.density) * f64::from(step.leg.passage.density);
            sum += weighed(pair, (value, density), copied(scene, offset, k, step)) / step.survival;
        }
        let (Some(step), Some(turned)) = (step, offset.steps.get(k)) else {
            if let Some(step) = step
                && let OffsetEnd::Failed { .. } = offset.end
            {
                pair = Pair { base: pair.base * step.weight(), offset: Spectrum::BLACK, ratio: 0.0 };
                continue;
            }
            break;
        };
        let there = scatter(scene, shifted, step, turned.wi);
        pair = on(pair, step, there, turned);
    }
    (sum, rays)
}

/// The weighted difference of a joint.
#[inline]
fn weighed(pair: Pair, here: (Spectrum, f64), there: There) -> Spectrum {
    pair.difference(here, (there.value, there.density), there.jacobian)
}

/// Takes both paths over a step.
#[inline]
fn on(pair: Pair, step: &Step, offset: Evaluation, turned: &OffsetStep) -> Pair {
    let (throughput, ratio) = advance((pair.offset, pair.ratio), step, offset, turned);
    Pair { base: pair.base * step.weight(), offset: throughput, ratio }
}

/// The first shared vertex sees the offset path come from elsewhere; beyond it everything is shared.
fn rejoined(scene: &Scene, base: &Subpath, k: usize, before: Vec3, pair: Pair, joints: &[Joint]) -> Spectrum {
    let shared = Shared::new(scene, &base.vertices[k], before);
    let mut sum = Spectrum::BLACK;
    for joint in joints {
        sum += weighed(pair, (joint.value(), f64::from(joint.density())), shared.joint(scene, joint)) / joint.survival;
    }
    if let Some(step) = base.steps.get(k)
        && let Some(radiance) = base.radiance.get(k + 1)
    {
        let (there, turned) = shared.step(scene, step);
        sum += on(pair, step, there, &turned).shared(*radiance);
    }
    sum
}
