//! No reconstruction: the primal is the image.

use super::{Measurements, Reconstruct, ReconstructError, SolveReport};
use crate::film::Image;

/// Leaves the primal as it is.
pub(super) struct None;

impl Reconstruct for None {
    fn is_linear(&self) -> bool {
        true
    }

    fn solve(&self, measurements: &Measurements, _alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        Ok((measurements.primal.clone(), SolveReport::default()))
    }
}
