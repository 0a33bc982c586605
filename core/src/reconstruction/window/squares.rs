//! Weighted least squares over a window by conjugate gradients.
//!
//! **When to stop.** With the inverses of variances as weights, noise alone puts the images off the truth by one unit of ‖·‖²_A for each of
//! their values, whatever the weights are. What the iteration still lacks, rᵀ M⁻¹ r, is in the same unit, so the two can be compared: a solve
//! ends when it lacks a ten thousandth of what noise does. Solving on would cost time that samples use better.

use super::super::{ReconstructError, SolveReport};
use super::gradients::Enough;
use super::source::Source;
use super::system::{Rule, System};
use crate::film::Image;

/// Relative residual ‖b − Ax‖ / ‖b‖ at which the images are good enough where there is no noise.
pub(super) const TOLERANCE: f64 = 1e-5;
/// What the images may lack over what noise puts them off.
const SHARE: f64 = 1e-4;
/// Iterations at most.
const MOST: u32 = 200;

/// What is enough where noise puts every pixel off by `unit` in the measure of the weights: variance of a measurement times its weight, summed
/// over channels. A moment by itself is solved as a single frame is.
pub(super) fn by_noise(source: &Source, unit: f64) -> Enough {
    if source.moments.len() == 1 {
        return Enough::residual(TOLERANCE);
    }
    let pixels = source.moments.iter().map(|moment| moment.extent().pixels() as f64).sum::<f64>();
    Enough { residual: TOLERANCE, energy: SHARE * unit.max(0.0) * pixels }
}

/// The images under weights that do not depend on them.
pub(super) fn solve(source: Source, rule: &impl Rule, enough: Enough) -> Result<(Vec<Image>, SolveReport), ReconstructError> {
    let mut system = System::new(source);
    system.start_from_primals();
    system.weigh(rule);
    let b = system.right_hand_side();
    let solved = system.improve(b, enough, MOST);
    if !solved.residual.is_finite() {
        return Err(ReconstructError::Diverged { iterations: solved.iterations, residual: solved.residual });
    }
    Ok((system.images(), SolveReport { iterations: solved.iterations, residual: solved.residual, alpha: 0.0 }))
}
