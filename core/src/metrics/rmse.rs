//! Root mean squared error.

use super::{SizeMismatch, same_size};
use crate::film::Image;

/// Square root of the mean over pixels and channels of (I − R)².
///
/// # Errors
/// If the images differ in size.
pub fn rmse(image: &Image, reference: &Image) -> Result<f64, SizeMismatch> {
    same_size(image, reference)?;
    let sum: f64 = image.data().iter().zip(reference.data()).map(|(i, r)| (f64::from(*i) - f64::from(*r)).powi(2)).sum();
    Ok((sum / image.data().len().max(1) as f64).sqrt())
}
