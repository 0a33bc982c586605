//! Files: OpenEXR for what was measured, PNG for the eye, animated PNG for moving pictures.

pub mod apng;
pub mod exr;
pub mod png;
pub mod sheet;

/// Why an image file could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The OpenEXR library refused.
    #[error("OpenEXR: {0}")]
    Exr(#[from] ::exr::error::Error),
    /// The PNG library refused.
    #[error("PNG: {0}")]
    Png(#[from] ::png::EncodingError),
    /// No PNG file, or not one of eight bits in red, green and blue.
    #[error("reading PNG: {0}")]
    Unreadable(String),
    /// The finished file could not be handed on.
    #[error("writing: {0}")]
    Write(#[from] std::io::Error),
    /// An animation that ended before its last frame.
    #[error("the animation ended {missing} frames too early")]
    Frames {
        /// How many were to come.
        missing: u32,
    },
    /// A layer that the file does not have.
    #[error("the file has no channels {wanted}; it has {found}")]
    MissingChannels {
        /// What was looked for.
        wanted: String,
        /// What there is.
        found: String,
    },
    /// A file with channels of fewer values than pixels.
    #[error("channel `{channel}` has a value every {across}×{down} pixels, only channels with a value in each pixel are read")]
    Subsampled {
        /// Which channel.
        channel: String,
        /// Distance of its values [columns].
        across: usize,
        /// Distance of its values [rows].
        down: usize,
    },
    /// A file whose compression is not read.
    #[error("the file has {found}, only none, RLE, ZIP, PIZ and PXR24 are read")]
    Compression {
        /// How it is compressed.
        found: String,
    },
    /// An image without pixels, or larger than files may be.
    #[error("the image is {width}×{height}, between 1 and {most} pixels can be read and written")]
    Pixels {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
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
    /// Two layers of one name.
    #[error("layer `{layer}` is given twice, names of layers must differ")]
    Twice {
        /// Which layer.
        layer: String,
    },
}
