//! Conjugate gradients for the moments of a window, preconditioned by multigrid cycles of each moment by itself and one of what all have in common.

use super::super::field::{Field, Row};
use super::super::solver::{Solved, Squares};
use super::operator::{Operator, inner};
use super::precondition::Preconditioner;

/// When images are good enough; either will do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Enough {
    /// ‖b − Ax‖ / ‖b‖ in every channel.
    pub(super) residual: f64,
    /// What the images lack, ‖x − A⁻¹b‖²_A summed over channels, as far as the preconditioner can tell.
    pub(super) energy: f64,
}

impl Enough {
    /// A relative residual, whatever the noise.
    pub(super) const fn residual(residual: f64) -> Self {
        Self { residual, energy: 0.0 }
    }
}

/// Memory of the iteration.
pub(super) struct Gradients {
    /// b − A x.
    pub(super) residual: Vec<Field>,
    preconditioned: Vec<Field>,
    direction: Vec<Field>,
    /// Scratch between solves.
    pub(super) image: Vec<Field>,
}

impl Gradients {
    pub(super) fn new(width: usize, height: usize, moments: usize) -> Self {
        let fields = || fields(width, height, moments);
        Self { residual: fields(), preconditioned: fields(), direction: fields(), image: fields() }
    }

    /// Improves x, whose residual stands in `residual` with the squared norms given, until it is good `enough` or `most` iterations are done.
    pub(super) fn improve(
        &mut self,
        operator: &mut Operator,
        preconditioner: &mut Preconditioner,
        x: &mut [Field],
        squares: Squares,
        enough: Enough,
        most: u32,
    ) -> Solved {
        let mut residual = squares.relative();
        let (mut iterations, mut before) = (0, [0.0; 3]);
        while residual > enough.residual && iterations < most {
            preconditioner.apply(&self.residual, &mut self.preconditioned);
            let now = inner(&self.residual, &self.preconditioned);
            if now.iter().sum::<f64>() <= enough.energy {
                break;
            }
            let beta: [f32; 3] = std::array::from_fn(|c| if iterations == 0 { 0.0 } else { ratio(now[c], before[c]) });
            before = now;
            combine(&mut self.direction, &self.preconditioned, |p, z, c| z + beta[c] * p);
            let curvature = operator.apply(&self.direction, &mut self.image);
            let step: [f32; 3] = std::array::from_fn(|c| ratio(now[c], curvature[c]));
            combine(x, &self.direction, |x, p, c| x + step[c] * p);
            combine(&mut self.residual, &self.image, |r, ap, c| r - step[c] * ap);
            residual = Squares { residual: inner(&self.residual, &self.residual), ..squares }.relative();
            iterations += 1;
        }
        Solved { iterations, residual }
    }
}

/// Zeros for every moment.
pub(super) fn fields(width: usize, height: usize, moments: usize) -> Vec<Field> {
    (0..moments).map(|_| Field::new(width, height)).collect()
}

/// Replaces each value a by `f(a, b, channel)`.
fn combine(a: &mut [Field], b: &[Field], f: impl Fn(f32, f32, usize) -> f32 + Sync) {
    for (a, b) in a.iter_mut().zip(b) {
        a.each_row(|Row { y, channel, values }| {
            for (a, b) in values.iter_mut().zip(b.row(y, channel)) {
                *a = f(*a, *b, channel);
            }
        });
    }
}

fn ratio(a: f64, b: f64) -> f32 {
    if b > 0.0 { (a / b) as f32 } else { 0.0 }
}
