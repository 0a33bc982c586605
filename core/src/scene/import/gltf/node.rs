//! The hierarchy of nodes: where meshes, cameras and lights stand.

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec3, DVec4};

use super::super::naming::Naming;
use super::document::Node;
use super::material::Surface;
use super::stand::{self, Stand, Stands};
use super::{Importer, Source, titled};
use crate::scene::description::{Geometry, Instance, Joint, Light, MeshFile, Normals, Operation, Shape, Transform};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

/// What stands in the scene, as far as it was walked.
pub(super) struct Walk {
    pub(super) shapes: Vec<Shape>,
    pub(super) groups: BTreeMap<String, Vec<Shape>>,
    pub(super) lights: Vec<Light>,
    /// Cameras with where their nodes stand.
    pub(super) cameras: Vec<(usize, Stand)>,
    /// Nodes that moving things stand in.
    pub(super) stands: Stands,
    /// Least and greatest corner of what stands in the world; the other way round while nothing does.
    pub(super) bounds: [DVec3; 2],
    /// For each shape, the corners of its mesh in its own frame.
    pub(super) boxes: Vec<[DVec3; 2]>,
    /// Meshes by their index, read once each.
    parts: BTreeMap<usize, Parts>,
    names: Naming,
}

/// What a mesh is made of, in its own frame.
#[derive(Clone)]
struct Parts {
    /// Shapes that give off no light; one instance of a group where the mesh is placed often.
    plain: Vec<Shape>,
    /// Shapes that do. They are never in groups.
    glowing: Vec<Shape>,
    /// Least and greatest corner.
    bounds: [DVec3; 2],
}

/// Bounds that hold these, and a box in another frame.
pub(super) fn around([from, to]: [DVec3; 2], [least, most]: [DVec3; 2], frame: DMat4) -> [DVec3; 2] {
    (0..8).filter(|_| least.cmple(most).all()).fold([from, to], |[from, to], corner| {
        let pick = |bit: u32, least: f64, most: f64| if corner >> bit & 1 == 0 { least } else { most };
        let corner = DVec3::new(pick(0, least.x, most.x), pick(1, least.y, most.y), pick(2, least.z, most.z));
        let point = frame.transform_point3(corner);
        [from.min(point), to.max(point)]
    })
}

/// Bounds of nothing.
pub(super) const NOWHERE: [DVec3; 2] = [DVec3::INFINITY, DVec3::NEG_INFINITY];

impl Default for Walk {
    fn default() -> Walk {
        Walk {
            shapes: Vec::new(),
            groups: BTreeMap::new(),
            lights: Vec::new(),
            cameras: Vec::new(),
            stands: Stands::default(),
            bounds: NOWHERE,
            boxes: Vec::new(),
            parts: BTreeMap::new(),
            names: Naming::default(),
        }
    }
}

impl Walk {
    /// Walks the scene that the file shows: the one it names, else the first, else every node that is nobody's child.
    ///
    /// # Errors
    /// Indices that point to nothing, nodes with two parents or in a circle, and everything that reading what stands there may meet.
    pub(super) fn scene(&mut self, source: &Source<'_>, importer: &mut Importer) -> Result<(), Error> {
        let document = source.document;
        let roots = match (document.scene, document.scenes.first()) {
            (Some(scene), _) => source.get(&document.scenes, scene, "scene", "scenes")?.nodes.clone(),
            (None, Some(scene)) => scene.nodes.clone(),
            (None, None) => {
                let children: std::collections::BTreeSet<usize> = document.nodes.iter().flat_map(|node| node.children.clone()).collect();
                (0..document.nodes.len()).filter(|node| !children.contains(node)).collect()
            }
        };
        for index in 0..document.scenes.len() {
            if index != document.scene.unwrap_or(0) {
                importer.note(format!("scenes[{index}]: left out, another scene of the file is shown"));
            }
        }
        let channels = importer.channels(source)?;
        let anchors = stand::anchors(source, &channels);
        self.stands = Stands::new(channels, anchors);
        let mut seen = vec![false; document.nodes.len()];
        let mut visits = Vec::new();
        let mut open: Vec<(usize, Stand)> = roots.into_iter().rev().map(|root| (root, Stand::WORLD)).collect();
        while let Some((index, parent)) = open.pop() {
            let path = format!("nodes[{index}]");
            let node = source.get(&document.nodes, index, &path, "nodes")?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(source.fault(ErrorKind::Invalid, &path, "the node twice in the scene", "a tree of nodes, without circles"));
            }
            let stand = self.stands.step(parent, index, node);
            if !stand.rest.is_finite() {
                return Err(source.fault(ErrorKind::Invalid, &path, "a transform that overflows", "finite numbers"));
            }
            visits.push((index, stand));
            open.extend(node.children.iter().rev().map(|child| (*child, stand)));
        }
        let mut uses: BTreeMap<usize, usize> = BTreeMap::new();
        for mesh in visits.iter().filter_map(|(index, _)| document.nodes[*index].mesh) {
            *uses.entry(mesh).or_default() += 1;
        }
        let mut globals = vec![None; document.nodes.len()];
        visits.iter().for_each(|(index, stand)| globals[*index] = Some(stand.rest));
        for (index, stand) in visits {
            self.node(source, importer, index, stand, &uses)?;
            self.skinned(source, importer, index, stand, &globals)?;
        }
        Ok(())
    }

    fn node(
        &mut self,
        source: &Source<'_>,
        importer: &mut Importer,
        index: usize,
        stand: Stand,
        uses: &BTreeMap<usize, usize>,
    ) -> Result<(), Error> {
        let node = &source.document.nodes[index];
        let path = format!("nodes[{index}]");
        let place = titled("nodes", index, &node.name);
        for name in node.extensions.others.keys() {
            importer.note(format!("{place}: {name} is left out"));
        }
        if let Some(camera) = node.camera {
            self.cameras.push((camera, stand));
        }
        if let Some(light) = node.light() {
            let to_world = self.stands.to_world(&stand);
            self.lights.push(importer.light(source, light, (&stand, to_world), &path)?);
        }
        let blended = source.is_blended(index, self.stands.channels());
        let Some(mesh) = node.mesh.filter(|_| node.skin.is_none() && !blended) else { return Ok(()) };
        source.get(&source.document.meshes, mesh, &path, "meshes")?;
        let frames = match &node.extensions.instancing {
            Some(instancing) => copies(source, &instancing.attributes, &path)?.into_iter().map(|copy| stand.then(copy)).collect(),
            None => vec![stand],
        };
        let often = frames.len() > 1 || uses.get(&mesh).is_some_and(|uses| *uses > 1);
        let parts = self.parts(source, importer, mesh, often)?;
        let count = (parts.plain.len() + parts.glowing.len()).saturating_mul(frames.len());
        if self.shapes.len().saturating_add(count) > limits::SHAPES {
            let expected = format!("at most {}", limits::SHAPES);
            return Err(source.fault(ErrorKind::TooLarge, &path, format!("{count} more shapes"), expected));
        }
        for frame in frames {
            if frame.is_flat() {
                importer.note(format!("{place}: left out, its transform makes it flat"));
                continue;
            }
            self.place(&parts, &frame, &node.name);
        }
        Ok(())
    }

    /// Places a mesh that hangs on joints or is blended towards other forms. Where the node of one that hangs on joints stands has no
    /// bearing, only where the joints do.
    fn skinned(
        &mut self,
        source: &Source<'_>,
        importer: &mut Importer,
        index: usize,
        stand: Stand,
        globals: &[Option<DMat4>],
    ) -> Result<(), Error> {
        let node = &source.document.nodes[index];
        let blended = source.is_blended(index, self.stands.channels());
        let Some(mesh) = node.mesh.filter(|_| node.skin.is_some() || blended) else { return Ok(()) };
        let path = format!("nodes[{index}]");
        let written = source.get(&source.document.meshes, mesh, &path, "meshes")?;
        let skin = node.skin.map(|skin| source.get(&source.document.skins, skin, &path, "skins")).transpose()?;
        let matrices = skin.map(|skin| skin.matrices(source, &path, globals)).transpose()?.unwrap_or_default();
        let place = titled("nodes", index, &node.name);
        let moving = blended || skin.is_some_and(|skin| skin.joints.iter().any(|joint| self.stands.is_anchor(*joint)));
        let mut joints = Vec::new();
        for (joint, [bind, global]) in skin.into_iter().flat_map(|skin| &skin.joints).zip(&matrices).filter(|_| moving) {
            let name = self.stands.joint(*joint, &source.document.nodes[*joint]);
            let bind_rows = [0, 1, 2, 3].map(|row| bind.row(row).to_array());
            joints.push((Joint { node: name, bind: affine(bind_rows) }, *global * *bind));
        }
        let matrices: Vec<DMat4> = matrices.into_iter().map(|[bind, global]| global * bind).collect();
        if !moving {
            let name = skin.map(|skin| skin.name.as_str()).unwrap_or_default();
            importer.note(format!("{place}: its skin {name:?} is drawn as its joints stand without animation"));
        }
        let mut parts = Parts { plain: Vec::new(), glowing: Vec::new(), bounds: NOWHERE };
        for (k, primitive) in written.primitives.iter().enumerate() {
            let path = format!("meshes[{mesh}].primitives[{k}]");
            let coloured = primitive.attributes.contains_key("COLOR_0");
            let Surface { material, emission, uv_set } = importer.surface(source, primitive.material, coloured, &path)?;
            let made = if moving {
                importer.formed(source, (index, k), uv_set, &joints)?.map(|(mesh, bounds)| (Geometry::Mesh(mesh), bounds))
            } else {
                let posed = importer.posed(source, [mesh, k], uv_set, &matrices)?;
                posed.map(|(file, bounds)| (Geometry::Ply(MeshFile { file, normals: Normals::AsWritten }), bounds))
            };
            let Some((geometry, bounds)) = made else {
                importer.note(format!("{place}: a part of its mesh that hangs on no joint, or is no surface, is left out"));
                continue;
            };
            parts.bounds = [parts.bounds[0].min(bounds[0]), parts.bounds[1].max(bounds[1])];
            parts.plain.push(Shape { material: Some(material), emission, ..bare(&written.name, geometry) });
        }
        if self.shapes.len() + parts.plain.len() > limits::SHAPES {
            let expected = format!("at most {}", limits::SHAPES);
            return Err(source.fault(ErrorKind::TooLarge, &path, "more shapes", expected));
        }
        let first = self.shapes.len();
        self.place(&parts, if skin.is_some() { &Stand::WORLD } else { &stand }, &node.name);
        for shape in first..self.shapes.len() {
            if matches!(&self.shapes[shape].geometry, Geometry::Mesh(mesh) if mesh.morph.is_some()) {
                self.stands.weigh(index, shape);
            }
        }
        Ok(())
    }

    /// Places a mesh.
    fn place(&mut self, parts: &Parts, stand: &Stand, name: &str) {
        let to_world = self.stands.to_world(stand);
        for shape in parts.plain.iter().chain(&parts.glowing) {
            let name = if name.is_empty() { shape.name.clone() } else { name.to_string() };
            self.shapes.push(Shape { name, to_world: to_world.clone(), ..shape.clone() });
            self.boxes.push(parts.bounds);
        }
        self.bounds = around(self.bounds, parts.bounds, stand.rest);
    }

    /// Reads a mesh; as a group where it is placed `often`.
    fn parts(&mut self, source: &Source<'_>, importer: &mut Importer, mesh: usize, often: bool) -> Result<Parts, Error> {
        if let Some(known) = self.parts.get(&mesh) {
            return Ok(known.clone());
        }
        let written = &source.document.meshes[mesh];
        let mut parts = Parts { plain: Vec::new(), glowing: Vec::new(), bounds: NOWHERE };
        for (index, primitive) in written.primitives.iter().enumerate() {
            let path = format!("meshes[{mesh}].primitives[{index}]");
            let coloured = primitive.attributes.contains_key("COLOR_0");
            let Surface { material, emission, uv_set } = importer.surface(source, primitive.material, coloured, &path)?;
            let Some((file, bounds)) = importer.mesh(source, mesh, index, uv_set)? else { continue };
            parts.bounds = [parts.bounds[0].min(bounds[0]), parts.bounds[1].max(bounds[1])];
            let list = if emission.is_some() { &mut parts.glowing } else { &mut parts.plain };
            let geometry = Geometry::Ply(MeshFile { file, normals: Normals::AsWritten });
            list.push(Shape { material: Some(material), emission, ..bare(&written.name, geometry) });
        }
        if often && !parts.plain.is_empty() {
            let group = self.names.fresh(&written.name, "mesh");
            let instance = bare(&written.name, Geometry::Instance(Instance { of: group.clone() }));
            self.groups.insert(group, std::mem::replace(&mut parts.plain, vec![instance]));
        }
        self.parts.insert(mesh, parts.clone());
        Ok(parts)
    }
}

/// A shape in its own frame, of nothing yet.
fn bare(name: &str, geometry: Geometry) -> Shape {
    Shape {
        name: name.to_string(),
        geometry,
        to_world: Transform::default(),
        material: None,
        emission: None,
        interior: None,
        exterior: None,
        flip_normals: false,
    }
}

/// The frames of EXT_mesh_gpu_instancing.
fn copies(source: &Source<'_>, attributes: &BTreeMap<String, usize>, path: &str) -> Result<Vec<DMat4>, Error> {
    let read3 = |name: &str| attributes.get(name).map(|index| source.vectors::<3>(*index, path)).transpose();
    let (moves, scales) = (read3("TRANSLATION")?, read3("SCALE")?);
    let turns = attributes.get("ROTATION").map(|index| source.vectors::<4>(*index, path)).transpose()?;
    let counts = [moves.as_ref().map(Vec::len), scales.as_ref().map(Vec::len), turns.as_ref().map(Vec::len)];
    let count = counts.into_iter().flatten().min().unwrap_or(0);
    if count > limits::SHAPES {
        return Err(source.fault(ErrorKind::TooLarge, path, format!("{count} instances"), format!("at most {}", limits::SHAPES)));
    }
    let wide = |vector: [f32; 3]| vector.map(f64::from);
    Ok((0..count)
        .map(|k| {
            let node = Node {
                translation: moves.as_ref().map(|moves| wide(moves[k])),
                scale: scales.as_ref().map(|scales| wide(scales[k])),
                rotation: turns.as_ref().map(|turns| turns[k].map(f64::from)),
                ..Node::default()
            };
            matrix(&node)
        })
        .collect())
}

/// From a node's frame to its parent's.
pub(super) fn matrix(node: &Node) -> DMat4 {
    if let Some(columns) = &node.matrix {
        let mut matrix = DMat4::from_cols_array(columns);
        // Affine by specification; rounding in the last row is not worth a complaint.
        matrix.x_axis.w = 0.0;
        matrix.y_axis.w = 0.0;
        matrix.z_axis.w = 0.0;
        matrix.w_axis = DVec4::from((matrix.w_axis.truncate(), 1.0));
        return matrix;
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let length = rotation.length();
    let rotation = if length > 0.0 && length.is_finite() { rotation * length.recip() } else { DQuat::IDENTITY };
    let (scale, translation) = (node.scale.unwrap_or([1.0; 3]), node.translation.unwrap_or([0.0; 3]));
    DMat4::from_translation(translation.into()) * DMat4::from_quat(rotation) * DMat4::from_scale(scale.into())
}

/// A matrix by rows without what rounding left in its last row.
fn affine([x, y, z, _]: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
    [x, y, z, [0.0, 0.0, 0.0, 1.0]]
}

/// A matrix as an operation of the description.
pub(super) fn rows(matrix: DMat4) -> Operation {
    Operation::Matrix([0, 1, 2, 3].map(|row| matrix.row(row).to_array()))
}
