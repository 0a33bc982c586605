//! Windows against oracles: single frames, closed forms, other solvers, and what they are worth on noisy moving pictures.

mod clip;
mod noisy;
mod solvers;

use super::*;
use crate::film::{Features, Film, Gradients, HalfFilm, Statistics};
use crate::lattice::Extent;
use crate::reconstruction::Measurements;
use crate::reconstruction::reconstruct;
use clip::{Clip, brightening};

const EXTENT: Extent = Extent { width: 18, height: 13 };

fn kinds() -> impl Iterator<Item = ReconstructionKind> {
    ReconstructionKind::ALL.into_iter().filter(|kind| kind.takes_windows())
}

fn refs(moments: &[MomentFilm]) -> Vec<&MomentFilm> {
    moments.iter().collect()
}

fn worst(a: &Image, b: &Image) -> f32 {
    a.data().iter().zip(b.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn mean(images: &[Image]) -> f64 {
    let values: Vec<f64> = images.iter().flat_map(|image| image.data()).map(|v| f64::from(*v)).collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn images(solution: WindowSolution) -> Vec<Image> {
    solution.moments.into_iter().map(|share| share.image).collect()
}

/// What a single frame's method makes of a copy, weighted by another one.
fn single(copy: &CopyFilm, other: &CopyFilm, kind: ReconstructionKind) -> Image {
    let planes = |copy: &CopyFilm| [copy.primal(), copy.both(|half| &half.dx), copy.both(|half| &half.dy)];
    let ([p, dx, dy], [q, ex, ey]) = (planes(copy), planes(other));
    let own = Measurements { variance: Some(copy.variance()), ..Measurements::new(&p, &dx, &dy) };
    let other = Measurements { variance: Some(other.variance()), ..Measurements::new(&q, &ex, &ey) };
    super::super::method(kind).unwrap().solve(&own, Some(&other), 0.3).unwrap().0
}

#[test]
fn a_window_of_one_moment_is_a_single_frame() {
    let moments = Clip::new(brightening(EXTENT, 1, 0.0)).moments();
    let [a, b] = moments[0].copies() else { panic!("two copies") };
    for (kind, bound) in [(ReconstructionKind::None, 0.0), (ReconstructionKind::L2, 1e-6), (ReconstructionKind::WeightedL2, 2e-4)] {
        let window = solve(&refs(&moments), kind, Some(0.3)).unwrap();
        let [u, v] = window.moments[0].copies.as_ref().unwrap();
        let off = worst(u, &single(a, b, kind)).max(worst(v, &single(b, a, kind)));
        assert!(off <= bound, "{}: {off}", kind.name());
    }
    // One film is the frame that it would be by itself.
    let clip = Clip { copies: 1, ..Clip::new(brightening(EXTENT, 1, 0.0)) };
    let (film, moments) = (clip.film(0, 0), clip.moments());
    for (kind, bound) in [(ReconstructionKind::None, 1e-6), (ReconstructionKind::L2, 2e-6), (ReconstructionKind::L1, 5e-3)] {
        let window = images(solve(&refs(&moments), kind, Some(0.3)).unwrap());
        let off = worst(&window[0], &reconstruct(&film, kind, 0.3).unwrap().image);
        assert!(off < bound, "{}: {off}", kind.name());
    }
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let clip = |width, height, copies| Clip { copies, ..Clip::new(brightening(Extent { width, height }, 2, 0.1)) };
    let (two, one, small) = (clip(6, 5, 2).moments(), clip(6, 5, 1).moments(), clip(5, 5, 2).moments());
    let refused = |moments: &[&MomentFilm], kind, alpha| solve(moments, kind, alpha).unwrap_err();
    let l2 = ReconstructionKind::L2;
    for kind in ReconstructionKind::ALL.into_iter().filter(|kind| !kind.takes_windows()) {
        assert_eq!(refused(&refs(&two), kind, None), ReconstructError::NoWindows { wanted: kind.name() });
    }
    assert!(matches!(refused(&refs(&two), l2, Some(f32::NAN)), ReconstructError::Alpha { .. }));
    assert_eq!(refused(&[&two[0], &one[1]], l2, None), ReconstructError::Copies { found: 1 });
    assert!(matches!(refused(&[&two[0], &small[1]], l2, None), ReconstructError::Sizes { .. }));
    assert_eq!(solve(&[], l2, None).unwrap().moments, []);

    let film = clip(6, 5, 1).film(0, 0);
    assert_eq!(MomentFilm::new(&[]), Err(ReconstructError::Copies { found: 0 }));
    assert_eq!(MomentFilm::new(&[&film, &film, &film]), Err(ReconstructError::Copies { found: 3 }));
    assert!(matches!(MomentFilm::new(&[&film, &clip(5, 6, 1).film(0, 0)]), Err(ReconstructError::Sizes { .. })));
    let spoilt = |spoil: fn(&mut Film)| {
        let mut film = film.clone();
        spoil(&mut film);
        MomentFilm::new(&[&film]).unwrap_err()
    };
    assert_eq!(spoilt(|film| film.halves[1].samples = 0), ReconstructError::NoSharedSeeds);
    assert!(matches!(spoilt(|film| film.halves[0].gradients = None), ReconstructError::NoGradients { .. }));
    assert_eq!(spoilt(|film| film.halves[1].primal.set(2, 0, 0, f32::NAN)), ReconstructError::NotFinite { plane: "primal", index: 2 });
    assert_eq!(
        spoilt(|film| film.halves[0].direct.set(0, 0, 0, f32::INFINITY)),
        ReconstructError::NotFinite { plane: "direct emission", index: 0 }
    );
    let mut lost = clip(6, 5, 1).moments();
    let mut motion = Image::new(Extent { width: 6, height: 5 }, 3);
    motion.set(0, 0, 0, -1.0);
    motion.set(0, 0, 2, 1.0);
    lost[1].motion = Some(motion);
    assert_eq!(refused(&refs(&lost), l2, None), ReconstructError::Motion { pixel: [0, 0], found: [-1.0, 0.0] });
}

#[test]
fn odd_clips_are_solved() {
    for (width, height, count) in [(1, 1, 3), (17, 1, 4), (1, 17, 2), (2, 2, 1), (9, 8, 12)] {
        for pan in [None, Some([1, 0]), Some([0, -3])] {
            let extent = Extent { width, height };
            for copies in [1, 2] {
                let moments = Clip { pan, copies, ..Clip::new(clip::panning(extent, count, pan.unwrap_or([0, 0]))) }.moments();
                for kind in kinds() {
                    let solved = images(solve(&refs(&moments), kind, None).unwrap());
                    assert!(solved.len() == count && solved.iter().flat_map(|image| image.data()).all(|v| v.is_finite() && v.abs() < 20.0));
                }
            }
        }
    }
    // Black stays black.
    let black = Clip::new(vec![Image::new(EXTENT, 3); 3]).moments();
    for kind in kinds() {
        assert!(images(solve(&refs(&black), kind, None).unwrap()).iter().all(|image| image.data().iter().all(|v| *v == 0.0)));
    }
}

#[test]
fn where_nothing_changes_all_moments_show_the_same() {
    let clip = Clip::new(brightening(EXTENT, 6, 0.0));
    let mut moments = clip.moments();
    // A scene that rests, drawn with the same numbers in every moment.
    let one = moments[0].clone();
    moments.iter_mut().for_each(|moment| *moment = one.clone());
    for moment in &mut moments {
        for copy in &mut moment.copies {
            copy.halves[1] = copy.halves[0].clone();
        }
    }
    for kind in kinds() {
        let images = images(solve(&refs(&moments), kind, None).unwrap());
        let off = images.iter().map(|image| worst(image, &images[0])).fold(0.0, f32::max);
        // Solves by conjugate gradients end far below noise, which here is a tenth.
        let bound = if kind == ReconstructionKind::WeightedL2 { 1e-4 } else { 1e-5 };
        assert!(off < bound, "{}: {off}", kind.name());
    }
}

#[test]
fn with_exact_differences_the_mean_of_a_window_is_that_of_its_primals() {
    let clip = Clip::new(brightening(EXTENT, 5, 0.1));
    let mut moments = clip.moments();
    for (t, moment) in moments.iter_mut().enumerate() {
        let truth = &clip.truth[t];
        let (dx, dy) = super::super::tests::differences(truth);
        for copy in &mut moment.copies {
            for half in &mut copy.halves {
                (half.dx, half.dy) = (dx.clone(), dy.clone());
            }
        }
    }
    let primals: Vec<Image> = moments.iter().map(|moment| moment.primal()).collect();
    let solution = images(solve(&refs(&moments), ReconstructionKind::L2, None).unwrap());
    let (before, after) = (mean(&primals), mean(&solution));
    assert!((before - after).abs() < 1e-6 * before, "{before} against {after}");
}

#[test]
fn shares_survive_storage_and_blend_to_the_frame() {
    let clip = Clip::new(brightening(EXTENT, 7, 0.1));
    let moments = clip.moments();
    let windows = Windows::new(7, 4, 2);
    let solved: Vec<WindowSolution> = (0..windows.len())
        .map(|k| {
            let range = windows.moments(k);
            solve(&refs(&moments[range.start as usize..range.end as usize]), ReconstructionKind::L2, None).unwrap()
        })
        .collect();
    for moment in 0..7 {
        let shares = windows.over(moment).map(|k| {
            let mut share = solved[k as usize].moments[(moment - windows.moments(k).start) as usize].clone();
            share.scale(windows.weight(k, moment));
            let stored = Share::from_planes(&share.to_planes()).unwrap();
            assert_eq!(stored, share);
            stored
        });
        let blended = blend(shares).unwrap().unwrap();
        let film = &moments[moment as usize];
        let frame = finish(blended.clone(), film, ReconstructionKind::L2, SolveReport::default()).unwrap();
        let error = frame.error.unwrap();
        let truth = &clip.truth[moment as usize];
        let squared = frame.image.data().iter().zip(truth.data()).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        let told = error.squared.data().iter().map(|v| f64::from(*v)).sum::<f64>();
        assert!(told > 0.4 * squared && told < 2.5 * squared, "{told} against {squared}");
        assert!(error.relmse > 0.0 && frame.halves.is_some() && worst(&frame.primal, &film.primal()) == 0.0);
        let small = MomentFilm::new(&[&Clip::new(brightening(Extent { width: 3, height: 2 }, 1, 0.0)).film(0, 0)]).unwrap();
        assert!(finish(blended, &small, ReconstructionKind::L2, SolveReport::default()).is_err());
    }
    assert_eq!(blend([]), Ok(None));
    let [one, mut other] = [0, 1].map(|k: usize| solved[k].moments[0].clone());
    other.copies = None;
    assert_eq!(blend([one, other]), Err(ReconstructError::Shares { found: 1, expected: 3 }));
}
