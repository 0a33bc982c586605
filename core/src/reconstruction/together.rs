//! Biased methods that make the images of both halves in one go, because the halves together tell noise from picture. They start from an
//! unbiased image and are drawn to it, so they converge to the truth.

use super::control_variates::Weighted;
use super::l2::L2;
use super::{Measurements, Reconstruct, ReconstructError, ReconstructionKind, SolveReport};
use crate::film::Image;

/// The images of two halves, or of one and another that is not looked at.
type Solved = Result<[(Image, SolveReport); 2], ReconstructError>;

/// What such a method is made of.
pub(super) trait Together: Send + Sync {
    /// Its name in the registry.
    const KIND: ReconstructionKind;

    /// The images of both halves; each has its own weight of the primal.
    fn solve_both(&self, halves: [&Measurements; 2], alphas: [f32; 2]) -> Solved;

    /// The image of measurements that stand alone; few methods have one.
    fn solve_alone(&self, _own: &Measurements) -> Result<Image, ReconstructError> {
        Err(ReconstructError::NoHalves { wanted: Self::KIND.name() })
    }
}

impl<T: Together> Reconstruct for T {
    fn joins_halves(&self) -> bool {
        true
    }

    fn is_unbiased(&self) -> bool {
        false
    }

    fn solve(&self, own: &Measurements, other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError> {
        match other {
            Some(other) => self.solve_both([own, other], [alpha; 2]).map(|[done, _]| done),
            None => Ok((self.solve_alone(own)?, SolveReport::default())),
        }
    }

    fn solve_halves(&self, halves: [&Measurements; 2], alphas: [f32; 2]) -> Solved {
        self.solve_both(halves, alphas)
    }
}

/// The unbiased images of least noise that such methods start from and are drawn to.
pub(super) fn unbiased(halves: [&Measurements; 2], alphas: [f32; 2]) -> Solved {
    if halves.iter().all(|half| half.variance.is_some()) { Weighted.solve_halves(halves, alphas) } else { L2.solve_halves(halves, alphas) }
}
