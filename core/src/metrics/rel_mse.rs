//! Relative mean squared error: the metric in which this project states what accuracy costs.

use super::{MetricError, check};
use crate::film::Image;

/// Added to the squared grey value of the reference, so that black pixels do not count for everything [radiance²].
pub const REL_MSE_FLOOR: f64 = 1e-3;

/// Mean over pixels and channels of (I − R)² / (grey(R)² + 10⁻³), grey being the mean over channels; nothing is clamped.
///
/// Not finite where a value of the images is not. The literature has at least three definitions, some three times as large:
/// compare only with what was measured in the same way.
///
/// # Errors
/// If the images differ in shape or have no pixels.
pub fn rel_mse(image: &Image, reference: &Image) -> Result<f64, MetricError> {
    check(image, reference)?;
    let channels = reference.channels();
    let mut sum = 0.0;
    for i in 0..reference.extent().pixels() {
        let (mut grey, mut square) = (0.0, 0.0);
        for c in 0..channels {
            let r = f64::from(reference.plane(c)[i]);
            let difference = f64::from(image.plane(c)[i]) - r;
            grey += r;
            square += difference * difference;
        }
        grey /= channels as f64;
        sum += square / (grey * grey + REL_MSE_FLOOR);
    }
    Ok(sum / reference.data().len() as f64)
}
