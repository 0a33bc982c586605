//! The window in the L1 norm, by iteratively reweighted least squares: as for a single frame, with differences in time beside those in space.

use super::super::l1::{EFFORT, FIRST_EPSILON, LAST_EPSILON, TOLERANCE, mean_magnitude, norms};
use super::super::normal::{Errors, Weights};
use super::super::{ReconstructError, SolveReport};
use super::gradients::Enough;
use super::links::Links;
use super::rules::Alike;
use super::source::Source;
use super::spectral::Uniform;
use super::system::{Rule, System, mask};
use crate::film::Image;

/// How exactly the least squares are solved that it starts from, and by how many iterations at most.
const START: (f64, u32) = (1e-2, 30);

/// Weights 1 / (‖e‖ + ε) times ε, of errors times their share.
struct Robust<'a> {
    links: &'a [Option<Links>],
    alpha: f32,
    /// w_t and w_m of each pair.
    pairs: &'a [[f64; 2]],
    epsilon: f32,
}

impl Robust<'_> {
    /// From norms to weights.
    fn reweight(&self, weights: &mut [f32], scale: f32) {
        for v in weights {
            *v = scale * scale * (self.epsilon / (scale * *v + self.epsilon));
        }
    }
}

impl Rule for Robust<'_> {
    fn space(&self, _moment: usize, _y: usize, errors: &Errors, row: Weights) -> f64 {
        let mut sum = 0.0;
        for (errors, weights, scale) in [(&errors.dx, row.wx, 1.0), (&errors.dy, row.wy, 1.0), (&errors.primal, row.screen, self.alpha)] {
            norms(errors, weights);
            sum += f64::from(scale) * total(weights);
            self.reweight(weights, scale);
        }
        sum
    }

    fn time(&self, pair: usize, y: usize, errors: &Errors, mut row: Weights) -> f64 {
        let links = self.links[pair].as_ref();
        let width = row.screen.len();
        let [value, slope] = self.pairs[pair].map(|w| w as f32);
        norms(&errors.primal, row.screen);
        norms(&errors.dx, row.wx);
        norms(&errors.dy, row.wy);
        mask(links, width, y, &mut row);
        let sum = f64::from(value) * total(row.screen) + f64::from(slope) * (total(row.wx) + total(row.wy));
        self.reweight(row.screen, value);
        self.reweight(row.wx, slope);
        self.reweight(row.wy, slope);
        mask(links, width, y, &mut row);
        sum
    }
}

fn total(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum()
}

/// Minimises from least squares on. `weights` are squares of what errors are multiplied by.
pub(super) fn minimise(source: Source, weights: &Uniform) -> Result<(Vec<Image>, SolveReport), ReconstructError> {
    let mut system = System::new(source);
    let mut report = SolveReport { alpha: weights.screen.sqrt() as f32, ..SolveReport::default() };
    system.start_from_primals();
    let magnitudes: f64 = (0..source.moments.len()).map(|t| mean_magnitude(&source.space(t).primal)).sum();
    let scale = magnitudes / source.moments.len() as f64;
    let (_, squared) = system.weigh(&Alike { weights, links: source.links });
    report.iterations += system.improve(squared, Enough::residual(START.0), START.1).iterations;
    if scale == 0.0 {
        return Ok((system.images(), report));
    }
    let pairs: Vec<[f64; 2]> = weights.pairs.iter().map(|pair| pair.map(f64::sqrt)).collect();
    let (mut before, mut epsilon) = (f64::INFINITY, scale * FIRST_EPSILON);
    for k in 0..=EFFORT.reweightings {
        let rule = Robust { links: source.links, alpha: report.alpha, pairs: &pairs, epsilon: epsilon as f32 };
        let (objective, squared) = system.weigh(&rule);
        if !objective.is_finite() {
            return Err(ReconstructError::Diverged { iterations: report.iterations, residual: report.residual });
        }
        if k == EFFORT.reweightings || objective == 0.0 || before.is_finite() && before - objective <= EFFORT.settled * before {
            report.residual = super::super::solver::Squares { b: system.right_hand_side(), residual: squared }.relative();
            break;
        }
        before = objective;
        report.iterations += system.improve(squared, Enough::residual(TOLERANCE), EFFORT.iterations).iterations;
        epsilon = (0.5 * epsilon).max(scale * LAST_EPSILON);
    }
    Ok((system.images(), report))
}
