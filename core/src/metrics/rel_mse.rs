//! Relative mean squared error.

use super::{SizeMismatch, same_size};
use crate::film::Image;

/// Mean over pixels and channels of (I − R)² / (grey(R)² + 10⁻³), grey the mean over the reference's channels, nothing clamped.
///
/// The literature has at least three definitions of this name, a factor of three apart: compare only what one program measured.
///
/// # Errors
/// If the images differ in size.
pub fn rel_mse(image: &Image, reference: &Image) -> Result<f64, SizeMismatch> {
    same_size(image, reference)?;
    let (pixels, channels) = (image.extent().pixels(), image.channels());
    let mut sum = 0.0;
    for k in 0..pixels {
        let grey = (0..channels).map(|c| f64::from(reference.plane(c)[k])).sum::<f64>() / channels as f64;
        let squares: f64 = (0..channels).map(|c| (f64::from(image.plane(c)[k]) - f64::from(reference.plane(c)[k])).powi(2)).sum();
        sum += squares / (grey * grey + 1e-3);
    }
    Ok(sum / (pixels * channels).max(1) as f64)
}
