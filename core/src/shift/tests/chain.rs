//! The product of a chain's Jacobians is the determinant of the whole map, from all directions that the base path was free to
//! take to those of the offset path. Delta lobes leave no freedom: their directions follow from the vertices before.

use super::jacobian::Chart;
use super::*;
use crate::path::follow;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Walks the first `steps` again, with these directions where the base path was free. `None` where the walk meets other materials.
fn walk(case: &Case, steps: &[Step], free: &[DVec3]) -> Option<Subpath> {
    let threshold = case.threshold;
    let mut out = Subpath { camera: case.base.camera, ..Subpath::default() };
    let mut ray = case.here;
    let mut free = free.iter();
    let mut medium = case.scene.around;
    for k in 0..=steps.len() {
        let stop = if k == 0 { case.base.camera.stop } else { steps[k - 1].leg.stop };
        let (_, arrival) = follow(case.scene, &ray, medium, stop)?;
        let Some(mut vertex) = Vertex::arrived(case.scene, &arrival, ray.direction, threshold) else {
            // The base path leaves the scene with its last step, or nowhere.
            return (k == steps.len() && case.base.vertices.len() == k).then_some(out);
        };
        let there = case.base.vertices.get(k)?;
        if there.matter != vertex.matter || !vertex.decide_as(case.scene, there.delta) {
            return None;
        }
        out.vertices.push(vertex);
        let Some(step) = steps.get(k) else { break };
        let wi = if step.delta {
            let choice = if step.transmits { 1.0 } else { 0.0 };
            let scatter = vertex.sample(case.scene, choice, [0.5; 2])?;
            let crosses = vertex.wo.z * vertex.frame.normal.dot(scatter.wi) < 0.0;
            (crosses == step.transmits).then_some(scatter.wi)?
        } else {
            free.next()?.as_vec3().normalize()
        };
        let transmits = vertex.wo.z * vertex.frame.normal.dot(wi) < 0.0;
        if transmits != step.transmits {
            return None;
        }
        out.steps.push(Step { wi, transmits, ..*step });
        ray = vertex.leave(wi);
        medium = vertex.medium_towards(wi);
    }
    Some(out)
}

/// Directions of the offset path that it was free to take.
fn freedom(steps: &[Step], offset: &OffsetSubpath) -> Vec<DVec3> {
    offset.steps.iter().zip(steps).filter(|(_, step)| !step.delta).map(|(turned, _)| turned.wi.as_dvec3()).collect()
}

/// |det| by elimination with pivots.
fn determinant(mut rows: Vec<Vec<f64>>) -> f64 {
    let mut product = 1.0;
    for k in 0..rows.len() {
        let pivot = (k..rows.len()).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs())).unwrap();
        rows.swap(k, pivot);
        let top = rows[k].clone();
        product *= top[k];
        for row in &mut rows[k + 1..] {
            let factor = row[k] / top[k];
            row.iter_mut().zip(&top).for_each(|(v, t)| *v -= factor * t);
        }
    }
    product.abs()
}

/// Numeric |det| of the map with steps of `h`, leading truncation error removed.
fn numeric(case: &Case, steps: &[Step], h: f64) -> Option<f64> {
    let from: Vec<Chart> = steps.iter().filter(|s| !s.delta).map(|s| Chart::new(s.wi)).collect();
    let to: Vec<Chart> = freedom(steps, case.offset).iter().map(|w| Chart::new(w.as_vec3())).collect();
    let mut found = OffsetSubpath::default();
    let mut map = |free: usize, by: DVec2| -> Option<Vec<f64>> {
        let directions: Vec<DVec3> = from.iter().enumerate().map(|(k, c)| c.direction(if k == free { by } else { DVec2::ZERO })).collect();
        let moved = walk(case, steps, &directions)?;
        case.shift.shift(case.scene, &moved, &case.there, &mut found);
        let same_way = found.end == case.offset.end && found.vertices.iter().zip(&case.offset.vertices).all(|(a, b)| a.matter == b.matter);
        same_way.then(|| freedom(steps, &found).iter().zip(&to).flat_map(|(w, chart)| chart.coordinates(*w).to_array()).collect())
    };
    let mut rows = Vec::new();
    for free in 0..from.len() {
        for axis in [DVec2::X, DVec2::Y] {
            let mut slope = |h: f64| -> Option<Vec<f64>> {
                let (ahead, behind) = (map(free, axis * h)?, map(free, axis * -h)?);
                Some(ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * h)).collect())
            };
            let (coarse, fine) = (slope(h)?, slope(0.5 * h)?);
            rows.push(coarse.iter().zip(&fine).map(|(c, f)| (4.0 * f - c) / 3.0).collect());
        }
    }
    Some(determinant(rows))
}

#[test]
fn chains_have_their_determinant() {
    let mut compared: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let (mut tried, mut unclear) = (0, 0);
    // Replay has its determinant in the space of random numbers.
    each_shift(&[ShiftKind::Hybrid, ShiftKind::Reconnection], 16, 3, |case| {
        let steps = &case.base.steps[..case.offset.steps.len()];
        let free = steps.iter().filter(|s| !s.delta).count();
        if image(case.scene, case.base, case.offset).is_none() || free == 0 {
            return;
        }
        // To join a path inside a medium moves its distance too: three dimensions, which have a test of their own.
        if matches!(case.offset.end, OffsetEnd::Rejoined { at } if case.base.vertices[at].medium().is_some()) {
            return;
        }
        tried += 1;
        let product: f64 = case.offset.steps.iter().map(|s| s.jacobian).product();
        // The more a chain bends light, the smaller the steps must be, and the more rounding they carry: the steadiest wins.
        let best = [0.01, 0.003, 0.001]
            .into_iter()
            .filter_map(|h| {
                let (coarse, fine) = (numeric(case, steps, h)?, numeric(case, steps, 0.5 * h)?);
                Some((fine, (fine - coarse).abs()))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((value, uncertainty)) = best.filter(|(value, uncertainty)| *uncertainty < 0.02 * value) else {
            unclear += 1;
            return;
        };
        let allowed = (5e-3 + rounding(case, 16.0 * unit(case.scene))) * value + 5.0 * uncertainty;
        assert!((product - value).abs() < allowed, "{}: {product} is not {value} ± {uncertainty:e}", case.place);
        *compared.entry((steps.len(), free)).or_default() += 1;
    });
    eprintln!("{tried} chains, {unclear} unclear; by (steps, of them free): {compared:?}");
    let count = |wanted: &dyn Fn(usize, usize) -> bool| compared.iter().filter(|(k, _)| wanted(k.0, k.1)).map(|(_, n)| n).sum::<usize>();
    assert!(count(&|steps, free| steps == 1 && free == 1) > 1000, "single reconnections");
    assert!(count(&|steps, free| steps > free) > 300, "chains through delta lobes");
    assert!(count(&|_, free| free > 1) > 300, "chains with several free directions");
    assert!(unclear * 4 < tried, "too many chains left out");
}
