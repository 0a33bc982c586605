//! The shift back from the offset path leads to the base path again: the same kind, the same vertices, the reciprocal Jacobian.

use super::*;
use crate::gradient::Pair;

/// Vertices come back to within this fraction of the scene's radius. Only chains of mirrors and glass stray from their place at all.
const POSITION: f64 = 1e-3;
/// The product of both Jacobians is 1 within this, and within what rounding excuses.
const JACOBIAN: f64 = 1e-3;

/// Density of the offset path times the Jacobian over the density of the base path; `None` where the offset path is never drawn.
fn ratio(base: &Subpath, image: &Subpath, offset: &OffsetSubpath) -> Option<f64> {
    let mut ratio: f64 = offset.steps.iter().map(|step| step.jacobian).product();
    ratio *= f64::from(image.camera.passage.density) / f64::from(base.camera.passage.density);
    for (there, here) in image.steps.iter().zip(&base.steps) {
        ratio *= f64::from(there.evaluation.density) / f64::from(here.evaluation.density);
        ratio *= f64::from(there.leg.passage.density) / f64::from(here.leg.passage.density);
    }
    (ratio > 0.0).then_some(ratio)
}

/// The same for the way back, with every density evaluated anew at the vertices that it found.
fn ratio_back(case: &Case, offset: &Subpath, back: &OffsetSubpath) -> Option<f64> {
    ratio(offset, &image(case.scene, offset, back)?, back)
}

fn every_shift_can_be_undone(edge: u32, samples: u32) {
    let mut back = OffsetSubpath::default();
    let (mut shifts, mut there, mut apart) = (0usize, 0usize, 0usize);
    let (mut strayed, mut worst) = (0.0f64, 0.0f64);
    each_shift(&ShiftKind::ALL, edge, samples, |case| {
        shifts += 1;
        let Some(image) = image(case.scene, case.base, case.offset) else { return };
        there += 1;
        case.shift.shift(case.scene, &image, &case.here, &mut back);
        // A shift back that fails, or takes another way, would leave the weights of both directions short of 1.
        assert_eq!(back.end, case.offset.end, "{}: end of the way back", case.place);
        assert_eq!(back.vertices.len(), case.offset.vertices.len(), "{}: vertices", case.place);
        let own = back.vertices.iter().zip(&case.base.vertices);
        assert!(own.clone().all(|(a, b)| a.matter == b.matter), "{}: materials", case.place);
        let far = distance(case.base, &back) / f64::from(case.scene.world.bounds().radius());
        assert!(far < POSITION, "{}: strayed by {far:e}", case.place);
        let bent = bent(case, &back);
        for (turned, step) in back.steps.iter().zip(&case.base.steps) {
            let turn = f64::from(turned.wi.distance(step.wi));
            assert!(turn < 1e-3 + bent, "{}: turned by {turn:e}", case.place);
        }
        let product: f64 = case.offset.steps.iter().chain(&back.steps).map(|s| s.jacobian).product();
        let error = (product - 1.0).abs();
        let allowed = JACOBIAN + rounding(case, distance(case.base, &back));
        assert!(error < allowed, "{}: Jacobians there and back multiply to 1 ± {error:e}, allowed {allowed:e}", case.place);
        if let (Some(to), Some(from)) = (ratio(case.base, &image, case.offset), ratio_back(case, &image, &back)) {
            let weights = Pair { ratio: to, ..Pair::START }.weight() + Pair { ratio: from, ..Pair::START }.weight();
            // The way back evaluates its materials in directions that rounding has turned: most across a short edge in a corner,
            // and with most effect in sharp lobes.
            let error = (weights - 1.0).abs();
            assert!(error < 1e-2 + allowed + 10.0 * bent, "{}: weights of both directions add up to {weights}", case.place);
            apart += usize::from(error > JACOBIAN);
        }
        apart += usize::from(error > JACOBIAN);
        (strayed, worst) = (strayed.max(far), worst.max(error));
    });
    eprintln!("{shifts} shifts, {there} succeed; strayed by at most {strayed:.1e}, Jacobians by {worst:.1e}, {apart} beyond {JACOBIAN}");
    // Rounding may excuse a few, but no more.
    assert!(there > 100_000 && apart * 20_000 < there);
}

#[test]
fn shifts_to_far_neighbours_can_be_undone() {
    every_shift_can_be_undone(8, 96);
}

#[test]
fn shifts_to_near_neighbours_can_be_undone() {
    every_shift_can_be_undone(48, 6);
}
