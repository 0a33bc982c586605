//! Where nodes stand: in the world, or in the frame of the nearest node above them that moves.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DMat4, DQuat};

use super::super::super::description::{Animation, Node as Frame, Operation, Track, Transform};
use super::super::naming::Naming;
use super::Source;
use super::animation::{Channels, Path};
use super::document::Node;
use super::node::matrix;

/// Where a node stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stand {
    /// From its frame to the world, as without animation.
    pub(super) rest: DMat4,
    /// The nearest node at or above it that became a node of the description.
    anchor: Option<usize>,
    /// From its frame to that node's.
    within: DMat4,
}

impl Stand {
    /// The world itself.
    pub(super) const WORLD: Stand = Stand { rest: DMat4::IDENTITY, anchor: None, within: DMat4::IDENTITY };

    /// Something that stands in its frame.
    pub(super) fn then(self, matrix: DMat4) -> Stand {
        Stand { rest: self.rest * matrix, within: self.within * matrix, ..self }
    }

    /// Whether it stands where it does at all times.
    pub(super) fn rests(&self) -> bool {
        self.anchor.is_none()
    }

    /// Whether it is flat at all times, whatever moves above it.
    pub(super) fn is_flat(&self) -> bool {
        let flat = |matrix: &DMat4| matrix.determinant().abs() < f64::MIN_POSITIVE || !matrix.is_finite();
        if self.rests() { flat(&self.rest) } else { flat(&self.within) }
    }
}

/// The nodes of the description, as far as the scene was walked.
#[derive(Debug, Default)]
pub(super) struct Stands {
    channels: Channels,
    /// Nodes that become nodes of the description.
    anchors: BTreeSet<usize>,
    /// Names of those that did.
    named: BTreeMap<usize, String>,
    animation: Animation,
    names: Naming,
}

impl Stands {
    pub(super) fn new(channels: Channels, anchors: BTreeSet<usize>) -> Stands {
        Stands { channels, anchors, ..Stands::default() }
    }

    /// The channels of the file.
    pub(super) fn channels(&self) -> &Channels {
        &self.channels
    }

    /// Where a node stands whose parent stands there.
    pub(super) fn step(&mut self, parent: Stand, index: usize, node: &Node) -> Stand {
        let local = matrix(node);
        let rest = parent.rest * local;
        if !self.anchors.contains(&index) {
            return Stand { rest, anchor: parent.anchor, within: parent.within * local };
        }
        let moves = [Path::Scale, Path::Rotation, Path::Translation].map(|path| self.channels.get(index, path).cloned());
        let to_parent = if moves.iter().any(Option::is_some) {
            let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
            let rotation = if rotation.length() > 0.0 { rotation } else { DQuat::IDENTITY };
            let mut operations = vec![
                Operation::Scale(node.scale.unwrap_or([1.0; 3])),
                Operation::Quaternion(rotation.to_array()),
                Operation::Translate(node.translation.unwrap_or([0.0; 3])),
            ];
            operations.extend(Transform::from_matrix(parent.within).0);
            Transform(operations)
        } else {
            Transform::from_matrix(parent.within * local)
        };
        let name = self.names.fresh(&node.name, "node");
        for ((place, field), keys) in [(0, "scale"), (1, "quaternion"), (2, "translate")].into_iter().zip(moves) {
            if let Some(keys) = keys {
                let target = format!("animation.nodes.{name}.to_parent[{place}].{field}");
                self.animation.tracks.push(Track { target, ..keys });
            }
        }
        let parent = parent.anchor.and_then(|anchor| self.named.get(&anchor)).cloned();
        self.animation.nodes.insert(name.clone(), Frame { parent, to_parent });
        self.named.insert(index, name);
        Stand { rest, anchor: Some(index), within: DMat4::IDENTITY }
    }

    /// Whether a node becomes one of the description.
    pub(super) fn is_anchor(&self, index: usize) -> bool {
        self.anchors.contains(&index)
    }

    /// A transform to the world, at all times.
    pub(super) fn to_world(&self, stand: &Stand) -> Transform {
        match stand.anchor.and_then(|anchor| self.named.get(&anchor)) {
            None => Transform::from_matrix(stand.rest),
            Some(name) => {
                let mut transform = Transform::from_matrix(stand.within);
                transform.0.push(Operation::Node(name.clone()));
                transform
            }
        }
    }

    /// The name of a joint's node; one of its own where the joint is not in the scene.
    pub(super) fn joint(&mut self, index: usize, node: &Node) -> String {
        if let Some(name) = self.named.get(&index) {
            return name.clone();
        }
        let name = self.names.fresh(&node.name, "node");
        self.animation.nodes.insert(name.clone(), Frame::default());
        self.named.insert(index, name.clone());
        name
    }

    /// Lets the weights of a node's mesh move those of a shape.
    pub(super) fn weigh(&mut self, node: usize, shape: usize) {
        if let Some(keys) = self.channels.get(node, Path::Weights) {
            let target = format!("shapes[{shape}].geometry.mesh.morph.weights");
            self.animation.tracks.push(Track { target, ..keys.clone() });
        }
    }

    /// What moves in the description, if anything does.
    pub(super) fn animation(self) -> Option<Animation> {
        (self.animation != Animation::default()).then_some(self.animation)
    }
}

/// Nodes that must become nodes of the description: those that move, and the joints of meshes whose form changes.
pub(super) fn anchors(source: &Source<'_>, channels: &Channels) -> BTreeSet<usize> {
    let nodes = &source.document.nodes;
    let mut anchors = channels.turned();
    let mut parents = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        node.children.iter().filter(|child| **child < nodes.len()).for_each(|child| parents[*child] = Some(index));
    }
    let turned = anchors.clone();
    let moves = |joint: &usize| {
        let above = |node: &usize| parents.get(*node).copied().flatten();
        std::iter::successors(Some(*joint), above).take(nodes.len() + 1).any(|node| turned.contains(&node))
    };
    for (index, node) in nodes.iter().enumerate() {
        let Some(skin) = node.skin.and_then(|skin| source.document.skins.get(skin)) else { continue };
        if skin.joints.iter().any(moves) || source.is_blended(index, channels) {
            anchors.extend(&skin.joints);
        }
    }
    anchors
}
