//! Why an image could not be reconstructed.

use crate::lattice::Extent;

/// Why an image could not be reconstructed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReconstructError {
    /// The film has no gradients.
    #[error("reconstruction `{wanted}` needs gradients, and the film has none: render with a technique that measures them, or use `none`")]
    NoGradients {
        /// The reconstruction's name.
        wanted: &'static str,
    },
    /// The film has no links.
    #[error("reconstruction `{wanted}` needs differences along links, and the film has none: render with technique graph, or use `none`")]
    NoLinks {
        /// The reconstruction's name.
        wanted: &'static str,
    },
    /// There is one set of measurements where two independent ones are needed.
    #[error("reconstruction `{wanted}` tells noise from picture by two halves, and there is one: use `l2` or `l1`")]
    NoHalves {
        /// The reconstruction's name.
        wanted: &'static str,
    },
    /// The measurements come without variances.
    #[error("reconstruction `{wanted}` needs variances, and there are none: use `cv` or `l2`")]
    NoVariances {
        /// The reconstruction's name.
        wanted: &'static str,
    },
    /// The measurements come without features.
    #[error("reconstruction `{wanted}` needs features of what the pixels see, and there are none: use `l2` or `l1`")]
    NoFeatures {
        /// The reconstruction's name.
        wanted: &'static str,
    },
    /// There is no denoiser.
    #[error("reconstruction `oidn` needs Intel Open Image Denoise, which was not found: let GRADFARM_OIDN name its library, or use `nfor`")]
    NoDenoiser,
    /// The denoiser failed.
    #[error("the denoiser failed: {fault}")]
    Denoiser {
        /// What it complained of.
        fault: String,
    },
    /// Moments cannot be solved for together by it.
    #[error("reconstruction `{wanted}` does not know time: use `l2`, `weighted-l2`, `l1` or `none`")]
    NoWindows {
        /// The reconstruction's name.
        wanted: &'static str,
    },
    /// A moment has one half only, so it shares no random numbers with the moments beside it.
    #[error("a window needs moments with samples in both halves: half A goes with the moment before, half B with the one after")]
    NoSharedSeeds,
    /// A moment is not one film or two.
    #[error("a moment has one film or two independent ones, all moments of a window alike; found {found}")]
    Copies {
        /// How many there were.
        found: usize,
    },
    /// Images that belong together differ in size.
    #[error("found {} × {} pixels where {} × {} were expected", found.width, found.height, expected.width, expected.height)]
    Sizes {
        /// What there was.
        found: Extent,
        /// What goes with the others.
        expected: Extent,
    },
    /// Windows say different things of one moment.
    #[error("found {found} images in what a window says of a moment where others have {expected}")]
    Shares {
        /// How many there were.
        found: usize,
        /// How many the others have.
        expected: usize,
    },
    /// Motion leads out of the image, or between pixels.
    #[error("motion at pixel ({}, {}): found {} columns and {} rows, expected whole numbers that lead to a pixel", pixel[0], pixel[1], found[0], found[1])]
    Motion {
        /// Where.
        pixel: [u32; 2],
        /// The displacement.
        found: [f32; 2],
    },
    /// The weight of the primal is not usable.
    #[error("alpha must be finite and greater than 0, found {found}")]
    Alpha {
        /// What was given.
        found: f32,
    },
    /// A plane that is not finite, which no film holds.
    #[error("the {plane} holds a value that is not finite at index {index}")]
    NotFinite {
        /// Which one.
        plane: &'static str,
        /// Where.
        index: usize,
    },
    /// An iterative solve left the finite numbers: the measurements are too large for it.
    #[error("the solve diverged after {iterations} iterations (relative residual {residual:e}): the measurements are too large")]
    Diverged {
        /// Linear iterations.
        iterations: u32,
        /// The last relative residual.
        residual: f64,
    },
}
