//! Both directions of the shift measure the same difference, with opposite signs.
//!
//! With balance weights, x ↦ y = T(x) contributes (f(y)|T′| − f(x)) / (p(x) + |T′| p(y)) and y ↦ x the negative of it. That holds only
//! if the weights of both directions add up to 1, the Jacobians there and back are reciprocal, and every value and density of
//! the offset path is what the path itself would have: one number tests them all, through the code that renders.

use super::*;
use crate::gradient::difference;
use crate::light::LightPoint;
use crate::path::{Joint, Passage, Strategy, connect, passage_to_light};
use crate::spectrum::Spectrum;

/// Splits the joints of `base` into those that the shift maps, and gives `image` the joints that they map to.
///
/// A joint whose light point the offset cannot face has no image: it counts against zero, and nothing shifts back to it. A light
/// point in the vertex's own plane is left out: whether it is faced, and how much it weighs, is rounding (a lamp that lights itself).
fn carry_joints(case: &Case, base: &mut Subpath, image: &mut Subpath) {
    let (scene, offset) = (case.scene, case.offset);
    let own = offset.vertices.len();
    base.joints.clear();
    for k in 0..base.vertices.len() {
        let here = case.base.joints.iter().filter(|j| j.vertex as usize == k);
        if k >= own {
            for joint in here {
                base.joints.push(*joint);
                let vertex = &base.vertices[k];
                let (evaluation, decided) = if k == own {
                    let seen = image.vertices[k].seen_from(scene, offset.vertices[k - 1].position);
                    (seen.evaluate(scene, joint.wi), seen.lobe_probability / vertex.lobe_probability)
                } else {
                    (joint.evaluation, 1.0)
                };
                // Where the base path scatters nothing it did not look; the image may come from the other side.
                let unseen = joint.evaluation.is_none() && !evaluation.is_none();
                let passage = if unseen { passage_to_light(scene, &image.vertices[k], &joint.point) } else { joint.passage };
                image.joints.push(Joint { evaluation, light_density: joint.light_density * decided, passage, ..*joint });
            }
            continue;
        }
        let connectable = base.vertices[k].connectable && image.vertices[k].connectable;
        for joint in here.clone().filter(|joint| connectable || joint.point.delta) {
            let vertex = &image.vertices[k];
            let light_density = scene.lights.density(vertex.position, &joint.point) * vertex.lobe_probability;
            if edge_on(scene, &base.vertices[k], &joint.point) || edge_on(scene, vertex, &joint.point) {
                continue;
            }
            if let Some((wi, _)) = connect(&base.vertices[k], vertex, &joint.point)
                && light_density > 0.0
            {
                let evaluation = vertex.evaluate(scene, wi);
                let passage = if evaluation.is_none() { Passage::BLOCKED } else { passage_to_light(scene, vertex, &joint.point) };
                let radiance = scene.lights.radiance(&joint.point, vertex.position);
                base.joints.push(*joint);
                image.joints.push(Joint { wi, evaluation, light_density, passage, radiance, ..*joint });
            }
        }
        if !connectable {
            base.joints.extend(here.filter(|joint| !joint.point.delta));
            if let Some(step) = image.steps.get(k)
                && let Some(point) = offset.emitters.get(k + 1).copied().unwrap_or_else(|| scene.lights.at_infinity(step.wi))
            {
                let from = image.vertices[k].position;
                image.joints.push(Joint {
                    vertex: k as u32,
                    strategy: Strategy::Hit,
                    wi: step.wi,
                    point,
                    radiance: scene.lights.radiance(&point, from),
                    evaluation: step.evaluation,
                    light_density: 0.0,
                    passage: step.leg.passage,
                    survival: step.survival,
                });
            }
        }
    }
    base.gather();
    image.gather();
}

fn edge_on(scene: &Scene, vertex: &Vertex, point: &LightPoint) -> bool {
    !point.infinite && !point.delta && (point.position - vertex.position).dot(point.normal).abs() < 1e-4 * scene.world.bounds().radius()
}

fn size(s: Spectrum) -> f64 {
    f64::from(s.to_rgb().into_iter().map(f32::abs).fold(0.0, f32::max))
}

#[test]
fn differences_change_sign_with_the_direction() {
    let mut back = OffsetSubpath::default();
    let (mut shifts, mut told, mut apart) = (0usize, 0usize, 0usize);
    let mut worst = 0.0f64;
    each_shift(&ShiftKind::ALL, 24, 16, |case| {
        let Some(mut image) = image(case.scene, case.base, case.offset) else { return };
        // A path of density zero is never a base path; then it must be worth nothing, or its light would be lost.
        if let Some(step) = image.steps.iter().find(|s| s.evaluation.density * s.leg.passage.density <= 0.0) {
            assert!((step.evaluation.value * step.leg.passage.value).is_black(), "{}: worth something, but never found", case.place);
            return;
        }
        let mut base = case.base.clone();
        carry_joints(case, &mut base, &mut image);
        case.shift.shift(case.scene, &image, &case.here, &mut back);
        let (there, _) = difference(case.scene, &base, case.offset);
        let (again, _) = difference(case.scene, &image, &back);
        shifts += 1;
        let scale = size(base.primal()) + size(there) + size(again);
        if scale == 0.0 {
            return;
        }
        told += 1;
        let error = size(there + again) / scale;
        worst = worst.max(error);
        apart += usize::from(error > 1e-3);
        // Sharp lobes feel a turned direction most.
        let allowed = 1e-3 + rounding(case, distance(case.base, &back)) + 10.0 * bent(case, &back);
        assert!(error < allowed, "{}: {there:?} there, {again:?} back, apart by {error:e}, allowed {allowed:e}", case.place);
    });
    eprintln!("{shifts} shifts, {told} with light, {apart} apart by more than 1e-3, worst {worst:.1e}");
    // Rounding may excuse a few, but no more.
    assert!(told > 100_000 && apart * 20_000 < told);
}
