//! A stand-in for the inverse of a window's operator: multigrid cycles of each moment by itself, and of what runs of moments have in common.
//!
//! The cycles invert the blocks within moments. What they leave are images that hardly change in time, where differences in time weigh much.
//! For those a picture is summed over a run of moments along their links, a cycle of the summed operator is applied, and what it says is added
//! to all of them: once for the whole window and once for each half of it, because links end where something new comes into sight. With
//! shorter runs as well there were about a tenth fewer iterations, which cost more.
//!
//! # Source
//! Additive multilevel: Bramble, Pasciak and Xu, "Parallel Multilevel Preconditioners", Mathematics of Computation 55(191), 1990.

use super::super::field::Field;
use super::super::multigrid::{Cycle, Hierarchy};
use super::super::solver::Precondition;
use super::super::stencil::Stencil;
use super::links::Links;
use super::operator::Operator;
use super::trails::Trails;
use std::ops::Range;

/// All runs, single moments first.
pub(super) struct Preconditioner {
    moments: usize,
    runs: Vec<Run>,
    sum: Field,
    answer: Field,
}

/// The picture that a run of moments has in common, as seen in its middle.
struct Run {
    moments: Range<usize>,
    stencil: Stencil,
    hierarchy: Hierarchy,
    trails: Trails,
}

impl Preconditioner {
    /// For moments of one size, linked in a row. Weights are taken by [`adapt`](Self::adapt).
    pub(super) fn new(width: usize, height: usize, links: &[Option<Links>]) -> Self {
        let run = |moments: Range<usize>| Run {
            stencil: Stencil::new(width, height),
            hierarchy: Hierarchy::new(width, height),
            trails: Trails::new(width * height, &links[moments.start..moments.end - 1]),
            moments,
        };
        let moments = links.len() + 1;
        let runs = runs(moments).into_iter().map(run).collect();
        Self { moments, runs, sum: Field::new(width, height), answer: Field::new(width, height) }
    }

    /// Takes the weights of the operator.
    pub(super) fn adapt(&mut self, operator: &Operator) {
        for Run { moments, stencil, hierarchy, trails } in &mut self.runs {
            if moments.len() == 1 {
                *stencil = operator.block(moments.start, [true; 2]);
            } else {
                for weights in [&mut stencil.screen, &mut stencil.wx, &mut stencil.wy] {
                    weights.fill(0.0);
                }
                // Within the run nothing changes; what lies before and after it stays.
                for (k, t) in moments.clone().enumerate() {
                    trails.add_stencil(k, &operator.block(t, [t == moments.start, t + 1 == moments.end]), stencil);
                }
                // Every pixel must be held by something.
                stencil.screen.iter_mut().for_each(|v| *v = v.max(f32::MIN_POSITIVE));
            }
            hierarchy.adapt(stencil);
        }
    }

    /// z ≈ A⁻¹ r.
    pub(super) fn apply(&mut self, r: &[Field], z: &mut [Field]) {
        let (single, longer) = self.runs.split_at_mut(self.moments);
        for (Run { stencil, hierarchy, .. }, (r, z)) in single.iter_mut().zip(r.iter().zip(z.iter_mut())) {
            Cycle { stencil, hierarchy }.precondition(r, z);
        }
        for Run { moments, stencil, hierarchy, trails } in longer {
            trails.sum(&r[moments.clone()], &mut self.sum);
            Cycle { stencil, hierarchy }.precondition(&self.sum, &mut self.answer);
            trails.add(&self.answer, &mut z[moments.clone()]);
        }
    }
}

/// Single moments, then all of them, then both halves of them.
fn runs(moments: usize) -> Vec<Range<usize>> {
    let middle = moments.div_ceil(2);
    let longer = [0..moments, 0..middle, middle..moments].into_iter().filter(|run| run.len() > 1);
    (0..moments).map(|t| t..t + 1).chain(longer).collect()
}
