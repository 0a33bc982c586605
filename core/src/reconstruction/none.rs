//! No reconstruction: the primal is the image.

use super::{Measurements, Reconstruct, ReconstructError, SolveReport};
use crate::film::Image;

/// Leaves the primal as it is.
pub(super) struct None;

impl Reconstruct for None {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        true
    }

    fn solve(&self, own: &Measurements, _other: Option<&Measurements>, _alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        Ok((own.primal.clone(), SolveReport::default()))
    }
}
