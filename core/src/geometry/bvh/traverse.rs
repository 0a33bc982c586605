//! Walks a tree: nearest child first for the closest hit, any order for occlusion. Box tests are conservative: rounding can
//! only make a box larger (Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013), so no ray slips between boxes.

use super::collapse::{Leaf, Node, Tree};
use crate::math::{Ray, Vec4};

/// A ray prepared for box tests.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Probe {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
}

impl Probe {
    #[inline]
    pub(crate) fn new(ray: &Ray) -> Self {
        // A finite stand-in for 1/0 keeps 0 · ∞ out of the slab test.
        let inverse = |d: f32| if d.abs() > 1e-37 { 1.0 / d } else { 1e37f32.copysign(d) };
        let (o, d) = (ray.origin, ray.direction);
        Self {
            origin: [Vec4::splat(o.x), Vec4::splat(o.y), Vec4::splat(o.z)],
            inverse: [Vec4::splat(inverse(d.x)), Vec4::splat(inverse(d.y)), Vec4::splat(inverse(d.z))],
        }
    }

    /// Which of the four boxes the ray enters before `reach`, and where.
    #[inline]
    fn test(&self, node: &Node, reach: f32) -> (u32, Vec4) {
        let mut near = Vec4::ZERO;
        let mut far = Vec4::splat(reach);
        for axis in 0..3 {
            let a = (node.lower[axis] - self.origin[axis]) * self.inverse[axis];
            let b = (node.upper[axis] - self.origin[axis]) * self.inverse[axis];
            near = near.max(a.min(b));
            far = far.min(a.max(b) * WIDEN);
        }
        (near.cmple(far).bitmask() & u32::from(node.present), near)
    }
}

/// 1 + 2γ₃: covers the rounding of the three operations of a slab test.
const WIDEN: f32 = 1.0 + 8.0 * f32::EPSILON;
const DEPTH: usize = 192;

/// Visits leaves that the ray may meet within its shrinking reach. `leaf` returns the new reach.
#[inline]
pub(crate) fn closest(tree: &Tree, probe: &Probe, mut reach: f32, mut leaf: impl FnMut(Leaf, f32) -> f32) {
    if tree.nodes.is_empty() {
        return;
    }
    let mut stack = [(0u32, 0u8, 0.0f32); DEPTH];
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let (first, count, entry) = stack[top];
        if entry > reach {
            continue;
        }
        if count > 0 {
            reach = leaf(Leaf { first, count: u32::from(count) }, reach);
            continue;
        }
        let node = &tree.nodes[first as usize];
        let (mut mask, near) = probe.test(node, reach);
        let near = near.to_array();
        let base = top;
        while mask != 0 {
            let k = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let entry = near[k];
            // Insertion keeps the nearest child on top; equal distances keep their order, so the walk is deterministic.
            let mut slot = top;
            while slot > base && stack[slot - 1].2 < entry {
                stack[slot] = stack[slot - 1];
                slot -= 1;
            }
            stack[slot] = (node.first[k], node.count[k], entry);
            top += 1;
        }
    }
}

/// Whether `leaf` is true of any leaf that the ray may meet within `reach`.
#[inline]
pub(crate) fn any(tree: &Tree, probe: &Probe, reach: f32, mut leaf: impl FnMut(Leaf) -> bool) -> bool {
    if tree.nodes.is_empty() {
        return false;
    }
    let mut stack = [0u32; DEPTH];
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let node = &tree.nodes[stack[top] as usize];
        let (mut mask, _) = probe.test(node, reach);
        while mask != 0 {
            let k = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            if node.count[k] == 0 {
                stack[top] = node.first[k];
                top += 1;
            } else if leaf(Leaf { first: node.first[k], count: u32::from(node.count[k]) }) {
                return true;
            }
        }
    }
    false
}
