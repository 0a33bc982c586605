//! A tree over lights, so that one of many is chosen by where they lie and which way they shine.
//!
//! # Source
//! Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", PACM CGIT 1(2), 2018.

mod cone;

pub(crate) use cone::{Importance, Reach};

use crate::math::Vec3;

/// Two children, or one light.
#[derive(Clone, Copy, Debug)]
struct Node {
    importance: Importance,
    /// The second child of a node whose first child follows it; the light of a leaf.
    next: u32,
    leaf: bool,
}

/// The tree.
#[derive(Clone, Debug)]
pub(crate) struct LightTree {
    nodes: Vec<Node>,
    /// The way from the root to each light, by its number: bit k set where the second child is taken at depth k.
    ways: Vec<u64>,
}

/// Buckets that a split is looked for between.
const BUCKETS: usize = 12;
/// Past this depth lights are split in halves, so that a way fits into 64 bits: 2³⁰ lights need no more than thirty further levels.
const FREE_DEPTH: u32 = 32;

impl LightTree {
    /// Over lights given by number; `lights` is how many numbers there are. There must be at least one light.
    pub(crate) fn build(mut reaches: Vec<(u32, Reach)>, lights: usize) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * reaches.len()), ways: vec![0; lights] };
        tree.grow(&mut reaches, 0, 0);
        tree
    }

    fn grow(&mut self, reaches: &mut [(u32, Reach)], depth: u32, way: u64) -> Option<Reach> {
        let place = self.nodes.len();
        if let [(light, reach)] = reaches {
            self.ways[*light as usize] = way;
            self.nodes.push(Node { importance: (&*reach).into(), next: *light, leaf: true });
            return Some(*reach);
        }
        let whole = reaches.iter().map(|(_, reach)| *reach).reduce(|a, b| a.union(&b))?;
        self.nodes.push(Node { importance: (&whole).into(), next: 0, leaf: false });
        let middle = split(reaches, depth);
        let (first, second) = reaches.split_at_mut(middle);
        let a = self.grow(first, depth + 1, way)?;
        self.nodes[place].next = self.nodes.len() as u32;
        let b = self.grow(second, depth + 1, way | 1 << depth)?;
        // Closer than the union over all in a row.
        let both = a.union(&b);
        self.nodes[place].importance = (&both).into();
        Some(both)
    }

    /// Chooses a light for a point by one number in [0, 1): its number and the probability [1]. `None` where that is 0.
    #[inline]
    pub(crate) fn sample(&self, from: Vec3, mut u: f32) -> Option<(u32, f32)> {
        let (mut place, mut probability) = (0, 1.0);
        while let Node { leaf: false, next, .. } = self.nodes[place] {
            let first = self.first(place, next, from);
            if u < first {
                (u, place) = (u / first, place + 1);
                probability *= first;
            } else {
                (u, place) = ((u - first) / (1.0 - first), next as usize);
                probability *= 1.0 - first;
            }
        }
        (probability > 0.0).then_some((self.nodes[place].next, probability))
    }

    /// Probability with which [`sample`](Self::sample) chooses a light from a point [1].
    #[inline]
    pub(crate) fn probability(&self, from: Vec3, light: u32) -> f32 {
        let mut way = self.ways[light as usize];
        let (mut place, mut probability) = (0, 1.0);
        while let Node { leaf: false, next, .. } = self.nodes[place] {
            let first = self.first(place, next, from);
            if way & 1 == 0 {
                place += 1;
                probability *= first;
            } else {
                place = next as usize;
                probability *= 1.0 - first;
            }
            way >>= 1;
        }
        probability
    }

    /// Probability of the first child. Where neither seems to shine any choice is right, if only it is the same each time.
    #[inline]
    fn first(&self, place: usize, second: u32, from: Vec3) -> f32 {
        let a = self.nodes[place + 1].importance.at(from);
        let b = self.nodes[second as usize].importance.at(from);
        let sum = a + b;
        if sum > 0.0 && sum.is_finite() { a / sum } else { 0.5 }
    }
}

/// Sorts lights so that a good split comes after the returned number of them, which is neither 0 nor all.
fn split(reaches: &mut [(u32, Reach)], depth: u32) -> usize {
    let around = reaches.iter().map(|(_, reach)| reach.bounds.centre());
    let (lower, upper) = around.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, u), c| (l.min(c), u.max(c)));
    let extent = upper - lower;
    let longest = (0..3).fold(0, |best, axis| if extent[axis] > extent[best] { axis } else { best });
    let bucket = |reach: &Reach, axis: usize| {
        let place = (reach.bounds.centre()[axis] - lower[axis]) / extent[axis];
        ((place * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|axis| extent[*axis] > 0.0 && depth < FREE_DEPTH) {
        let mut buckets: [Option<Reach>; BUCKETS] = [None; BUCKETS];
        for (_, reach) in reaches.iter() {
            let slot = &mut buckets[bucket(reach, axis)];
            *slot = Some(slot.map_or(*reach, |sum| sum.union(reach)));
        }
        let sum = |part: &[Option<Reach>]| part.iter().flatten().copied().reduce(|a, b| a.union(&b));
        for cut in 1..BUCKETS {
            if let (Some(a), Some(b)) = (sum(&buckets[..cut]), sum(&buckets[cut..])) {
                // Thin slices are disliked.
                let cost = (extent[longest] / extent[axis]) * (cost(&a) + cost(&b));
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, cut));
                }
            }
        }
    }
    if let Some((_, axis, cut)) = best {
        // Stable, so that the order does not depend on the sorting method.
        reaches.sort_by_key(|(_, reach)| bucket(reach, axis) >= cut);
        let middle = reaches.partition_point(|(_, reach)| bucket(reach, axis) < cut);
        if middle > 0 && middle < reaches.len() {
            return middle;
        }
    }
    reaches.sort_by(|(_, a), (_, b)| a.bounds.centre()[longest].total_cmp(&b.bounds.centre()[longest]));
    reaches.len() / 2
}

fn cost(reach: &Reach) -> f32 {
    let d = reach.bounds.upper - reach.bounds.lower;
    // The square of its length tells boxes without area apart.
    let area = d.x * d.y + d.y * d.z + d.z * d.x + 0.1 * d.max_element() * d.max_element();
    reach.intensity * reach.orientation() * area
}

#[cfg(test)]
mod tests;
