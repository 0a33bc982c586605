//! Walks a tree: nearest child first for the closest hit, any order for occlusion. Box tests are conservative: rounding can
//! only make a box larger (Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013), so no ray slips between boxes.

use super::collapse::{Leaf, Node, Tree};
use crate::math::{Ray, Vec4};
use arrayvec::ArrayVec;

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
/// Entries that a walk can defer before it recurses: enough for any tree that is not degenerate, and cheap to set aside.
const STACK: usize = 48;

/// A deferred child: first entry or node, number of entries (0 for a node), distance of its box.
type Deferred = (u32, u8, f32);

/// Visits leaves that the ray may meet within its shrinking reach. `leaf` returns the new reach.
#[inline]
pub(crate) fn closest(tree: &Tree, probe: &Probe, reach: f32, mut leaf: impl FnMut(Leaf, f32) -> f32) {
    if !tree.nodes.is_empty() {
        closest_below(tree, probe, 0, reach, &mut leaf);
    }
}

fn closest_below<F: FnMut(Leaf, f32) -> f32>(tree: &Tree, probe: &Probe, start: u32, mut reach: f32, leaf: &mut F) -> f32 {
    let mut stack = ArrayVec::<Deferred, STACK>::new();
    let mut node = &tree.nodes[start as usize];
    loop {
        let (mut mask, near) = probe.test(node, reach);
        let base = stack.len();
        while mask != 0 {
            let k = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let child = (node.first[k], node.count[k], near[k]);
            if stack.is_full() {
                reach = if child.1 > 0 {
                    leaf(Leaf { first: child.0, count: u32::from(child.1) }, reach)
                } else {
                    closest_below(tree, probe, child.0, reach, leaf)
                };
                continue;
            }
            // Insertion keeps the nearest child on top; equal distances keep their order, so the walk is deterministic.
            stack.push(child);
            let mut slot = stack.len() - 1;
            while slot > base && stack[slot - 1].2 < child.2 {
                stack.swap(slot, slot - 1);
                slot -= 1;
            }
        }
        loop {
            let Some((first, count, entry)) = stack.pop() else { return reach };
            if entry > reach {
                continue;
            }
            if count == 0 {
                node = &tree.nodes[first as usize];
                break;
            }
            reach = leaf(Leaf { first, count: u32::from(count) }, reach);
        }
    }
}

/// Whether `leaf` is true of any leaf that the ray may meet within `reach`.
#[inline]
pub(crate) fn any(tree: &Tree, probe: &Probe, reach: f32, mut leaf: impl FnMut(Leaf) -> bool) -> bool {
    !tree.nodes.is_empty() && any_below(tree, probe, 0, reach, &mut leaf)
}

fn any_below<F: FnMut(Leaf) -> bool>(tree: &Tree, probe: &Probe, start: u32, reach: f32, leaf: &mut F) -> bool {
    let mut stack = ArrayVec::<u32, STACK>::new();
    stack.push(start);
    while let Some(index) = stack.pop() {
        let node = &tree.nodes[index as usize];
        let (mut mask, _) = probe.test(node, reach);
        while mask != 0 {
            let k = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let found = if node.count[k] > 0 {
                leaf(Leaf { first: node.first[k], count: u32::from(node.count[k]) })
            } else if stack.is_full() {
                any_below(tree, probe, node.first[k], reach, leaf)
            } else {
                stack.push(node.first[k]);
                false
            };
            if found {
                return true;
            }
        }
    }
    false
}
