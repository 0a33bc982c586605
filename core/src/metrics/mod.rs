//! Metrics: how far an image is from its reference, each in a file of its own.
//!
//! All take linear radiance as it is stored, of two images of the same shape. Sums run in f64 in a fixed order.

mod flip;
mod mean_error;
mod rel_mse;
mod rmse;

pub use flip::{flip, flip_map};
pub use mean_error::mean_error;
pub use rel_mse::{REL_MSE_FLOOR, rel_mse};
pub use rmse::rmse;

use crate::film::Image;

/// Why two images cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetricError {
    /// The images differ in width, height or number of channels.
    #[error(
        "the image is {} × {} with {} channels, the reference {} × {} with {}",
        image.0, image.1, image.2, reference.0, reference.1, reference.2
    )]
    SizeMismatch {
        /// Width, height [pixels] and channels of the image.
        image: (u32, u32, usize),
        /// The same of the reference.
        reference: (u32, u32, usize),
    },
    /// There is nothing to take a mean of.
    #[error("the images have no pixels")]
    Empty,
    /// A metric of colour needs three channels.
    #[error("{metric} compares RGB images, these have {found} channels")]
    NotColour {
        /// The metric's name.
        metric: &'static str,
        /// Channels of the images.
        found: usize,
    },
}

/// Whether the images can be compared value by value.
fn check(image: &Image, reference: &Image) -> Result<(), MetricError> {
    let shape = |i: &Image| (i.extent().width, i.extent().height, i.channels());
    if shape(image) != shape(reference) {
        return Err(MetricError::SizeMismatch { image: shape(image), reference: shape(reference) });
    }
    if image.data().is_empty() { Err(MetricError::Empty) } else { Ok(()) }
}

#[cfg(test)]
mod tests;
