//! How one of a scene's lights is chosen.

use super::tree::{LightTree, Reach};
use crate::math::Vec3;
use crate::sampling::Discrete;

/// Lights with a place from which on a tree chooses among them.
pub const TREE_FROM: usize = 16;

/// How one of the lights is chosen.
#[derive(Clone, Debug)]
pub(super) enum Choice {
    /// By power, the same from everywhere.
    Power(Discrete),
    /// By power between the lights at infinity and all others together; among these by a tree.
    Tree {
        /// Those with a place.
        tree: LightTree,
        /// The others.
        infinite: Vec<u32>,
        /// First the tree, then each of the others.
        groups: Discrete,
        /// The group of each light.
        group: Vec<u32>,
    },
}

impl Choice {
    /// From the power of each light and, if it has a place, its reach. `None` if no light has any power.
    pub(super) fn new(lights: &[(f32, Option<Reach>)], tree_from: usize) -> Option<Self> {
        let powers: Vec<f32> = lights.iter().map(|(power, _)| *power).collect();
        let all = Discrete::new(&powers)?;
        let near: Vec<(u32, Reach)> =
            lights.iter().zip(0..).filter_map(|((power, reach), k)| Some((k, (*reach)?)).filter(|_| *power > 0.0)).collect();
        if near.len() < tree_from.max(1) {
            return Some(Choice::Power(all));
        }
        let infinite: Vec<u32> = lights.iter().zip(0..).filter(|((_, reach), _)| reach.is_none()).map(|(_, k)| k).collect();
        let together: f64 = near.iter().map(|(light, _)| f64::from(powers[*light as usize])).sum();
        let mut weights = vec![together as f32];
        weights.extend(infinite.iter().map(|k| powers[*k as usize]));
        let mut group = vec![0; lights.len()];
        for (k, light) in infinite.iter().enumerate() {
            group[*light as usize] = k as u32 + 1;
        }
        Some(Choice::Tree { tree: LightTree::build(near, lights.len()), infinite, groups: Discrete::new(&weights)?, group })
    }

    /// A light for a point, by a number in [0, 1), and its probability [1].
    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: f32) -> Option<(u32, f32)> {
        match self {
            Choice::Power(all) => {
                let (light, probability, _) = all.sample(u);
                Some((light as u32, probability))
            }
            Choice::Tree { tree, infinite, groups, .. } => match groups.sample(u) {
                (0, probability, rest) => tree.sample(from, rest).map(|(light, share)| (light, share * probability)),
                (group, probability, _) => Some((infinite[group - 1], probability)),
            },
        }
    }

    /// Probability with which [`sample`](Self::sample) chooses a light from a point [1].
    #[inline]
    pub(super) fn probability(&self, from: Vec3, light: u32) -> f32 {
        match self {
            Choice::Power(all) => all.probability(light as usize),
            Choice::Tree { tree, groups, group, .. } => match group[light as usize] {
                0 => groups.probability(0) * tree.probability(from, light),
                group => groups.probability(group as usize),
            },
        }
    }
}
