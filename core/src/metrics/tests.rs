//! Worked numbers and the properties that each measure must have.

use super::*;
use crate::lattice::Extent;

fn flat(rgb: [f32; 3]) -> Image {
    let extent = Extent { width: 24, height: 20 };
    let mut image = Image::new(extent, 3);
    for (c, v) in rgb.into_iter().enumerate() {
        image.plane_mut(c).fill(v);
    }
    image
}

fn noisy(amount: f32) -> Image {
    let mut image = flat([0.5, 0.4, 0.3]);
    for (k, v) in image.data_mut().iter_mut().enumerate() {
        *v += amount * (((k * 7919) % 101) as f32 / 50.0 - 1.0);
    }
    image
}

#[test]
fn numbers_worked_by_hand() {
    let (a, r) = (flat([1.0, 2.0, 3.0]), flat([1.0, 1.0, 1.0]));
    assert!((rel_mse(&a, &r).unwrap() - (5.0 / 3.0) / 1.001).abs() < 1e-9);
    assert!((rmse(&a, &r).unwrap() - (5.0f64 / 3.0).sqrt()).abs() < 1e-9);
    assert!((mean_error(&a, &r).unwrap() - 1.0).abs() < 1e-9);
}

#[test]
fn equal_images_have_no_error_and_sizes_must_match() {
    let a = noisy(0.3);
    assert_eq!((rel_mse(&a, &a).unwrap(), rmse(&a, &a).unwrap(), mean_error(&a, &a).unwrap(), flip(&a, &a).unwrap()), (0.0, 0.0, 0.0, 0.0));
    let b = Image::new(Extent { width: 3, height: 20 }, 3);
    assert!(flip(&a, &b).unwrap_err().to_string().contains("3×20"));
    assert!(rel_mse(&a, &b).is_err() && rmse(&a, &b).is_err() && mean_error(&a, &b).is_err());
}

#[test]
fn flip_is_bounded_symmetric_and_grows_with_noise() {
    let base = flat([0.5, 0.4, 0.3]);
    let mut before = 0.0;
    for amount in [0.02, 0.05, 0.1, 0.3] {
        let f = flip(&noisy(amount), &base).unwrap();
        assert!(f > before && f <= 1.0, "{f} after {before}");
        assert!((f - flip(&base, &noisy(amount)).unwrap()).abs() < 1e-12);
        before = f;
    }
    // Of flat images only colour counts. Green against blue is the largest difference on the scale, which defines 1.
    assert!((flip(&flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0])).unwrap() - 1.0).abs() < 1e-6);
    assert!(flip(&flat([0.5; 3]), &flat([0.51; 3])).unwrap() < 0.06);
}
