//! How far an image is from a reference. Sums run in f64, in the order of the pixels.

mod flip;
mod mean_error;
mod rel_mse;
mod rmse;

pub use flip::flip;
pub use mean_error::mean_error;
pub use rel_mse::rel_mse;
pub use rmse::rmse;

use crate::film::Image;

/// The two images differ in size or channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the image is {}×{} with {} channels, the reference {}×{} with {}", image.0, image.1, image.2, reference.0, reference.1, reference.2)]
pub struct SizeMismatch {
    /// Columns, rows and channels of the image.
    pub image: (u32, u32, usize),
    /// Columns, rows and channels of the reference.
    pub reference: (u32, u32, usize),
}

fn same_size(image: &Image, reference: &Image) -> Result<(), SizeMismatch> {
    let size = |i: &Image| (i.extent().width, i.extent().height, i.channels());
    if size(image) == size(reference) { Ok(()) } else { Err(SizeMismatch { image: size(image), reference: size(reference) }) }
}

#[cfg(test)]
mod tests;
