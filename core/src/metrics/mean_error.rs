//! Energy that was lost or gained.

use super::{SizeMismatch, same_size};
use crate::film::Image;

/// Mean over pixels and channels of I − R: negative where energy was lost.
///
/// # Errors
/// If the images differ in size.
pub fn mean_error(image: &Image, reference: &Image) -> Result<f64, SizeMismatch> {
    same_size(image, reference)?;
    let sum: f64 = image.data().iter().zip(reference.data()).map(|(i, r)| f64::from(*i) - f64::from(*r)).sum();
    Ok(sum / image.data().len().max(1) as f64)
}
