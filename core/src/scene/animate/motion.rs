//! What moves: which shapes stand elsewhere, or have another form, at another time.

use std::collections::{BTreeMap, BTreeSet};

use super::target::{self, Element};
use crate::scene::description::{Geometry, SceneDescription, Shape, Transform};

/// How the shapes of a scene move.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in crate::scene) struct Motion {
    /// Shapes of the scene that stand elsewhere at another time.
    pub(in crate::scene) moved: BTreeSet<usize>,
    /// Shapes of the scene whose own form changes.
    pub(in crate::scene) deformed: BTreeSet<usize>,
    /// Groups in which a shape moves or changes its form.
    pub(in crate::scene) groups: BTreeSet<String>,
}

impl Motion {
    /// Whether no shape moves.
    pub(in crate::scene) fn is_none(&self) -> bool {
        *self == Motion::default()
    }

    /// What tracks move, directly or through nodes.
    pub(in crate::scene) fn of(scene: &SceneDescription) -> Motion {
        let mut motion = Motion::default();
        let Some(animation) = &scene.animation else { return motion };
        let (mut placed, mut formed, mut turned) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        for track in &animation.tracks {
            match target::find(scene, &track.target) {
                Some((Element::Node(name), _)) => {
                    turned.insert(name);
                }
                Some((element, rest)) => {
                    if rest.starts_with(".to_world") {
                        placed.insert(element);
                    } else if rest.starts_with(".geometry") {
                        formed.insert(element);
                    }
                }
                None => {}
            }
        }
        let parents: BTreeMap<&str, Option<&str>> =
            animation.nodes.iter().map(|(name, node)| (name.as_str(), node.parent.as_deref())).collect();
        let moving = |name: &str| {
            let above = |name: &&str| parents.get(*name).copied().flatten();
            std::iter::successors(Some(name), above).take(parents.len() + 1).any(|name| turned.contains(name))
        };
        let through = |transform: &Transform| transform.nodes().any(moving);
        let hung = |shape: &Shape| match &shape.geometry {
            Geometry::Mesh(mesh) => mesh.skin.iter().flat_map(|skin| &skin.joints).any(|joint| moving(&joint.node)),
            _ => false,
        };
        for (index, shape) in scene.shapes.iter().enumerate() {
            let element = Element::Shape(index);
            if placed.contains(&element) || through(&shape.to_world) {
                motion.moved.insert(index);
            }
            if formed.contains(&element) || hung(shape) {
                motion.deformed.insert(index);
            }
        }
        for (name, shapes) in &scene.groups {
            let moves = shapes.iter().enumerate().any(|(index, shape)| {
                let element = Element::Group(name.clone(), index);
                placed.contains(&element) || formed.contains(&element) || through(&shape.to_world) || hung(shape)
            });
            if moves {
                motion.groups.insert(name.clone());
            }
        }
        motion
    }
}
