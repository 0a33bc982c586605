//! From boxes to a wide tree. The binary tree comes from obvhs (PLOC with parallel reinsertion); which of its nodes become
//! children of one wide node, and which leaves, minimises the expected cost of a ray.

use super::Bounds;
use super::node::{Child, Node, WIDTH};
use arrayvec::ArrayVec;
use obvhs::{
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

/// A tree; what its leaves' numbers mean is their owner's.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    pub(super) nodes: Vec<Node>,
}

impl Tree {
    /// Builds over boxes, with at most `most` items in a leaf. `leaf` is given the items of each leaf and returns its number,
    /// below 2³¹. Boxes must be finite.
    pub(crate) fn build(boxes: &[Bounds], most: usize, mut leaf: impl FnMut(&[u32]) -> usize) -> Self {
        if boxes.is_empty() {
            return Self::default();
        }
        if boxes.len() <= most {
            let all = boxes.iter().fold(Bounds::EMPTY, |b, x| b.union(*x));
            let items: Vec<u32> = (0..boxes.len() as u32).collect();
            return Self { nodes: vec![Node::new(&[(all, Child::leaf(leaf(&items)))])] };
        }
        let binary = binary(boxes);
        let mut widening = Widening { cuts: cuts(&binary, most), binary, nodes: vec![Node::new(&[])], leaf, items: Vec::new() };
        widening.fill(0, 0);
        Self { nodes: widening.nodes }
    }

    /// Bounds of everything.
    pub(crate) fn bounds(&self) -> Bounds {
        self.nodes.first().map_or(Bounds::EMPTY, Node::bounds)
    }
}

/// The binary tree, one item a leaf.
fn binary(boxes: &[Bounds]) -> Bvh2 {
    let items = (0..boxes.len() as u32).collect();
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::Low, boxes, items, SortPrecision::U64, 1);
    ReinsertionOptimizer::default().run(&mut binary, 0.05, None);
    binary
}

/// How the part of a binary tree below a node is best cut into boxes.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// `cost[i]`: as at most i + 1 children of one wide node.
    cost: [f32; WIDTH],
    /// `left[i]`: how many of those come from the left child; 0 if it is best to stay one.
    left: [u8; WIDTH],
    /// The same for all the children of the wide node that it is itself.
    open: u8,
    /// Whether it is best a leaf where it stays one.
    leaf: bool,
    /// Items below.
    items: u32,
}

/// Cost of a node's visit in units of a leaf's. Measured: rates hardly change between 0.7 and 2.
const NODE_COST: f32 = 1.0;

/// The best cuts of all binary nodes, by the surface area heuristic, from the leaves up.
///
/// # Source
/// Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 3.2.
fn cuts(binary: &Bvh2, most: usize) -> Vec<Cut> {
    let mut cuts = vec![Cut { cost: [0.0; WIDTH], left: [0; WIDTH], open: 0, leaf: true, items: 1 }; binary.nodes.len()];
    // Parents come before children here, so that the reverse order is from the leaves up.
    let mut order = vec![0];
    let mut next = 0;
    while next < order.len() {
        let node = &binary.nodes[order[next]];
        if !node.is_leaf() {
            order.extend([node.first_index as usize, node.first_index as usize + 1]);
        }
        next += 1;
    }
    for &k in order.iter().rev() {
        let node = &binary.nodes[k];
        let area = node.aabb().half_area();
        if node.is_leaf() {
            cuts[k].cost = [area; WIDTH];
            continue;
        }
        let (l, r) = (cuts[node.first_index as usize], cuts[node.first_index as usize + 1]);
        let mut cut = Cut { cost: [f32::INFINITY; WIDTH], left: [0; WIDTH], open: 0, leaf: false, items: l.items + r.items };
        for i in 1..WIDTH {
            for from_left in 1..=i {
                let cost = l.cost[from_left - 1] + r.cost[i - from_left];
                if cost < cut.cost[i] {
                    (cut.cost[i], cut.left[i]) = (cost, from_left as u8);
                }
            }
        }
        cut.open = cut.left[WIDTH - 1];
        cut.cost[0] = area * NODE_COST + cut.cost[WIDTH - 1];
        if cut.items as usize <= most && area <= cut.cost[0] {
            (cut.cost[0], cut.leaf) = (area, true);
        }
        for i in 1..WIDTH {
            if cut.cost[0] <= cut.cost[i] {
                (cut.cost[i], cut.left[i]) = (cut.cost[0], 0);
            }
        }
        cuts[k] = cut;
    }
    cuts
}

/// The wide tree while it grows.
struct Widening<F> {
    binary: Bvh2,
    cuts: Vec<Cut>,
    nodes: Vec<Node>,
    leaf: F,
    items: Vec<u32>,
}

impl<F: FnMut(&[u32]) -> usize> Widening<F> {
    /// Fills node `at` with what stands for the inside of the binary node of this index.
    fn fill(&mut self, index: usize, at: usize) {
        let mut inside = ArrayVec::<usize, WIDTH>::new();
        let (first, from_left) = (self.binary.nodes[index].first_index as usize, self.cuts[index].open as usize);
        self.gather(first, from_left - 1, &mut inside);
        self.gather(first + 1, WIDTH - 1 - from_left, &mut inside);
        let mut children = ArrayVec::<(Bounds, Child), WIDTH>::new();
        for &k in &inside {
            let aabb = self.binary.nodes[k].aabb();
            let child = if self.cuts[k].leaf {
                self.items.clear();
                collect(&self.binary, k, &mut self.items);
                Child::leaf((self.leaf)(&self.items))
            } else {
                self.nodes.push(Node::new(&[]));
                Child::node(self.nodes.len() - 1)
            };
            children.push((Bounds { lower: aabb.min.into(), upper: aabb.max.into() }, child));
        }
        self.nodes[at] = Node::new(&children);
        for (k, (_, child)) in inside.into_iter().zip(children) {
            if child.as_leaf().is_none() {
                self.fill(k, child.index());
            }
        }
    }

    /// The binary nodes that stand for this one as at most `more` + 1 children.
    fn gather(&self, index: usize, more: usize, out: &mut ArrayVec<usize, WIDTH>) {
        match self.cuts[index].left[more] as usize {
            0 => out.push(index),
            from_left => {
                let first = self.binary.nodes[index].first_index as usize;
                self.gather(first, from_left - 1, out);
                self.gather(first + 1, more - from_left, out);
            }
        }
    }
}

fn collect(binary: &Bvh2, k: usize, items: &mut Vec<u32>) {
    let node = &binary.nodes[k];
    let first = node.first_index as usize;
    if node.is_leaf() {
        items.extend_from_slice(&binary.primitive_indices[first..first + node.prim_count as usize]);
    } else {
        collect(binary, first, items);
        collect(binary, first + 1, items);
    }
}
