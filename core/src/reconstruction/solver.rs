//! Conjugate gradients for the three channels of a frame at once: they share the operator, whose weights are then read once for all.

use super::field::{Field, Row, dot};

/// A symmetric positive definite operator, alike for all channels.
pub(super) trait Operator: Sync {
    /// One row and channel of A x.
    fn row(&self, x: &Field, out: &mut Row);

    /// out = A x; returns ⟨x, A x⟩ by channel.
    fn apply(&self, x: &Field, out: &mut Field) -> [f64; 3] {
        out.sum_rows(|mut row| {
            self.row(x, &mut row);
            dot(row.values, x.row(row.y, row.channel))
        })
    }

    /// out = b − A x; returns its squared norm by channel.
    fn residual(&self, b: &Field, x: &Field, out: &mut Field) -> [f64; 3] {
        out.sum_rows(|mut row| {
            self.row(x, &mut row);
            for (r, b) in row.values.iter_mut().zip(b.row(row.y, row.channel)) {
                *r = b - *r;
            }
            dot(row.values, row.values)
        })
    }
}

/// A cheap symmetric stand-in for an operator's inverse. Called once an iteration.
pub(super) trait Precondition {
    /// z ≈ A⁻¹ r.
    fn precondition(&mut self, r: &Field, z: &mut Field);
}

/// Memory of the iteration, kept from one solve to the next.
pub(super) struct ConjugateGradients {
    residual: Field,
    preconditioned: Field,
    direction: Field,
    image: Field,
}

/// How a linear solve ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Solved {
    /// Iterations, each of all channels.
    pub(super) iterations: u32,
    /// Largest ‖b − Ax‖ / ‖b‖ of the channels.
    pub(super) residual: f64,
}

impl ConjugateGradients {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let field = || Field::new(width, height);
        Self { residual: field(), preconditioned: field(), direction: field(), image: field() }
    }

    /// Solves A x = b from the given x until the residual is `tolerance` times ‖b‖ in every channel, or `most` iterations are done.
    /// Without a preconditioner the iteration is plain.
    pub(super) fn solve(
        &mut self,
        operator: &impl Operator,
        mut preconditioner: Option<&mut dyn Precondition>,
        b: &Field,
        x: &mut Field,
        tolerance: f64,
        most: u32,
    ) -> Solved {
        let norms = b.dot(b);
        let relative = |squares: [f64; 3]| {
            (0..3).map(|c| if norms[c] > 0.0 { (squares[c] / norms[c]).sqrt() } else { squares[c].sqrt() }).fold(0.0, f64::max)
        };
        let mut residual = relative(operator.residual(b, x, &mut self.residual));
        let mut before = [0.0; 3];
        for iteration in 0..most {
            if residual <= tolerance {
                return Solved { iterations: iteration, residual };
            }
            let z = match &mut preconditioner {
                Some(preconditioner) => {
                    preconditioner.precondition(&self.residual, &mut self.preconditioned);
                    &self.preconditioned
                }
                None => &self.residual,
            };
            let now = self.residual.dot(z);
            // A channel that is solved exactly stands still while the others go on.
            let beta: [f32; 3] = std::array::from_fn(|c| if iteration == 0 { 0.0 } else { ratio(now[c], before[c]) });
            before = now;
            self.direction.each_row(|row| {
                for (p, z) in row.values.iter_mut().zip(z.row(row.y, row.channel)) {
                    *p = z + beta[row.channel] * *p;
                }
            });
            let curvature = operator.apply(&self.direction, &mut self.image);
            let step: [f32; 3] = std::array::from_fn(|c| ratio(now[c], curvature[c]));
            x.each_row(|row| {
                for (x, p) in row.values.iter_mut().zip(self.direction.row(row.y, row.channel)) {
                    *x += step[row.channel] * p;
                }
            });
            residual = relative(self.residual.sum_rows(|row| {
                for (r, ap) in row.values.iter_mut().zip(self.image.row(row.y, row.channel)) {
                    *r -= step[row.channel] * ap;
                }
                super::field::dot(row.values, row.values)
            }));
        }
        Solved { iterations: most, residual }
    }
}

fn ratio(a: f64, b: f64) -> f32 {
    if b > 0.0 { (a / b) as f32 } else { 0.0 }
}
