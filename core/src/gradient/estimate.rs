//! The gradient of one base path towards one neighbour: walks base and offset side by side and adds the joints' differences.

use super::pair::Pair;
use crate::light::LightPoint;
use crate::material::Evaluation;
use crate::math::Vec3;
use crate::path::{
    Joint, OffsetEnd, OffsetStep, OffsetSubpath, Passage, ShiftFailure, Step, Strategy, Subpath, Vertex, connect, passage_to_light,
};
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
            sum += connected(scene, vertex, shifted, joint, pair, known, &mut rays);
        }
        if !connectable && let Some(step) = step {
            let hit = at_vertex.iter().find(|j| j.strategy == Strategy::Hit);
            sum += copied(scene, offset, k, step, hit, pair);
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
        pair = advance(pair, step, there, turned);
    }
    (sum, rays)
}

/// What the offset vertex makes of a step: by the delta lobe where the base took one.
#[inline]
fn scatter(scene: &Scene, vertex: &Vertex, step: &Step, wi: Vec3) -> Evaluation {
    if step.delta { vertex.evaluate_delta(scene, step.transmits, wi) } else { vertex.evaluate(scene, wi) }
}

/// Takes both paths over a step. Roulette's survival is decided by the base path for both, and cancels in the ratio.
#[inline]
fn advance(pair: Pair, step: &Step, offset: Evaluation, turned: &OffsetStep) -> Pair {
    let density = step.evaluation.density * step.leg.passage.density;
    let OffsetStep { jacobian, passage, .. } = *turned;
    Pair {
        base: pair.base * step.weight(),
        offset: pair.offset * offset.value * passage.value * (jacobian as f32 / (density * step.survival)),
        ratio: pair.ratio * jacobian * (f64::from(offset.density) * f64::from(passage.density) / f64::from(density)),
    }
}

/// The first shared vertex sees the offset path come from elsewhere; beyond it everything is shared.
fn rejoined(scene: &Scene, base: &Subpath, k: usize, before: Vec3, pair: Pair, joints: &[Joint]) -> Spectrum {
    let vertex = &base.vertices[k];
    let shifted = vertex.seen_from(scene, before);
    let evaluate = |wi| shifted.evaluate(scene, wi);
    let decided = shifted.lobe_probability / vertex.lobe_probability;
    let mut sum = Spectrum::BLACK;
    for joint in joints {
        let there = Joint { evaluation: evaluate(joint.wi), light_density: joint.light_density * decided, ..*joint };
        let d = pair.difference((joint.value(), f64::from(joint.density())), (there.value(), f64::from(there.density())), 1.0);
        sum += d / joint.survival;
    }
    if let Some(step) = base.steps.get(k)
        && let Some(radiance) = base.radiance.get(k + 1)
    {
        let shared = OffsetStep { wi: step.wi, jacobian: 1.0, passage: step.leg.passage };
        sum += advance(pair, step, evaluate(step.wi), &shared).shared(*radiance);
    }
    sum
}

/// What lies between the offset and the light point that the base path hit, where the shift already found out.
#[inline]
fn passage_known(offset: &OffsetSubpath, base: &Subpath, k: usize, joint: &Joint) -> Option<Passage> {
    if joint.strategy != Strategy::Hit || !base.vertices.get(k + 1).is_some_and(|v| v.connectable) {
        return None;
    }
    match offset.end {
        OffsetEnd::Rejoined { at } if at == k + 1 => offset.steps.get(k).map(|step| step.passage),
        OffsetEnd::Failed { at, why: ShiftFailure::Occluded } if at == k + 1 => Some(Passage::BLOCKED),
        _ => None,
    }
}

/// Both vertices can connect: the offset path goes to the same light point.
#[inline]
fn connected(
    scene: &Scene,
    vertex: &Vertex,
    shifted: &Vertex,
    joint: &Joint,
    pair: Pair,
    known: Option<Passage>,
    rays: &mut u32,
) -> Spectrum {
    let mine = (joint.value(), f64::from(joint.density()));
    let nothing = (Spectrum::BLACK, 0.0);
    let d = match connect(vertex, shifted, &joint.point) {
        None => pair.difference(mine, nothing, 1.0),
        Some((wi, jacobian)) => {
            let light_density = scene.lights.density(shifted.position, &joint.point) * shifted.lobe_probability;
            if light_density > 0.0 {
                let evaluation = shifted.evaluate(scene, wi);
                let passage = if evaluation.is_none() {
                    Passage::BLOCKED
                } else {
                    known.unwrap_or_else(|| {
                        *rays += 1;
                        passage_to_light(scene, shifted, &joint.point)
                    })
                };
                let radiance = scene.lights.radiance(&joint.point, shifted.position);
                let there = Joint { evaluation, light_density, passage, radiance, ..*joint };
                pair.difference(mine, (there.value(), f64::from(there.density())), jacobian)
            } else {
                pair.difference(mine, nothing, 1.0)
            }
        }
    };
    d / joint.survival
}

/// The half vector is copied to the last step too: each path ends on the light that its own ray meets, if any.
#[inline]
fn copied(scene: &Scene, offset: &OffsetSubpath, k: usize, step: &Step, hit: Option<&Joint>, pair: Pair) -> Spectrum {
    let mine = hit.map_or(Spectrum::BLACK, Joint::value);
    let density = f64::from(step.evaluation.density) * f64::from(step.leg.passage.density);
    let shifted = &offset.vertices[k];
    let Some(turned) = offset.steps.get(k) else {
        return pair.difference((mine, density), (Spectrum::BLACK, 0.0), 1.0) / step.survival;
    };
    let met: Option<LightPoint> = match offset.emitters.get(k + 1) {
        Some(emitter) => *emitter,
        None => scene.lights.at_infinity(turned.wi),
    };
    let there = scatter(scene, shifted, step, turned.wi);
    let radiance = met.map_or(Spectrum::BLACK, |point| scene.lights.radiance(&point, shifted.position));
    let value = there.value * radiance * turned.passage.value;
    let there = (value, f64::from(there.density) * f64::from(turned.passage.density));
    let d = pair.difference((mine, density), there, turned.jacobian);
    d / step.survival
}
