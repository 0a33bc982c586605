//! Files: OpenEXR for what was measured, PNG for the eye.

pub mod exr;
pub mod png;

/// Why an image file could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The OpenEXR library refused.
    #[error("OpenEXR: {0}")]
    Exr(#[from] ::exr::error::Error),
    /// The PNG library refused.
    #[error("PNG: {0}")]
    Png(#[from] ::png::EncodingError),
    /// A layer that the file does not have.
    #[error("the file has no channel `{wanted}`; it has {found}")]
    MissingChannel {
        /// What was looked for.
        wanted: String,
        /// What there is.
        found: String,
    },
    /// A file larger than this program reads.
    #[error("the file holds {width}×{height} pixels in {channels} channels, at most {most} values are read")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Channels of the layer.
        channels: usize,
        /// Limit on their product.
        most: usize,
    },
    /// Images of one file that differ in size.
    #[error("layer `{layer}` is {found_width}×{found_height}, the image {width}×{height}")]
    Size {
        /// Which layer.
        layer: String,
        /// Its columns.
        found_width: u32,
        /// Its rows.
        found_height: u32,
        /// The image's columns.
        width: u32,
        /// The image's rows.
        height: u32,
    },
    /// An image with a number of channels that has no name.
    #[error("layer `{layer}` has {found} channels, 1 or 3 can be written")]
    Channels {
        /// Which layer.
        layer: String,
        /// How many it has.
        found: usize,
    },
}
