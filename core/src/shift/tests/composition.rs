//! Shifts that compose: from pixel i to k and on to m leads where the shift from i to m does, so that the weights of all pixels
//! of a set add up to one, whichever of them drew the path.

use super::*;
use crate::gradient::Sharing;
use crate::shift::{Chance, HybridShift};
use crate::spectrum::Spectrum;

/// Edge of the set of pixels.
const EDGE: u32 = 3;
/// Positions agree within this fraction of the scene's radius, products of Jacobians within this.
const TOLERANCE: f64 = 1e-3;

/// A base path, its images in every pixel of a set, and the camera rays there.
struct Fan<'a> {
    scene: &'a Scene,
    shift: &'a HybridShift,
    base: &'a Subpath,
    own: usize,
    cameras: &'a [Ray],
    images: &'a [OffsetSubpath],
    place: String,
}

/// Visits base paths of each pixel of sets all over the film, for every scene and threshold.
fn each_fan(film: u32, samples: u32, mut visit: impl FnMut(&Fan)) {
    let pixels = (EDGE * EDGE) as usize;
    let mut base = Subpath::default();
    let mut images = vec![OffsetSubpath::default(); pixels];
    for (name, scene) in &scenes() {
        for threshold in THRESHOLDS {
            let view = scene.sensor.view(Extent { width: film, height: film });
            let integrator = PathIntegrator { max_depth: 7, roulette_depth: 4, shift_threshold: threshold };
            let shift = HybridShift { threshold, chance: Chance::Own };
            for set in (Extent { width: film, height: film }).tiles(EDGE).iter().filter(|set| set.pixels() == pixels) {
                for own in 0..pixels {
                    let at = |pixel: usize| [set.x + pixel as u32 % EDGE, set.y + pixel as u32 / EDGE];
                    let [x, y] = at(own);
                    for index in 0..samples {
                        let stream = SampleStream::open(SampleKey { seed: 13, frame: 0, x, y, index });
                        let [u, v] = stream.pair(Dimension::PIXEL);
                        let lens = stream.pair(Dimension::LENS);
                        let cameras: Vec<Ray> = (0..pixels).map(at).map(|[x, y]| view.ray([x as f32 + u, y as f32 + v], lens)).collect();
                        integrator.generate(scene, &cameras[own], &stream, &mut base);
                        if base.vertices.is_empty() {
                            continue;
                        }
                        for (camera, image) in cameras.iter().zip(&mut images) {
                            shift.shift(scene, &base, camera, image);
                        }
                        let place = format!("{name}, threshold {threshold}, pixel ({x}, {y}), sample {index}");
                        visit(&Fan { scene, shift: &shift, base: &base, own, cameras: &cameras, images: &images, place });
                    }
                }
            }
        }
    }
}

/// Product of the Jacobians.
fn jacobian(offset: &OffsetSubpath) -> f64 {
    offset.steps.iter().map(|step| step.jacobian).product()
}

#[test]
fn shifts_by_own_chance_compose() {
    let mut onward = OffsetSubpath::default();
    let (mut compared, mut apart, mut copied) = (0usize, 0usize, 0usize);
    each_fan(12, 2, |fan| {
        for (k, first) in fan.images.iter().enumerate().filter(|(k, _)| *k != fan.own) {
            let Some(image) = image(fan.scene, fan.base, first) else { continue };
            for (m, direct) in fan.images.iter().enumerate().filter(|(m, _)| *m != k && *m != fan.own) {
                fan.shift.shift(fan.scene, &image, &fan.cameras[m], &mut onward);
                compared += 1;
                let radius = f64::from(fan.scene.world.bounds().radius());
                let far = direct.vertices.iter().zip(&onward.vertices).map(|(a, b)| f64::from(a.position.distance(b.position)));
                let error = (jacobian(first) * jacobian(&onward) / jacobian(direct) - 1.0).abs();
                let same = std::mem::discriminant(&direct.end) == std::mem::discriminant(&onward.end)
                    && direct.vertices.len() == onward.vertices.len()
                    && far.fold(0.0, f64::max) < TOLERANCE * radius
                    && (matches!(direct.end, OffsetEnd::Failed { .. }) || error < 10.0 * TOLERANCE);
                apart += usize::from(!same);
                copied += usize::from(same && !matches!(direct.end, OffsetEnd::Failed { .. }) && direct.steps.len() > 1);
            }
        }
    });
    eprintln!("{compared} compositions, {apart} apart, {copied} of more than one step");
    // Only what rounding decides may differ: grazing edges, and chains that magnify it.
    assert!(compared > 100_000 && copied > 5_000, "{compared} compositions, {copied} of more than one step");
    assert!(apart * 1_000 < compared, "{apart} of {compared} compositions lead elsewhere");
}

#[test]
fn common_chances_do_not_compose() {
    // What the law above is for: the hybrid of two pixels decides by both of them, and loses paths among three.
    let (mut compared, mut apart) = (0usize, 0usize);
    let mut onward = OffsetSubpath::default();
    each_fan(12, 1, |fan| {
        let shift = HybridShift { chance: Chance::Common, ..*fan.shift };
        let mut direct = fan.images.to_vec();
        direct.iter_mut().zip(fan.cameras).for_each(|(image, camera)| shift.shift(fan.scene, fan.base, camera, image));
        for (k, first) in direct.iter().enumerate().filter(|(k, _)| *k != fan.own) {
            let Some(image) = image(fan.scene, fan.base, first) else { continue };
            for (m, direct) in direct.iter().enumerate().filter(|(m, _)| *m != k && *m != fan.own) {
                shift.shift(fan.scene, &image, &fan.cameras[m], &mut onward);
                compared += 1;
                apart += usize::from(std::mem::discriminant(&direct.end) != std::mem::discriminant(&onward.end));
            }
        }
    });
    eprintln!("{compared} compositions of common chances, {apart} apart");
    assert!(apart > 5, "{apart} of {compared}");
}

/// The weight of a base path in its own pixel, for everything beyond the first vertex that all images share.
fn weight(fan: &Fan, base: &Subpath, own: usize, images: &[OffsetSubpath]) -> f64 {
    // No joints, and radiance one wherever the walk over the images ends.
    let base = Subpath { joints: Vec::new(), radiance: vec![Spectrum::WHITE; base.vertices.len()], ..base.clone() };
    let joined = images.iter().find_map(|image| if let OffsetEnd::Rejoined { at } = image.end { Some(at) } else { None });
    let throughput = base.steps[..=joined.unwrap()].iter().fold(base.camera.passage.weight(), |t, step| t * step.weight());
    let mut sums = vec![Spectrum::BLACK; images.len()];
    Sharing::default().share(fan.scene, &base, own, images, &mut sums);
    f64::from(sums[own].max()) / f64::from(throughput.max())
}

#[test]
fn weights_of_all_images_add_up_to_one() {
    let mut onward = vec![OffsetSubpath::default(); (EDGE * EDGE) as usize];
    let (mut told, mut apart, mut shared) = (0usize, 0usize, 0usize);
    each_fan(12, 6, |fan| {
        let joined = |image: &OffsetSubpath| if let OffsetEnd::Rejoined { at } = image.end { Some(at) } else { None };
        let mut images = fan.images.to_vec();
        images[fan.own].clear();
        let Some(at) = images.iter().find_map(joined) else { return };
        // A path of density zero is never a base path, and one that is worth nothing has no throughput to compare with.
        let drawn = |path: &Subpath| {
            path.steps.len() > at
                && path.vertices.len() > at + 1
                && path.steps.iter().take(at + 1).all(|s| s.evaluation.density * s.leg.passage.density > 0.0 && !s.weight().is_black())
        };
        if !drawn(fan.base) {
            return;
        }
        let mut sum = weight(fan, fan.base, fan.own, &images);
        let mut whole = true;
        for (k, first) in images.iter().enumerate().filter(|(k, image)| *k != fan.own && joined(image).is_some()) {
            let Some(image) = image(fan.scene, fan.base, first).filter(drawn) else {
                whole &= image(fan.scene, fan.base, first).is_none_or(|image| image.steps.iter().any(|s| s.evaluation.density == 0.0));
                continue;
            };
            for (camera, image_of_image) in fan.cameras.iter().zip(&mut onward) {
                fan.shift.shift(fan.scene, &image, camera, image_of_image);
            }
            onward[k].clear();
            shared += 1;
            sum += weight(fan, &image, k, &onward);
        }
        if !whole {
            return;
        }
        told += 1;
        if (sum - 1.0).abs() > 10.0 * TOLERANCE {
            apart += 1;
            if apart < 20 {
                eprintln!("{}: weights add up to {sum}", fan.place);
            }
        }
    });
    eprintln!("{told} paths with {shared} images, {apart} apart");
    // Rounding alone may excuse a few.
    assert!(told > 10_000 && shared > 5 * told, "{told} paths, {shared} images");
    assert!(apart * 1_000 < told, "{apart} of {told} paths have weights that do not add up");
}
