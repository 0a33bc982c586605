//! Weighted least squares over a window by conjugate gradients.

use super::super::{ReconstructError, SolveReport};
use super::source::Source;
use super::system::{Rule, System};
use crate::film::Image;

/// Relative residual ‖b − Ax‖ / ‖b‖ at which the images are good enough: far below noise.
pub(super) const TOLERANCE: f64 = 1e-5;
/// Iterations at most.
const MOST: u32 = 200;

/// The images under weights that do not depend on them.
pub(super) fn solve(source: Source, rule: &impl Rule, tolerance: f64) -> Result<(Vec<Image>, SolveReport), ReconstructError> {
    let mut system = System::new(source);
    system.start_from_primals();
    system.weigh(rule);
    let b = system.right_hand_side();
    let solved = system.improve(b, tolerance, MOST);
    if !solved.residual.is_finite() {
        return Err(ReconstructError::Diverged { iterations: solved.iterations, residual: solved.residual });
    }
    Ok((system.images(), SolveReport { iterations: solved.iterations, residual: solved.residual, alpha: 0.0 }))
}
