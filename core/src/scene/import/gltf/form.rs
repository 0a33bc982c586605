//! Meshes that change their form: morph targets and the joints of skins, written into the description.

use glam::DVec3;

use super::animation::{Channels, Path};
use super::document::{Node, Primitive};
use super::skin::hang;
use super::{Importer, Source, titled};
use crate::scene::description::{Influences, Joint, MeshInline, Morph, MorphTarget, Skin};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

/// A mesh in the description, with its least and greatest corner as it is without animation.
pub(super) type Formed = (MeshInline, [DVec3; 2]);

impl Source<'_> {
    /// Whether the mesh of a node is blended towards others, now or at any time.
    pub(super) fn is_blended(&self, node: usize, channels: &Channels) -> bool {
        let Some(written) = self.document.nodes.get(node) else { return false };
        let targets = self.mesh_of(written).is_some_and(|primitives| primitives.iter().any(|primitive| !primitive.targets.is_empty()));
        let weighed = channels.get(node, Path::Weights).is_some() || self.weights(written).iter().any(|weight| *weight != 0.0);
        targets && weighed
    }

    fn mesh_of(&self, node: &Node) -> Option<&[Primitive]> {
        self.document.meshes.get(node.mesh?).map(|mesh| mesh.primitives.as_slice())
    }

    /// The weights of a node's mesh without animation: its own, else those of the mesh, else none.
    fn weights<'s>(&'s self, node: &'s Node) -> &'s [f64] {
        let mesh = || node.mesh.and_then(|mesh| self.document.meshes.get(mesh)).and_then(|mesh| mesh.weights.as_deref());
        node.weights.as_deref().or_else(mesh).unwrap_or_default()
    }
}

impl Importer {
    /// A primitive of a node's mesh with its forms and joints; `None` where it draws no triangles. `joints` are those of the node's skin
    /// with where they stand without animation, none where the mesh hangs on nothing.
    ///
    /// # Errors
    /// Accessors that are missing, malformed or too large.
    pub(super) fn formed(
        &mut self,
        source: &Source<'_>,
        (node, primitive): (usize, usize),
        uv_set: usize,
        joints: &[(Joint, glam::DMat4)],
    ) -> Result<Option<Formed>, Error> {
        let node = &source.document.nodes[node];
        let Some(index) = node.mesh else { return Ok(None) };
        let path = format!("meshes[{index}].primitives[{primitive}]");
        let written = &source.document.meshes[index];
        let Some(mesh) = self.triangles(source, index, primitive, uv_set)? else { return Ok(None) };
        let primitive = &written.primitives[primitive];
        let vertices = mesh.positions.len();
        let morph = self.morph(source, node, primitive, vertices, &path)?;
        let skin = if joints.is_empty() { None } else { self.skin(source, primitive, vertices, joints, &path)? };
        let numbers = 12 + 24 * morph.as_ref().map_or(0, |morph| morph.targets.len()) + if skin.is_some() { 24 } else { 0 };
        if self.meshes.count((vertices * numbers) as u64) > limits::MADE_BYTES {
            let expected = format!("at most {} bytes of meshes", limits::MADE_BYTES);
            return Err(source.fault(ErrorKind::TooLarge, &path, "meshes that add up to more", expected));
        }
        if !joints.is_empty() && skin.is_none() {
            let place = titled("nodes", 0, &node.name);
            self.note(format!("{place}: a part of its mesh that hangs on no joint is left out"));
            return Ok(None);
        }
        let mut rest = mesh.clone();
        if let Some(skin) = &skin {
            let matrices: Vec<glam::DMat4> = joints.iter().map(|(_, matrix)| *matrix).collect();
            for vertex in 0..vertices {
                let all = skin.influences.iter().flat_map(|set| set.joints[vertex].iter().copied().zip(set.weights[vertex]));
                hang(&mut rest, vertex, all, &matrices);
            }
        }
        Ok(Some((MeshInline { morph, skin, ..MeshInline::from(&mesh) }, super::mesh::corners(&rest))))
    }

    fn morph(
        &mut self,
        source: &Source<'_>,
        node: &Node,
        primitive: &Primitive,
        vertices: usize,
        path: &str,
    ) -> Result<Option<Morph>, Error> {
        if primitive.targets.is_empty() {
            return Ok(None);
        }
        if primitive.targets.len() > limits::MORPH_TARGETS {
            let found = format!("{} targets", primitive.targets.len());
            return Err(source.fault(ErrorKind::TooLarge, path, found, format!("at most {}", limits::MORPH_TARGETS)));
        }
        let mut targets = Vec::with_capacity(primitive.targets.len());
        for target in &primitive.targets {
            let read = |name: &str| target.get(name).map(|accessor| source.vectors::<3>(*accessor, path)).transpose();
            let (positions, normals) = (read("POSITION")?, read("NORMAL")?);
            for list in [&positions, &normals].into_iter().flatten() {
                if list.len() != vertices {
                    let found = format!("a target of {} vertices", list.len());
                    return Err(source.fault(ErrorKind::Malformed, path, found, format!("{vertices}, one for each vertex")));
                }
            }
            if target.keys().any(|name| !["POSITION", "NORMAL", "TANGENT"].contains(&name.as_str())) {
                self.note(format!("{path}: morph targets of anything but positions and normals are left out"));
            }
            targets.push(MorphTarget { positions, normals });
        }
        let mut weights = source.weights(node).to_vec();
        weights.resize(targets.len(), 0.0);
        Ok(Some(Morph { weights, targets }))
    }

    fn skin(
        &mut self,
        source: &Source<'_>,
        primitive: &Primitive,
        vertices: usize,
        joints: &[(Joint, glam::DMat4)],
        path: &str,
    ) -> Result<Option<Skin>, Error> {
        let mut influences = Vec::new();
        for set in 0.. {
            let attribute = |name: &str| primitive.attributes.get(&format!("{name}_{set}")).copied();
            let (Some(joint), Some(weight)) = (attribute("JOINTS"), attribute("WEIGHTS")) else { break };
            if set == limits::INFLUENCES {
                self.note(format!("{path}: joints past the {}th of a vertex are left out", 4 * limits::INFLUENCES));
                break;
            }
            let (names, weights) = (source.vectors::<4>(joint, path)?, source.vectors::<4>(weight, path)?);
            if names.len() != vertices || weights.len() != vertices {
                let found = format!("{} joints and {} weights", names.len(), weights.len());
                return Err(source.fault(ErrorKind::Malformed, path, found, format!("{vertices}, one for each vertex")));
            }
            // A joint that is not there counts for nothing.
            let known = |joint: f32| (joint as usize) < joints.len();
            let weights = names.iter().zip(weights).map(|(names, weights)| {
                std::array::from_fn(|k| if known(names[k]) && weights[k].is_finite() { weights[k].max(0.0) } else { 0.0 })
            });
            let weights = weights.collect();
            let joints = names.iter().map(|four| four.map(|joint| if known(joint) { joint as u16 } else { 0 })).collect();
            influences.push(Influences { joints, weights });
        }
        let joints = joints.iter().map(|(joint, _)| joint.clone()).collect();
        Ok((!influences.is_empty()).then_some(Skin { joints, influences }))
    }
}
