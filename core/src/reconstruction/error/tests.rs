//! Estimated errors held against true ones.

use super::*;
use crate::metrics::rel_mse;
use crate::plan::Technique;
use crate::reconstruction::{ReconstructionKind, reconstruct};
use crate::testing::{self, films};

/// Edge of the films [pixels].
const EDGE: u32 = 24;
/// Independent renders of each scene.
const SEEDS: u64 = 4;

/// On every test scene, without bias and with it: the true relMSE lies where the interval says, and the estimates' mean near its mean.
///
/// With 95 % intervals that kept their word exactly, 108 of 120 within has a probability above 0.96 even if all reconstructions of a
/// film failed together.
#[test]
fn the_true_error_lies_within_the_interval() {
    let (mut missed, mut all) = (Vec::new(), 0);
    for (name, scene) in testing::scenes() {
        let film = |samples, seed| films::render(&scene, &testing::plan(Technique::Gpt, EDGE, samples, 6, seed));
        let reference = reconstruct(&film(1024, 99), ReconstructionKind::L2, 0.3).unwrap().image;
        let rendered: Vec<_> = (0..SEEDS).map(|seed| film(32, seed)).collect();
        for kind in [ReconstructionKind::None, ReconstructionKind::L2, ReconstructionKind::L1] {
            let (mut truth, mut told) = (0.0, 0.0);
            for film in &rendered {
                let done = reconstruct(film, kind, 0.2).unwrap();
                let error = done.error.unwrap();
                let found = rel_mse(&done.image, &reference).unwrap();
                let [low, high] = error.interval.unwrap();
                assert!(low <= error.relmse && error.relmse <= high && (kind == ReconstructionKind::L1 || error.bias == 0.0));
                // Scenes without noise are exact to rounding.
                if !(low..=high).contains(&found) && found > 1e-10 {
                    missed.push(format!("{name}, {}: {found:.2e} outside {low:.2e} to {high:.2e}", kind.name()));
                }
                (truth, told) = (truth + found, told + error.relmse);
            }
            all += rendered.len();
            assert!(truth < 1e-10 || (0.4..2.5).contains(&(told / truth)), "{name}, {}: told {told:e}, true {truth:e}", kind.name());
        }
    }
    assert!(missed.len() * 10 <= all, "{} of {all} true errors lie outside: {missed:#?}", missed.len());
}

/// Halves that share an error, as those of a biased method do, do not show it in their difference; unbiased images do.
#[test]
fn bias_is_told_apart_from_noise() {
    let extent = Extent { width: 48, height: 32 };
    let image = |seed: u32, bias: f32| {
        let noise = |i: u32| {
            (crate::sampling::SampleStream::open(crate::sampling::SampleKey { seed: 7, frame: 0, x: i, y: seed, index: 0 }))
                .number(crate::sampling::Dimension::PIXEL)
                - 0.5
        };
        let data = (0..3 * extent.pixels() as u32).map(|i| 2.0 + bias + noise(i)).collect();
        Image::from_planes(extent, 3, data).unwrap()
    };
    let halves = [image(1, 0.3), image(2, 0.3)];
    let unbiased = [image(3, 0.0), image(4, 0.0)];
    let mean = zip(&halves[0], &halves[1], |a, b| 0.5 * (a + b));
    let error = ErrorEstimate::new(&mean, &halves, Some(&unbiased), [8, 8]);
    // Uniform noise of width 1 has a variance of 1/12; half of that remains in the mean of two.
    let (bias, variance, scale) = (0.09, 1.0 / 24.0, 1.0 / (4.0 + REL_MSE_FLOOR));
    assert!((error.bias / (bias * scale) - 1.0).abs() < 0.1, "{}", error.bias);
    assert!((error.relmse / ((bias + variance) * scale) - 1.0).abs() < 0.1, "{}", error.relmse);
    // Tiles add up to the frame.
    let tiles = extent.tiles(10);
    let sum: f64 = tiles.iter().map(|tile| error.of_tile(*tile) * tile.pixels() as f64).sum();
    assert!((sum / extent.pixels() as f64 / error.relmse - 1.0).abs() < 1e-6);
    // What seems unbiased by itself shows its variance alone.
    assert!(ErrorEstimate::new(&mean, &halves, None, [8, 8]).relmse < 0.5 * error.relmse);
}

#[test]
fn frames_too_small_have_no_interval_and_equal_halves_no_error() {
    let image = |extent| Image::new(extent, 3);
    let of = |width, height| {
        let blank = image(Extent { width, height });
        ErrorEstimate::new(&blank, &[blank.clone(), blank.clone()], None, [1, 1])
    };
    assert_eq!(of(1, 1).interval, None);
    assert_eq!((of(40, 30).relmse, of(40, 30).interval), (0.0, Some([0.0; 2])));
}
