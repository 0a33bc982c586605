//! Root of the mean squared error: absolute, so bright pixels rule it.

use super::{MetricError, check};
use crate::film::Image;

/// Square root of the mean over pixels and channels of (I − R)² [radiance].
///
/// # Errors
/// If the images differ in shape or have no pixels.
pub fn rmse(image: &Image, reference: &Image) -> Result<f64, MetricError> {
    check(image, reference)?;
    let square = |(i, r): (&f32, &f32)| {
        let difference = f64::from(*i) - f64::from(*r);
        difference * difference
    };
    let sum: f64 = image.data().iter().zip(reference.data()).map(square).sum();
    Ok((sum / image.data().len() as f64).sqrt())
}
