//! Nodes: frames of reference that hang on one another, as they stand at one instant.

use std::collections::BTreeMap;

use glam::{DMat4, DVec4};

use crate::scene::description::{Node, Operation, Transform};

/// From each node's frame to the world.
#[derive(Clone, Debug, Default)]
pub(in crate::scene) struct Frames(BTreeMap<String, DMat4>);

impl Frames {
    /// The frames of all nodes; the check of the description has ruled out circles and unknown parents.
    pub(in crate::scene) fn new(nodes: &BTreeMap<String, Node>) -> Frames {
        let mut frames: BTreeMap<String, DMat4> = BTreeMap::new();
        for name in nodes.keys() {
            // From the node up to the first ancestor that is known, then down again.
            let mut way = Vec::new();
            let mut above = Some(name);
            while let Some(name) = above.filter(|name| !frames.contains_key(*name) && way.len() < nodes.len()) {
                way.push(name);
                above = nodes.get(name).and_then(|node| node.parent.as_ref());
            }
            let mut frame = above.and_then(|name| frames.get(name)).copied().unwrap_or(DMat4::IDENTITY);
            for name in way.into_iter().rev() {
                frame *= nodes.get(name).map_or(DMat4::IDENTITY, |node| node.to_parent.matrix());
                frames.insert(name.clone(), frame);
            }
        }
        Frames(frames)
    }

    /// From a node's frame to the world.
    pub(in crate::scene) fn get(&self, name: &str) -> Option<&DMat4> {
        self.0.get(name)
    }

    /// Puts matrices in the place of nodes: one for the whole transform, if there is a node in it.
    pub(in crate::scene) fn resolve(&self, transform: &mut Transform) {
        if transform.nodes().next().is_none() {
            return;
        }
        let matrix = transform.0.iter().fold(DMat4::IDENTITY, |before, operation| match operation {
            Operation::Node(name) => self.get(name).copied().unwrap_or(DMat4::NAN) * before,
            operation => operation.matrix() * before,
        });
        *transform = Transform::from_matrix(matrix);
    }
}

/// The frame that turns and moves as a matrix does, squared up around its z axis; `None` where it is flat.
pub(super) fn rigid(matrix: DMat4) -> Option<DMat4> {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.truncate());
    let z = z.try_normalize()?;
    let left = y.cross(z).try_normalize()?;
    let left = if left.dot(x) < 0.0 { -left } else { left };
    let up = (y - z * y.dot(z)).try_normalize()?;
    Some(DMat4::from_cols(left.extend(0.0), up.extend(0.0), z.extend(0.0), DVec4::from((matrix.w_axis.truncate(), 1.0))))
}
