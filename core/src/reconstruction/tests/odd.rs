//! Films that are odd: of one row, black, half black, without features that tell anything.

use super::convergence::{features, frame};
use super::*;

fn solved(film: &Film, kind: ReconstructionKind) -> Reconstructed {
    let done = reconstruct(film, kind, 0.2).unwrap();
    assert!(done.image.data().iter().all(|v| v.is_finite()), "{}", kind.name());
    done
}

#[test]
fn a_frame_of_one_row_or_column() {
    for (width, height) in [(1, 1), (17, 1), (1, 17), (2, 1)] {
        let truth = picture(Extent { width, height });
        for kind in kinds() {
            let done = solved(&frame(&truth, 3), kind);
            assert!(worst(&done.image, &truth) < 5.0, "{}", kind.name());
        }
    }
}

#[test]
fn a_black_frame_stays_black() {
    let black = Image::new(Extent { width: 9, height: 7 }, 3);
    for kind in kinds().filter(|kind| *kind != ReconstructionKind::Graph) {
        let done = solved(&frame(&black, 0), kind);
        assert!(done.image.data().iter().all(|v| *v == 0.0), "{}", kind.name());
    }
}

#[test]
fn a_frame_without_noise_stays_as_it_is() {
    let extent = Extent { width: 21, height: 14 };
    let truth = picture(extent);
    let (dx, dy) = differences(&truth);
    let mut film = frame(&truth, 0);
    for half in &mut film.halves {
        half.primal = truth.clone();
        half.primal_variance = Image::new(extent, 3);
        let none = Image::new(extent, 1);
        half.gradients = Some(Gradients { dx: dx.clone(), dy: dy.clone(), dx_variance: none.clone(), dy_variance: none });
    }
    for kind in kinds().filter(|kind| *kind != ReconstructionKind::Graph) {
        let off = worst(&solved(&film, kind).image, &truth);
        assert!(off < 2e-3, "{}: {off}", kind.name());
    }
}

#[test]
fn a_constant_frame_stays_constant_whatever_the_features() {
    let extent = Extent { width: 16, height: 11 };
    let mut truth = Image::new(extent, 3);
    truth.data_mut().fill(0.5);
    let mut film = frame(&truth, 1);
    for half in &mut film.halves {
        half.primal = truth.clone();
        let zero = Image::new(extent, 3);
        let gradients = half.gradients.as_mut().unwrap();
        (gradients.dx, gradients.dy) = (zero.clone(), zero);
    }
    let nothing = Features { albedo: Image::new(extent, 3), normal: Image::new(extent, 3), depth: Image::new(extent, 1) };
    for features in [nothing, features(extent)] {
        film.features = features;
        for kind in kinds().filter(|kind| *kind != ReconstructionKind::Graph) {
            assert!(worst(&solved(&film, kind).image, &truth) < 1e-5, "{}", kind.name());
        }
    }
}

#[test]
fn one_half_black() {
    let truth = picture(Extent { width: 14, height: 9 });
    let mut film = frame(&truth, 2);
    let black = Image::new(film.extent, 3);
    film.halves[1].primal = black.clone();
    film.halves[1].primal_variance = black.clone();
    let gradients = film.halves[1].gradients.as_mut().unwrap();
    (gradients.dx, gradients.dy) = (black.clone(), black);
    film.halves[1].graph.as_mut().unwrap().differences.iter_mut().for_each(|d| *d = [0.0; 3]);
    for kind in kinds() {
        solved(&film, kind);
    }
}

#[test]
fn exposure_does_not_matter() {
    let truth = picture(Extent { width: 19, height: 12 });
    let film = frame(&truth, 5);
    let scale = |image: &mut Image, by: f32| image.data_mut().iter_mut().for_each(|v| *v *= by);
    // A power of two, so that nothing is rounded otherwise.
    let by = 1024.0f32;
    let mut bright = film.clone();
    for half in &mut bright.halves {
        scale(&mut half.primal, by);
        scale(&mut half.primal_variance, by * by);
        let gradients = half.gradients.as_mut().unwrap();
        scale(&mut gradients.dx, by);
        scale(&mut gradients.dy, by);
        scale(&mut gradients.dx_variance, by * by);
        scale(&mut gradients.dy_variance, by * by);
        half.graph.as_mut().unwrap().differences.iter_mut().flatten().for_each(|d| *d *= by);
    }
    for kind in kinds() {
        let (dim, mut bright) = (solved(&film, kind).image, solved(&bright, kind).image);
        scale(&mut bright, 1.0 / by);
        assert!(worst(&dim, &bright) < 1e-4, "{}: {}", kind.name(), worst(&dim, &bright));
    }
}
