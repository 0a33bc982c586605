//! Metrics against their definitions, and FLIP against values of its authors' implementation.

use super::*;
use crate::lattice::Extent;

fn image(width: u32, height: u32, value: impl Fn(u32, u32, u32) -> f32) -> Image {
    let mut out = Image::new(Extent { width, height }, 3);
    for c in 0..3 {
        for y in 0..height {
            for x in 0..width {
                out.set(x, y, c as usize, value(x, y, c));
            }
        }
    }
    out
}

/// Noise over a chequerboard, by a formula that any language can repeat.
fn chequered(width: u32, height: u32, seed: u32, scale: f32) -> Image {
    image(width, height, |x, y, c| {
        let k = ((x * 31 + y * 17 + c * 7 + seed * 101) * 7919) % 1009;
        scale * k as f32 / 1009.0 + 0.25 * ((x / 8 + y / 8) % 2) as f32
    })
}

#[test]
fn definitions_hold_on_two_pixels() {
    let reference = image(2, 1, |x, _, c| if x == 0 { 0.0 } else { c as f32 });
    let shown = image(2, 1, |x, _, c| if x == 0 { 0.1 } else { c as f32 - 0.2 });
    let relative = (3.0 * 0.01 / 1e-3 + 3.0 * 0.04 / (1.0 + 1e-3)) / 6.0;
    assert!((rel_mse(&shown, &reference).unwrap() - relative).abs() < 1e-6);
    assert!((rmse(&shown, &reference).unwrap() - (0.05f64 / 2.0).sqrt()).abs() < 1e-7);
    assert!((mean_error(&shown, &reference).unwrap() + 0.05).abs() < 1e-7);
}

#[test]
fn the_largest_difference_is_one() {
    // Of flat images only colour counts, and none differ more than green and blue do.
    let flat = |rgb: [f32; 3]| image(24, 20, |_, _, c| rgb[c as usize]);
    let map = flip::ldr_for_test(&flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0]));
    assert!(map.iter().all(|v| (v - 1.0).abs() < 1e-5), "{:?}", map[0]);
}

#[test]
fn equal_images_have_no_error() {
    let a = chequered(19, 11, 4, 3.0);
    for metric in [rel_mse, rmse, mean_error, flip] {
        assert_eq!(metric(&a, &a), Ok(0.0));
    }
}

#[test]
fn symmetry_is_as_stated() {
    let (a, b) = (chequered(16, 16, 1, 1.0), chequered(16, 16, 2, 1.0));
    assert_eq!(rmse(&a, &b), rmse(&b, &a));
    assert_eq!(mean_error(&a, &b).unwrap(), -mean_error(&b, &a).unwrap());
    assert_eq!(flip::ldr_for_test(&a, &b), flip::ldr_for_test(&b, &a));
}

#[test]
fn images_of_other_shapes_are_refused() {
    let (a, b) = (chequered(4, 3, 1, 1.0), chequered(3, 4, 1, 1.0));
    for metric in [rel_mse, rmse, mean_error, flip] {
        assert_eq!(metric(&a, &b), Err(MetricError::SizeMismatch { image: (4, 3, 3), reference: (3, 4, 3) }));
        assert_eq!(metric(&image(0, 5, |_, _, _| 0.0), &image(0, 5, |_, _, _| 0.0)), Err(MetricError::Empty));
    }
    let grey = Image::new(Extent { width: 2, height: 2 }, 1);
    assert_eq!(flip(&grey, &grey), Err(MetricError::NotColour { metric: "FLIP", found: 1 }));
    assert!(MetricError::Empty.to_string().contains("no pixels"));
}

#[test]
fn flip_agrees_with_its_authors() {
    // Means printed by the authors' package, version 1.7, at its default viewing conditions.
    let found = flip(&chequered(48, 40, 2, 0.8), &chequered(48, 40, 1, 1.0)).unwrap();
    let patched = |x: u32, y: u32, c: u32| (20..24).contains(&y) && (20..30).contains(&x) && c == 0;
    let reference = chequered(48, 40, 3, 0.02);
    let shown = image(48, 40, |x, y, c| reference.at(x, y, c as usize) + if patched(x, y, c) { 4.0 } else { 0.0 });
    let patch = flip(&shown, &reference).unwrap();
    let clipped = |seed, scale| {
        let mut i = chequered(48, 40, seed, scale);
        i.data_mut().iter_mut().for_each(|v| *v = v.min(1.0));
        i
    };
    let ldr = flip::ldr_for_test(&clipped(1, 1.0), &clipped(2, 0.8));
    let ldr = ldr.iter().map(|v| f64::from(*v)).sum::<f64>() / ldr.len() as f64;
    for (found, authors) in [(found, 0.219_945_65), (patch, 0.024_256_66), (ldr, 0.300_105_57)] {
        assert!((found - authors).abs() < 2e-5, "{found} against {authors}");
    }
}

#[test]
fn flip_is_bounded_and_grows_with_noise() {
    let reference = chequered(32, 32, 7, 0.5);
    let noisy =
        |amount: f32| image(32, 32, |x, y, c| reference.at(x, y, c as usize) + amount * (((x * 7 + y * 13 + c * 5) % 11) as f32 / 11.0));
    let errors: Vec<f64> = [0.0, 0.02, 0.1, 0.5, 2.0].iter().map(|a| flip(&noisy(*a), &reference).unwrap()).collect();
    assert!(errors.windows(2).all(|w| w[0] < w[1]), "{errors:?}");
    let black = image(32, 32, |_, _, _| 0.0);
    let white = image(32, 32, |x, _, _| if x % 2 == 0 { f32::INFINITY } else { 1e30 });
    for (a, b) in [(&black, &white), (&white, &black), (&black, &black), (&white, &reference)] {
        let map = flip_map(a, b).unwrap();
        assert!(map.data().iter().all(|v| (0.0..=1.0).contains(v)));
    }
    assert!(flip(&white, &black).unwrap() > 0.9);
    let poisoned = image(32, 32, |x, _, _| if x == 3 { f32::NAN } else { -1.0 });
    assert_eq!(flip(&poisoned, &black), Ok(0.0));
}

#[test]
fn flip_does_not_depend_on_threads() {
    let (a, b) = (chequered(70, 33, 1, 4.0), chequered(70, 33, 9, 4.0));
    let with = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| flip_map(&a, &b).unwrap());
    assert_eq!(with(1), with(3));
}
