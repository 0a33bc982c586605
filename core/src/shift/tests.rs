//! Laws of the shift, on thousands of base paths through every test scene: it can be undone, its Jacobian is its determinant,
//! and what it measures in one direction is what it measures in the other.

mod antisymmetry;
mod chain;
mod composition;
mod inverse;
mod jacobian;

use super::{ShiftKind, build};
use crate::integrator::PathIntegrator;
use crate::lattice::{Extent, Offset};
use crate::math::Ray;
use crate::path::{Integrator, Leg, OffsetEnd, OffsetSubpath, ShiftMap, Step, Subpath, Vertex};
use crate::sampling::{Dimension, SampleKey, SampleStream};
use crate::scene::Scene;
use crate::testing::scenes;

/// Roughness thresholds of the suite: the one that plans use, and one that makes the rough test materials count as sharp.
const THRESHOLDS: [f32; 2] = [0.001, 0.3];

/// A base path and its shift to a neighbour.
struct Case<'a> {
    scene: &'a Scene,
    shift: &'a dyn ShiftMap,
    threshold: f32,
    base: &'a Subpath,
    offset: &'a OffsetSubpath,
    /// The camera ray of the base path.
    here: Ray,
    /// The camera ray of the offset path.
    there: Ray,
    /// Where in the suite this is, for messages.
    place: String,
}

/// Visits shifts of `samples` base paths a pixel, to each neighbour, for every scene and threshold. Coarse films have far neighbours, fine ones near.
fn each_shift(kinds: &[ShiftKind], edge: u32, samples: u32, mut visit: impl FnMut(&Case)) {
    for (name, scene) in &scenes() {
        for (kind, threshold) in kinds.iter().flat_map(|kind| THRESHOLDS.map(|threshold| (*kind, threshold))) {
            let view = scene.sensor.view(Extent { width: edge, height: edge });
            let integrator = PathIntegrator { max_depth: 7, roulette_depth: 4, shift_threshold: threshold };
            let shift = build(kind, threshold);
            let (mut base, mut offset) = (Subpath::default(), OffsetSubpath::default());
            for pixel in 0..edge * edge {
                let (x, y) = (pixel % edge, pixel / edge);
                for index in 0..samples {
                    let stream = SampleStream::open(SampleKey { seed: 11, frame: 0, x, y, index });
                    let [u, v] = stream.pair(Dimension::PIXEL);
                    let lens = stream.pair(Dimension::LENS);
                    let film = [x as f32 + u, y as f32 + v];
                    let here = view.ray(film, lens);
                    integrator.generate(scene, &here, &stream, &mut base);
                    if base.vertices.is_empty() {
                        continue;
                    }
                    for neighbour in Offset::IMAGE {
                        let (dx, dy) = neighbour.displacement();
                        let there = view.ray([film[0] + dx as f32, film[1] + dy as f32], lens);
                        shift.shift(scene, &base, &there, &mut offset);
                        let place =
                            format!("{name}, {}, threshold {threshold}, pixel ({x}, {y}), sample {index}, to ({dx}, {dy})", kind.name());
                        visit(&Case { scene, shift: shift.as_ref(), threshold, base: &base, offset: &offset, here, there, place });
                    }
                }
            }
        }
    }
}

/// The offset path as a base path of its own, without joints: its vertices and steps, then the tail that it shares. `None` where the shift failed.
fn image(scene: &Scene, base: &Subpath, offset: &OffsetSubpath) -> Option<Subpath> {
    let own = match offset.end {
        OffsetEnd::Failed { .. } => return None,
        OffsetEnd::Rejoined { at } => at,
        OffsetEnd::Followed { .. } => offset.vertices.len(),
    };
    let camera = Leg { passage: offset.camera, ..base.camera };
    let mut image = Subpath { camera, vertices: offset.vertices.clone(), stream: base.stream, ..Subpath::default() };
    image.vertices.extend(base.vertices.iter().skip(own));
    for (k, step) in base.steps.iter().enumerate() {
        let vertex = &image.vertices[k];
        // Past the shift's own steps directions are shared, the one that leaves the scene between connectable vertices included.
        let wi = offset.steps.get(k).map_or(step.wi, |turned| turned.wi);
        let evaluation = if k == own {
            vertex.seen_from(scene, offset.vertices[k - 1].position).evaluate(scene, wi)
        } else if k > own {
            step.evaluation
        } else if step.delta {
            vertex.evaluate_delta(scene, step.transmits, wi)
        } else {
            vertex.evaluate(scene, wi)
        };
        let transmits = if k < own { vertex.wo.z * vertex.frame.normal.dot(wi) < 0.0 } else { step.transmits };
        let passage = offset.steps.get(k).map_or(step.leg.passage, |turned| turned.passage);
        image.steps.push(Step { wi, evaluation, transmits, leg: Leg { passage, ..step.leg }, ..*step });
    }
    Some(image)
}

/// How far the vertices of `back` lie from those of the base path [scene units].
fn distance(base: &Subpath, back: &OffsetSubpath) -> f64 {
    back.vertices.iter().zip(&base.vertices).map(|(a, b)| f64::from(a.position.distance(b.position))).fold(0.0, f64::max)
}

/// Relative error that rounding alone may give a Jacobian, where vertices stray from their places by this much [scene units].
///
/// Following a chain of mirrors and lenses magnifies the rounding of f32, so that the way back ends a little beside the base
/// path. Reconnection then divides by the height of a vertex over the tangent plane of the target: where a curved mirror all
/// but touches a wall, that height is as small as the rounding.
fn rounding(case: &Case, strayed: f64) -> f64 {
    let OffsetEnd::Rejoined { at } = case.offset.end else { return 0.0 };
    let target = &case.base.vertices[at];
    let height = |v: &Vertex| f64::from((target.position - v.position).dot(target.normal).abs());
    let lowest = height(&case.base.vertices[at - 1]).min(height(&case.offset.vertices[at - 1]));
    4.0 * (strayed + unit(case.scene)) / lowest
}

/// How far rounding may turn a direction of the way back: most across a short edge in a corner.
///
/// A ray starts off its surface by the bound on the vertex's rounding, a segment between two vertices does not.
fn bent(case: &Case, back: &OffsetSubpath) -> f64 {
    let edges = case.base.vertices.windows(2).map(|e| f64::from(e[0].position.distance(e[1].position)));
    4.0 * (distance(case.base, back) + 16.0 * unit(case.scene)) / edges.fold(1.0, f64::min)
}

/// The rounding of a position [scene units].
fn unit(scene: &Scene) -> f64 {
    f64::from(scene.world.bounds().radius() * f32::EPSILON)
}
