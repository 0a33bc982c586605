//! Solvers against each other: the cosine transform, conjugate gradients, and a picture whose motion is undone by hand.

use super::clip::{brightening, panning};
use super::*;
use crate::reconstruction::field::Field;
use crate::reconstruction::window::gradients::Enough;
use crate::reconstruction::window::system::System;

/// Smallest to largest, rows and columns and odd sizes.
const SIZES: [(u32, u32, usize); 5] = [(18, 13, 5), (1, 9, 4), (9, 1, 3), (1, 1, 6), (37, 22, 2)];

fn source<'a>(moments: &'a [&'a MomentFilm], links: &'a [Option<Links>]) -> Source<'a> {
    Source { moments, links, copy: Some(0) }
}

fn links(moments: &[&MomentFilm]) -> Vec<Option<Links>> {
    moments.iter().skip(1).map(|moment| Links::new(moment.motion()).unwrap()).collect()
}

#[test]
fn the_cosine_transform_and_conjugate_gradients_agree() {
    for (width, height, count) in SIZES {
        let clip = Clip::new(brightening(Extent { width, height }, count, 0.1));
        let moments = clip.moments();
        let moments = refs(&moments);
        let pairs: Vec<[f64; 2]> = (0..count - 1).map(|k| [0.5 + 4.0 * k as f64, 8.0 / (1 + k) as f64]).collect();
        let weights = Uniform { screen: 0.09, pairs };
        let copies: Vec<&CopyFilm> = moments.iter().map(|moment| &moment.copies()[0]).collect();
        let exact = l2::solve_still(&copies, &weights);
        let links = links(&moments);
        let (found, report) =
            squares::solve(source(&moments, &links), &Alike { weights: &weights, links: &links }, Enough::residual(2e-7)).unwrap();
        for (a, b) in exact.iter().zip(&found) {
            let off = worst(a, b);
            assert!(off < 1e-5, "{width} × {height}, {count} moments: {off} after {report:?}");
        }
    }
}

/// Links that are no longer needed because all pixels stay in their place give what no links give.
#[test]
fn links_to_the_same_place_are_no_links() {
    let clip = Clip::new(brightening(EXTENT, 4, 0.1));
    let moments = clip.moments();
    let moments = refs(&moments);
    let weights = Uniform { screen: 0.04, pairs: vec![[2.0, 3.0]; 3] };
    let none = links(&moments);
    let mut still = Image::new(EXTENT, 3);
    still.plane_mut(2).fill(1.0);
    let same: Vec<Option<Links>> = (0..3).map(|_| Some(Links::of(&still).unwrap())).collect();
    let solve = |links: &[Option<Links>]| {
        squares::solve(source(&moments, links), &Alike { weights: &weights, links }, Enough::residual(1e-6)).unwrap()
    };
    let ((a, _), (b, _)) = (solve(&none), solve(&same));
    assert!(a.iter().zip(&b).all(|(a, b)| worst(a, b) == 0.0));
}

/// The operator is symmetric, positive, and what the sum of squares says it is.
#[test]
fn the_operator_is_the_sum_of_squares() {
    let clip = Clip { pan: Some([2, -1]), ..Clip::new(panning(EXTENT, 4, [2, -1])) };
    let moments = clip.moments();
    let moments = refs(&moments);
    let links = links(&moments);
    let weights = Uniform { screen: 0.3, pairs: vec![[2.0, 3.0], [0.5, 1.0], [7.0, 0.1]] };
    let rule = Alike { weights: &weights, links: &links };
    let (n, w, h) = (4, EXTENT.width as usize, EXTENT.height as usize);
    let random = |seed: usize| (0..n).map(|t| Field::from_image(&crate::reconstruction::tests::random(EXTENT, seed + t, 1.0))).collect();
    let (x, y): (Vec<Field>, Vec<Field>) = (random(5), random(50));
    let mut system = System::new(source(&moments, &links));
    system.weigh(&rule);
    let operator = &mut system.operator;
    let (mut ax, mut ay) = (gradients::fields(w, h, n), gradients::fields(w, h, n));
    let energies = operator.apply(&x, &mut ax);
    operator.apply(&y, &mut ay);
    let (left, right) = (operator::inner(&ax, &y), operator::inner(&ay, &x));
    assert!((0..3).all(|c| (left[c] - right[c]).abs() < 1e-4 * energies[c]), "{left:?} {right:?}");
    for c in 0..3 {
        let at = |t: usize, i: usize| f64::from(x[t].row(i / w, c)[i % w]);
        let mut sum = 0.0;
        for (t, i) in (0..n).flat_map(|t| (0..w * h).map(move |i| (t, i))) {
            sum += 0.3 * at(t, i).powi(2);
            let steps = [(i % w + 1 < w).then_some(1), (i + w < w * h).then_some(w)];
            for step in steps.into_iter().flatten() {
                sum += (at(t, i + step) - at(t, i)).powi(2);
            }
            let Some(before) = t.checked_sub(1) else { continue };
            let moved = |i: usize| clip.partner((i % w) as u32, (i / w) as u32).map(|(x, y)| EXTENT.index(x, y));
            let change = |i: usize| moved(i).map(|p| at(t, i) - at(before, p));
            let Some(own) = change(i) else { continue };
            let [value, slope] = weights.pairs[before];
            sum += value * own * own;
            for next in steps.into_iter().flatten().filter_map(|step| change(i + step)) {
                sum += slope * (next - own).powi(2);
            }
        }
        assert!((sum - energies[c]).abs() < 1e-5 * sum, "{sum} against {}", energies[c]);
    }
}

#[test]
fn a_picture_that_moves_is_solved_as_well_as_one_that_rests() {
    let extent = Extent { width: 40, height: 30 };
    let squared = |clip: &Clip, kind| {
        let moments = clip.moments();
        let solved = images(solve(&refs(&moments), kind, None).unwrap());
        // Away from the border, where trails are short.
        let inside = |i: usize| (8..32).contains(&(i % 40)) && (8..22).contains(&(i / 40));
        let errors = solved.iter().zip(&clip.truth).flat_map(|(a, b)| a.data().iter().zip(b.data()).enumerate());
        errors.filter(|(i, _)| inside(i % 1200)).map(|(_, (a, b))| f64::from(a - b).powi(2)).sum::<f64>()
    };
    let still = Clip::new(brightening(extent, 6, 0.0));
    let pan = [1, 1];
    let followed = Clip { pan: Some(pan), ..Clip::new(panning(extent, 6, pan)) };
    let lost = Clip { fresh: |_, _| true, ..Clip::new(panning(extent, 6, pan)) };
    for kind in [ReconstructionKind::L2, ReconstructionKind::WeightedL2, ReconstructionKind::L1] {
        let [still, followed, lost] = [&still, &followed, &lost].map(|clip| squared(clip, kind));
        eprintln!("{}: still {still:.3}, followed {followed:.3}, not followed {lost:.3}", kind.name());
        assert!(followed < 1.4 * still && lost > 1.5 * followed, "{}: {still} {followed} {lost}", kind.name());
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let extent = Extent { width: 33, height: 40 };
    let clip = Clip { pan: Some([1, 0]), samples: 4, ..Clip::new(panning(extent, 4, [1, 0])) };
    let moments = clip.moments();
    for kind in kinds() {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| solve(&refs(&moments), kind, None).unwrap())
        };
        assert!(run(1) == run(3), "{}", kind.name());
    }
}

#[test]
fn iterations_hardly_grow_with_the_weight_of_time() {
    let extent = Extent { width: 48, height: 36 };
    for pan in [None, Some([1, 0]), Some([1, 2])] {
        let clip = Clip { pan, ..Clip::new(panning(extent, 10, pan.unwrap_or([0, 0]))) };
        let moments = clip.moments();
        let moments = refs(&moments);
        let links = links(&moments);
        let iterations = [1.0, 16.0, 256.0].map(|weight| {
            let weights = Uniform { screen: 0.04, pairs: vec![[weight, weight]; 9] };
            let rule = Alike { weights: &weights, links: &links };
            squares::solve(source(&moments, &links), &rule, Enough::residual(squares::TOLERANCE)).unwrap().1.iterations
        });
        eprintln!("pan {pan:?}: {iterations:?} iterations");
        // Where the picture moves far, links that end do not let the longest waves in time through.
        let most = if pan.is_some() { [40, 120, u32::MAX] } else { [40, 50, 60] };
        assert!(iterations.iter().zip(most).all(|(n, most)| *n < most), "{iterations:?}");
    }
}
