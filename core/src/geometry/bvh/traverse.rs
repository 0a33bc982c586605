//! Walks a tree: nearest child first for the closest hit, any order for occlusion. Box tests are conservative: rounding can
//! only make a box larger (Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013), so no ray slips between boxes.

use super::Tree;
use super::node::{Child, Node, VECTORS, WIDTH};
use crate::math::{Ray, Vec4};
use arrayvec::ArrayVec;

/// A ray prepared for box tests.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Probe {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// By axis: which plane the ray meets first, 0 for the lower one.
    first: [usize; 3],
}

impl Probe {
    #[inline]
    pub(crate) fn new(ray: &Ray) -> Self {
        let (o, d) = (ray.origin, ray.direction.extend(1.0));
        // A finite stand-in for 1/0 keeps 0 · ∞ out of the slab test.
        let tiny = Vec4::splat(1e-37);
        let inverse = Vec4::select(d.abs().cmpgt(tiny), d, tiny.copysign(d)).recip();
        let signs = d.is_negative_bitmask() as usize;
        Self {
            origin: [Vec4::splat(o.x), Vec4::splat(o.y), Vec4::splat(o.z)],
            inverse: [Vec4::splat(inverse.x), Vec4::splat(inverse.y), Vec4::splat(inverse.z)],
            first: [signs & 1, signs >> 1 & 1, signs >> 2 & 1],
        }
    }

    /// Which of the boxes the ray enters before `limit`, and where. Differences have exact signs, so what lies behind stays behind.
    #[inline(always)]
    fn test(&self, node: &Node, limit: f32) -> (u32, [f32; WIDTH]) {
        let [x, y, z] = self.first;
        let mut mask = 0;
        let mut entries = [0.0; WIDTH];
        for v in 0..VECTORS {
            let meet = |axis: usize, side: usize| (node.planes[axis][side & 1][v] - self.origin[axis]) * self.inverse[axis];
            let near = meet(0, x).max(meet(1, y)).max(meet(2, z)).max(Vec4::ZERO);
            let far = meet(0, x ^ 1).min(meet(1, y ^ 1)).min(meet(2, z ^ 1)) * WIDEN;
            mask |= near.cmple(far.min(Vec4::splat(limit))).bitmask() << (4 * v);
            entries[4 * v..4 * v + 4].copy_from_slice(&near.to_array());
        }
        (mask, entries)
    }
}

/// 1 + 2γ₃: covers the rounding of the three operations of a slab test.
const WIDEN: f32 = 1.0 + 8.0 * f32::EPSILON;
/// Entries that a walk can defer before it recurses: enough for any tree that is not degenerate, and cheap to set aside.
const STACK: usize = 64;
/// Most entries that one node adds.
const ADDED: usize = WIDTH - 1;

/// Visits leaves that the ray may meet within its shrinking reach. `leaf` returns the new reach.
#[inline]
pub(crate) fn closest(tree: &Tree, probe: &Probe, reach: f32, mut leaf: impl FnMut(u32, f32) -> f32) {
    if !tree.nodes.is_empty() {
        closest_below(tree, probe, 0, reach, &mut leaf);
    }
}

fn closest_below<F: FnMut(u32, f32) -> f32>(tree: &Tree, probe: &Probe, start: usize, mut reach: f32, leaf: &mut F) -> f32 {
    let mut stack = ArrayVec::<(Child, f32), STACK>::new();
    let mut current = Child::node(start);
    loop {
        if let Some(index) = current.as_leaf() {
            reach = leaf(index, reach);
        } else if stack.remaining_capacity() < ADDED {
            reach = closest_below(tree, probe, current.index(), reach, leaf);
        } else {
            let node = &tree.nodes[current.index()];
            let (mut mask, near) = probe.test(node, reach * WIDEN);
            if mask != 0 {
                let base = stack.len();
                let mut next = take(&mut mask, node, &near);
                // Equal distances keep the order of the node, so the walk is deterministic.
                while mask != 0 {
                    let mut other = take(&mut mask, node, &near);
                    if other.1 < next.1 {
                        std::mem::swap(&mut other, &mut next);
                    }
                    let mut slot = stack.len();
                    stack.push(other);
                    while slot > base && stack[slot - 1].1 < other.1 {
                        stack.swap(slot, slot - 1);
                        slot -= 1;
                    }
                }
                current = next.0;
                continue;
            }
        }
        // A distance that rounding moved must not hide an equal hit.
        let limit = reach * WIDEN;
        current = loop {
            match stack.pop() {
                None => return reach,
                Some((child, near)) if near <= limit => break child,
                Some(_) => {}
            }
        };
    }
}

/// The lowest child of a mask, with the distance of its box.
#[inline(always)]
fn take(mask: &mut u32, node: &Node, near: &[f32; WIDTH]) -> (Child, f32) {
    let k = mask.trailing_zeros() as usize % WIDTH;
    *mask &= *mask - 1;
    (node.children[k], near[k])
}

/// Whether `leaf` is true of any leaf that the ray may meet within `reach`.
#[inline]
pub(crate) fn any(tree: &Tree, probe: &Probe, reach: f32, mut leaf: impl FnMut(u32) -> bool) -> bool {
    !tree.nodes.is_empty() && any_below(tree, probe, 0, reach, &mut leaf)
}

fn any_below<F: FnMut(u32) -> bool>(tree: &Tree, probe: &Probe, start: usize, reach: f32, leaf: &mut F) -> bool {
    let mut stack = ArrayVec::<Child, STACK>::new();
    let mut current = Child::node(start);
    let limit = reach * WIDEN;
    loop {
        if stack.remaining_capacity() < ADDED {
            if any_below(tree, probe, current.index(), reach, leaf) {
                return true;
            }
        } else {
            let node = &tree.nodes[current.index()];
            let (mut mask, _) = probe.test(node, limit);
            while mask != 0 {
                let child = node.children[mask.trailing_zeros() as usize % WIDTH];
                mask &= mask - 1;
                match child.as_leaf() {
                    Some(index) => {
                        if leaf(index) {
                            return true;
                        }
                    }
                    None => stack.push(child),
                }
            }
        }
        match stack.pop() {
            Some(child) => current = child,
            None => return false,
        }
    }
}
