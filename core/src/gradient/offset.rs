//! What a joint or a step of the base path is worth on an offset path: value, density and Jacobian.

use crate::light::LightPoint;
use crate::material::Evaluation;
use crate::math::Vec3;
use crate::path::{
    Joint, OffsetEnd, OffsetStep, OffsetSubpath, Passage, ShiftFailure, Step, Strategy, Subpath, Vertex, connect, passage_to_light,
};
use crate::scene::Scene;
use crate::spectrum::Spectrum;

/// A joint on the offset path, for unit throughput up to its vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct There {
    /// Scattering times radiance times what gets through.
    pub(super) value: Spectrum,
    /// Density, summed over the strategies that compete for the joint.
    pub(super) density: f64,
    /// Factor on |T′| by the joint [1].
    pub(super) jacobian: f64,
}

impl There {
    /// The joint has no image.
    pub(super) const NOTHING: There = There { value: Spectrum::BLACK, density: 0.0, jacobian: 1.0 };

    fn of(joint: &Joint, jacobian: f64) -> There {
        There { value: joint.value(), density: f64::from(joint.density()), jacobian }
    }
}

/// What the offset vertex makes of a step: by the delta lobe where the base took one.
#[inline]
pub(super) fn scatter(scene: &Scene, vertex: &Vertex, step: &Step, wi: Vec3) -> Evaluation {
    if step.delta { vertex.evaluate_delta(scene, step.transmits, wi) } else { vertex.evaluate(scene, wi) }
}

/// What lies between the offset and the light point that the base path hit, where the shift already found out.
#[inline]
pub(super) fn passage_known(offset: &OffsetSubpath, base: &Subpath, k: usize, joint: &Joint) -> Option<Passage> {
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
pub(super) fn connected(scene: &Scene, vertex: &Vertex, shifted: &Vertex, joint: &Joint, known: Option<Passage>, rays: &mut u32) -> There {
    let Some((wi, jacobian)) = connect(vertex, shifted, &joint.point) else { return There::NOTHING };
    let light_density = scene.lights.density(shifted.position, &joint.point) * shifted.lobe_probability;
    // The path must be one that next-event estimation could have found.
    if light_density <= 0.0 {
        return There::NOTHING;
    }
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
    There::of(&Joint { evaluation, light_density, passage, radiance, ..*joint }, jacobian)
}

/// The half vector is copied to the last step too: each path ends on the light that its own ray meets, if any.
#[inline]
pub(super) fn copied(scene: &Scene, offset: &OffsetSubpath, k: usize, step: &Step) -> There {
    let Some(turned) = offset.steps.get(k) else { return There::NOTHING };
    let shifted = &offset.vertices[k];
    let met: Option<LightPoint> = match offset.emitters.get(k + 1) {
        Some(emitter) => *emitter,
        None => scene.lights.at_infinity(turned.wi),
    };
    let there = scatter(scene, shifted, step, turned.wi);
    let radiance = met.map_or(Spectrum::BLACK, |point| scene.lights.radiance(&point, shifted.position));
    There {
        value: there.value * radiance * turned.passage.value,
        density: f64::from(there.density) * f64::from(turned.passage.density),
        jacobian: turned.jacobian,
    }
}

/// The first vertex that both paths share, as the offset path comes to it from `before`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared {
    seen: Vertex,
    /// How much likelier the offset path decides its kind of lobe as the base path did.
    decided: f32,
}

impl Shared {
    #[inline]
    pub(super) fn new(scene: &Scene, vertex: &Vertex, before: Vec3) -> Shared {
        let seen = vertex.seen_from(scene, before);
        Shared { seen, decided: seen.lobe_probability / vertex.lobe_probability }
    }

    /// A joint at this vertex.
    #[inline]
    pub(super) fn joint(&self, scene: &Scene, joint: &Joint) -> There {
        let evaluation = self.seen.evaluate(scene, joint.wi);
        // The base path need not have looked where it scatters nothing; the offset path may come from the other side of a thin wall.
        let unseen = joint.evaluation.is_none() && !evaluation.is_none();
        let passage = if unseen { passage_to_light(scene, &self.seen, &joint.point) } else { joint.passage };
        There::of(&Joint { evaluation, light_density: joint.light_density * self.decided, passage, ..*joint }, 1.0)
    }

    /// The step that leads on.
    #[inline]
    pub(super) fn step(&self, scene: &Scene, step: &Step) -> (Evaluation, OffsetStep) {
        let turned = OffsetStep { wi: step.wi, jacobian: 1.0, passage: step.leg.passage };
        (self.seen.evaluate(scene, step.wi), turned)
    }
}

/// The factors of a step on throughput and density of the offset path, both relative to the base path's density.
///
/// Roulette's survival is decided by the base path for both: it divides the throughput and cancels in the ratio of densities.
#[inline]
pub(super) fn advance((throughput, ratio): (Spectrum, f64), step: &Step, offset: Evaluation, turned: &OffsetStep) -> (Spectrum, f64) {
    let density = step.evaluation.density * step.leg.passage.density;
    let OffsetStep { jacobian, passage, .. } = *turned;
    (
        throughput * offset.value * passage.value * (jacobian as f32 / (density * step.survival)),
        ratio * jacobian * (f64::from(offset.density) * f64::from(passage.density) / f64::from(density)),
    )
}
