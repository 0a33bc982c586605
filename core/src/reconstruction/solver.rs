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
    /// z ≈ A⁻¹ r; returns ⟨r, z⟩ by channel.
    fn precondition(&mut self, r: &Field, z: &mut Field) -> [f64; 3];
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

/// Squared norms of the right-hand side and of the residual, by channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Squares {
    pub(super) b: [f64; 3],
    pub(super) residual: [f64; 3],
}

impl Squares {
    /// The largest ‖b − Ax‖ / ‖b‖ of the channels; that of a channel whose b is zero is taken to be ‖b − Ax‖.
    pub(super) fn relative(&self) -> f64 {
        let relative = |c: usize| if self.b[c] > 0.0 { (self.residual[c] / self.b[c]).sqrt() } else { self.residual[c].sqrt() };
        // A residual that is not a number must not vanish in a maximum.
        (0..3).map(relative).fold(0.0, |most, r| if r > most || r.is_nan() { r } else { most })
    }
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
        preconditioner: Option<&mut dyn Precondition>,
        b: &Field,
        x: &mut Field,
        tolerance: f64,
        most: u32,
    ) -> Solved {
        let squared = operator.residual(b, x, &mut self.residual);
        self.improve(operator, preconditioner, x, Squares { b: b.dot(b), residual: squared }, tolerance, most)
    }

    /// Where to write the residual b − A x before [`improve`](Self::improve).
    pub(super) fn residual(&mut self) -> &mut Field {
        &mut self.residual
    }

    /// The same as [`solve`](Self::solve), where [`residual`](Self::residual) already holds b − A x, whose squared norm is given with that of b.
    pub(super) fn improve(
        &mut self,
        operator: &impl Operator,
        mut preconditioner: Option<&mut dyn Precondition>,
        x: &mut Field,
        squares: Squares,
        tolerance: f64,
        most: u32,
    ) -> Solved {
        let mut residual = squares.relative();
        let (mut now, mut before) = (squares.residual, [0.0; 3]);
        let mut step = [0.0f32; 3];
        let mut iterations = 0;
        while residual > tolerance && iterations < most {
            let z = match &mut preconditioner {
                Some(preconditioner) => {
                    now = preconditioner.precondition(&self.residual, &mut self.preconditioned);
                    &self.preconditioned
                }
                None => &self.residual,
            };
            // A channel that is solved exactly stands still while the others go on. The last step is taken when its direction is at hand.
            let beta: [f32; 3] = std::array::from_fn(|c| if iterations == 0 { 0.0 } else { ratio(now[c], before[c]) });
            before = now;
            if iterations == 0 {
                self.direction.each_row(|row| row.values.copy_from_slice(z.row(row.y, row.channel)));
            } else {
                self.direction.each_pair(x, |row, x| {
                    let (step, beta) = (step[row.channel], beta[row.channel]);
                    for (p, (z, x)) in row.values.iter_mut().zip(z.row(row.y, row.channel).iter().zip(x)) {
                        *x += step * *p;
                        *p = z + beta * *p;
                    }
                });
            }
            let curvature = operator.apply(&self.direction, &mut self.image);
            step = std::array::from_fn(|c| ratio(now[c], curvature[c]));
            now = self.residual.sum_rows(|row| {
                let step = step[row.channel];
                for (r, ap) in row.values.iter_mut().zip(self.image.row(row.y, row.channel)) {
                    *r -= step * ap;
                }
                dot(row.values, row.values)
            });
            residual = Squares { residual: now, ..squares }.relative();
            iterations += 1;
        }
        if iterations > 0 {
            x.each_row(|row| {
                for (x, p) in row.values.iter_mut().zip(self.direction.row(row.y, row.channel)) {
                    *x += step[row.channel] * p;
                }
            });
        }
        Solved { iterations, residual }
    }
}

fn ratio(a: f64, b: f64) -> f32 {
    if b > 0.0 { (a / b) as f32 } else { 0.0 }
}
