//! Mean error: how much energy an image has gained or lost as a whole. Robust reconstructions lose some; noise does not show here.

use super::{MetricError, check};
use crate::film::Image;

/// Mean of the image minus mean of the reference, over pixels and channels [radiance]. Negative where energy is lost.
///
/// # Errors
/// If the images differ in shape or have no pixels.
pub fn mean_error(image: &Image, reference: &Image) -> Result<f64, MetricError> {
    check(image, reference)?;
    let sum: f64 = image.data().iter().zip(reference.data()).map(|(i, r)| f64::from(*i) - f64::from(*r)).sum();
    Ok(sum / image.data().len() as f64)
}
