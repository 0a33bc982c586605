//! A stand-in for the inverse of a window's operator: multigrid cycles of each moment by itself, and one of what all moments have in common.
//!
//! The cycles invert the blocks within moments. What they leave are images that hardly change in time, where differences in time weigh much:
//! for those a picture is summed over all moments along their links, a cycle of the summed operator is applied, and what it says is added to
//! all of them. The remaining condition does not grow with the weights of differences in time.
//!
//! # Source
//! Additive Schwarz with a coarse space: Toselli and Widlund, "Domain Decomposition Methods", 2005, chapter 2.

use super::super::field::Field;
use super::super::multigrid::{Cycle, Hierarchy};
use super::super::solver::Precondition;
use super::super::stencil::Stencil;
use super::links::Links;
use super::operator::Operator;
use super::trails::Trails;

/// Blocks of moments, and what they have in common.
pub(super) struct Preconditioner {
    blocks: Vec<Stencil>,
    hierarchies: Vec<Hierarchy>,
    common: Option<Common>,
}

/// The picture that all moments share, as seen in the middle one.
struct Common {
    stencil: Stencil,
    hierarchy: Hierarchy,
    sum: Field,
    answer: Field,
    trails: Trails,
}

impl Preconditioner {
    /// For moments of one size, linked in a row. Weights are taken by [`adapt`](Self::adapt).
    pub(super) fn new(width: usize, height: usize, links: &[Option<Links>]) -> Self {
        let common = (!links.is_empty()).then(|| Common {
            stencil: Stencil::new(width, height),
            hierarchy: Hierarchy::new(width, height),
            sum: Field::new(width, height),
            answer: Field::new(width, height),
            trails: Trails::new(width * height, links),
        });
        let hierarchies = (0..=links.len()).map(|_| Hierarchy::new(width, height)).collect();
        Self { blocks: Vec::new(), hierarchies, common }
    }

    /// Takes the weights of the operator.
    pub(super) fn adapt(&mut self, operator: &Operator) {
        self.blocks = (0..self.hierarchies.len()).map(|moment| operator.block(moment)).collect();
        for (hierarchy, block) in self.hierarchies.iter_mut().zip(&self.blocks) {
            hierarchy.adapt(block);
        }
        if let Some(common) = &mut self.common {
            common.trails.sum_stencils(&operator.space, &mut common.stencil);
            common.hierarchy.adapt(&common.stencil);
        }
    }

    /// z ≈ A⁻¹ r.
    pub(super) fn apply(&mut self, r: &[Field], z: &mut [Field]) {
        for ((stencil, hierarchy), (r, z)) in self.blocks.iter().zip(&mut self.hierarchies).zip(r.iter().zip(z.iter_mut())) {
            Cycle { stencil, hierarchy }.precondition(r, z);
        }
        if let Some(Common { stencil, hierarchy, sum, answer, trails }) = &mut self.common {
            trails.sum(r, sum);
            Cycle { stencil, hierarchy }.precondition(sum, answer);
            trails.add(answer, z);
        }
    }
}
