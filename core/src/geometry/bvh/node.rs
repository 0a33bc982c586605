//! A node of a wide tree: boxes tested together, and what each holds.

use super::Bounds;
use crate::math::Vec4;

/// Boxes of a node. Measured: eight make two thirds of the visits of four, and each waits once for memory and for the branch after it.
pub(super) const WIDTH: usize = 8;
/// Vectors of four that its planes fill.
pub(super) const VECTORS: usize = WIDTH / 4;

/// What a box holds: another node, or a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Child(u32);

/// Set for leaves.
const LEAF: u32 = 1 << 31;

impl Child {
    /// Another node, by index.
    pub(crate) fn node(index: usize) -> Self {
        Child(index as u32)
    }

    /// A leaf, by a number below 2³¹ that its owner understands.
    pub(crate) fn leaf(index: usize) -> Self {
        Child(index as u32 | LEAF)
    }

    /// The leaf's number, or `None` for a node.
    #[inline]
    pub(crate) fn as_leaf(self) -> Option<u32> {
        (self.0 & LEAF != 0).then_some(self.0 & !LEAF)
    }

    /// The node's index, or nonsense for a leaf.
    #[inline]
    pub(super) fn index(self) -> usize {
        self.0 as usize
    }
}

/// Boxes by coordinate. Absent ones are inside out: no ray meets them.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Node {
    /// By axis: the lower planes of all boxes, then the upper planes.
    pub(super) planes: [[[Vec4; VECTORS]; 2]; 3],
    pub(super) children: [Child; WIDTH],
}

impl Node {
    /// Of at most [`WIDTH`] boxes.
    pub(super) fn new(boxes: &[(Bounds, Child)]) -> Self {
        let mut node = Node { planes: [[[Vec4::INFINITY; VECTORS], [Vec4::NEG_INFINITY; VECTORS]]; 3], children: [Child::leaf(0); WIDTH] };
        for (k, (bounds, child)) in boxes.iter().enumerate() {
            for axis in 0..3 {
                node.planes[axis][0][k / 4][k % 4] = bounds.lower[axis];
                node.planes[axis][1][k / 4][k % 4] = bounds.upper[axis];
            }
            node.children[k] = *child;
        }
        node
    }

    /// Bounds of all boxes.
    pub(super) fn bounds(&self) -> Bounds {
        let lower = self.planes.map(|[lower, _]| lower.iter().fold(f32::INFINITY, |a, b| a.min(b.min_element())));
        let upper = self.planes.map(|[_, upper]| upper.iter().fold(f32::NEG_INFINITY, |a, b| a.max(b.max_element())));
        Bounds { lower: lower.into(), upper: upper.into() }
    }
}
