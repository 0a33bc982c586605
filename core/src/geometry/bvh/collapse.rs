//! From boxes to a four-wide tree. The binary tree comes from obvhs (PLOC with parallel reinsertion); pairs of its levels
//! become one node of four boxes, tested together.

use crate::math::{Vec3, Vec4};
use obvhs::{
    Boundable,
    aabb::Aabb,
    bvh2::reinsertion::ReinsertionOptimizer,
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub lower: Vec3,
    /// Upper corner.
    pub upper: Vec3,
}

impl Bounds {
    /// The empty box.
    pub const EMPTY: Bounds = Bounds { lower: Vec3::INFINITY, upper: Vec3::NEG_INFINITY };

    /// The smallest box around points.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Bounds { lower: b.lower.min(p), upper: b.upper.max(p) })
    }

    /// The smallest box around both.
    pub fn union(self, other: Bounds) -> Self {
        Bounds { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// The corners.
    pub fn corners(self) -> [Vec3; 8] {
        std::array::from_fn(|k| {
            let pick = |axis: usize| if k >> axis & 1 == 0 { self.lower[axis] } else { self.upper[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// Centre.
    pub fn centre(self) -> Vec3 {
        (self.lower + self.upper) * 0.5
    }

    /// Radius of the sphere around it. 0 if empty.
    pub fn radius(self) -> f32 {
        if self.lower.x > self.upper.x { 0.0 } else { (self.upper - self.lower).length() * 0.5 }
    }
}

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        Aabb::new(self.lower.into(), self.upper.into())
    }
}

/// What a child of a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wide {
    /// Another node.
    Node(u32),
    /// A run of leaf entries.
    Leaf(Leaf),
}

/// A run `first .. first + count` of leaf entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leaf {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

/// Four boxes, by coordinate, and what they hold.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Node {
    /// Lower corners: x of all four, y, z.
    pub(crate) lower: [Vec4; 3],
    /// Upper corners.
    pub(crate) upper: [Vec4; 3],
    /// Index of a node, or first leaf entry.
    pub(crate) first: [u32; 4],
    /// 0 for a node, else the number of leaf entries.
    pub(crate) count: [u8; 4],
    /// Bit k: child k exists.
    pub(crate) present: u8,
}

/// The tree over leaf entries; `order` maps a leaf entry to the item it was built from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
    pub(crate) order: Vec<u32>,
}

impl Tree {
    /// Builds over boxes, with at most `leaf` items in a leaf. Boxes must be finite.
    pub(crate) fn build(boxes: &[Bounds], leaf: usize) -> Self {
        if boxes.is_empty() {
            return Self::default();
        }
        if boxes.len() <= leaf {
            let all = boxes.iter().fold(Bounds::EMPTY, |b, x| b.union(*x));
            let whole = Leaf { first: 0, count: boxes.len() as u32 };
            return Self { nodes: vec![Node::new(&[(all, Wide::Leaf(whole))])], order: (0..boxes.len() as u32).collect() };
        }
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            boxes,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            1,
        );
        ReinsertionOptimizer::default().run(&mut binary, 0.05, None);
        let mut tree = Tree::default();
        tree.nodes.push(Node::new(&[]));
        tree.widen(&binary, 0, 0, leaf);
        tree
    }

    /// Fills node `at` with the up to four descendants of the binary node.
    fn widen(&mut self, binary: &obvhs::bvh2::Bvh2, index: usize, at: usize, leaf: usize) {
        let mut open = vec![index];
        // Opens the largest inner node until four remain, so that the boxes shrink as fast as they can.
        while open.len() < 4 {
            let area = |k: usize| binary.nodes[k].aabb().half_area();
            let widest = open
                .iter()
                .enumerate()
                .filter(|(_, k)| !binary.nodes[**k].is_leaf() && (open.len() == 1 || size(binary, **k, leaf) > leaf))
                .max_by(|(i, a), (j, b)| area(**a).total_cmp(&area(**b)).then(j.cmp(i)));
            let Some((slot, &k)) = widest else { break };
            let first = binary.nodes[k].first_index as usize;
            open[slot] = first;
            open.push(first + 1);
        }
        let mut children = Vec::with_capacity(4);
        let mut inner = Vec::new();
        for k in open {
            let aabb = binary.nodes[k].aabb();
            let bounds = Bounds { lower: aabb.min.into(), upper: aabb.max.into() };
            if size(binary, k, leaf) <= leaf {
                let first = self.order.len() as u32;
                collect(binary, k, &mut self.order);
                children.push((bounds, Wide::Leaf(Leaf { first, count: self.order.len() as u32 - first })));
            } else {
                let node = self.nodes.len() as u32;
                self.nodes.push(Node::new(&[]));
                inner.push((k, node as usize));
                children.push((bounds, Wide::Node(node)));
            }
        }
        self.nodes[at] = Node::new(&children);
        for (k, node) in inner {
            self.widen(binary, k, node, leaf);
        }
    }

    /// Bounds of everything.
    pub(crate) fn bounds(&self) -> Bounds {
        let Some(root) = self.nodes.first() else { return Bounds::EMPTY };
        (0..4).filter(|k| root.present >> k & 1 == 1).fold(Bounds::EMPTY, |b, k| {
            let corner = |c: &[Vec4; 3]| Vec3::new(c[0][k], c[1][k], c[2][k]);
            b.union(Bounds { lower: corner(&root.lower), upper: corner(&root.upper) })
        })
    }
}

/// Number of primitives below a binary node, counted no further than one past `limit`.
fn size(binary: &obvhs::bvh2::Bvh2, k: usize, limit: usize) -> usize {
    let node = &binary.nodes[k];
    if node.is_leaf() {
        return node.prim_count as usize;
    }
    let first = node.first_index as usize;
    let left = size(binary, first, limit);
    if left > limit { left } else { left + size(binary, first + 1, limit - left.min(limit)) }
}

fn collect(binary: &obvhs::bvh2::Bvh2, k: usize, order: &mut Vec<u32>) {
    let node = &binary.nodes[k];
    let first = node.first_index as usize;
    if node.is_leaf() {
        order.extend_from_slice(&binary.primitive_indices[first..first + node.prim_count as usize]);
    } else {
        collect(binary, first, order);
        collect(binary, first + 1, order);
    }
}

impl Node {
    fn new(children: &[(Bounds, Wide)]) -> Self {
        let mut node = Node { lower: [Vec4::ZERO; 3], upper: [Vec4::ZERO; 3], first: [0; 4], count: [0; 4], present: 0 };
        for (k, (bounds, child)) in children.iter().enumerate() {
            for axis in 0..3 {
                node.lower[axis][k] = bounds.lower[axis];
                node.upper[axis][k] = bounds.upper[axis];
            }
            node.present |= 1 << k;
            match child {
                Wide::Node(index) => node.first[k] = *index,
                Wide::Leaf(leaf) => {
                    node.first[k] = leaf.first;
                    node.count[k] = leaf.count as u8;
                }
            }
        }
        node
    }
}
