//! Primitives as meshes, each written once as a PLY file however often it is used.

use std::collections::BTreeMap;

use glam::DVec3;

use super::super::naming::Naming;
use super::document::Primitive;
use super::{Importer, Source, titled};
use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};
use crate::scene::assets::MadeAssets;
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;
use crate::scene::mesh::ply_binary;

/// What makes two primitives the same mesh: accessors of position, normal, texture coordinates, colour and indices, and the mode.
type Key = (usize, Option<usize>, Option<usize>, Option<usize>, Option<usize>, u32);

/// The file of a mesh, and its least and greatest corner.
pub(super) type Written = (String, [DVec3; 2]);

/// The meshes written so far.
#[derive(Default)]
pub(super) struct Meshes {
    pub(super) made: MadeAssets,
    known: BTreeMap<Key, Option<Written>>,
    names: Naming,
    bytes: u64,
}

impl Meshes {
    /// Counts bytes, and tells how many there are.
    pub(super) fn count(&mut self, bytes: u64) -> u64 {
        self.bytes = self.bytes.saturating_add(bytes);
        self.bytes
    }
}

impl Importer {
    /// The file that holds a primitive's triangles and their bounds, with the texture coordinates of the given set; `None` where it draws none.
    ///
    /// # Errors
    /// Accessors that are missing, malformed or too large.
    pub(super) fn mesh(&mut self, source: &Source<'_>, mesh: usize, primitive: usize, uv_set: usize) -> Result<Option<Written>, Error> {
        let written = &source.document.meshes[mesh];
        let place = format!("{}.primitives[{primitive}]", titled("meshes", mesh, &written.name));
        let path = format!("meshes[{mesh}].primitives[{primitive}]");
        let primitive = &written.primitives[primitive];
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        let Some(position) = attribute("POSITION") else {
            self.note(format!("{place}: left out, it has no POSITION"));
            return Ok(None);
        };
        let mode = primitive.mode.unwrap_or(4);
        let uvs = attribute(&format!("TEXCOORD_{uv_set}"));
        let key = (position, attribute("NORMAL"), uvs, attribute("COLOR_0"), primitive.indices, mode);
        if let Some(known) = self.meshes.known.get(&key) {
            return Ok(known.clone());
        }
        self.remark(primitive, &place);
        let mesh_read = match mode {
            4..=6 => {
                let mesh = triangles(source, key, &path)?;
                (!mesh.triangles.is_empty()).then_some(mesh)
            }
            0..=3 => {
                self.note(format!("{place}: left out, it draws {}", if mode == 0 { "points" } else { "lines" }));
                None
            }
            _ => return Err(source.fault(ErrorKind::Malformed, &path, format!("mode {mode}"), "0 to 6")),
        };
        let made = mesh_read.map(|mesh| self.keep(source, &mesh, &written.name, &path)).transpose()?;
        self.meshes.known.insert(key, made.clone());
        Ok(made)
    }

    /// The triangles of a primitive in its own frame, not kept; `None` where it draws none.
    ///
    /// # Errors
    /// As [`mesh`](Self::mesh).
    pub(super) fn triangles(&mut self, source: &Source<'_>, mesh: usize, primitive: usize, uv_set: usize) -> Result<Option<Mesh>, Error> {
        let path = format!("meshes[{mesh}].primitives[{primitive}]");
        let primitive = &source.document.meshes[mesh].primitives[primitive];
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        let mode = primitive.mode.unwrap_or(4);
        let Some(position) = attribute("POSITION").filter(|_| (4..=6).contains(&mode)) else { return Ok(None) };
        let uvs = attribute(&format!("TEXCOORD_{uv_set}"));
        let key = (position, attribute("NORMAL"), uvs, attribute("COLOR_0"), primitive.indices, mode);
        let mesh = triangles(source, key, &path)?;
        mesh.check().map_err(|fault| source.fault(ErrorKind::Malformed, &path, fault.to_string(), "a sound mesh"))?;
        Ok((!mesh.triangles.is_empty()).then_some(mesh))
    }

    /// Writes a mesh into a file of its own.
    ///
    /// # Errors
    /// The mesh is unsound, or all of them are too large.
    pub(super) fn keep(&mut self, source: &Source<'_>, mesh: &Mesh, name: &str, path: &str) -> Result<Written, Error> {
        Ok((self.write(source, mesh, name, path)?, corners(mesh)))
    }

    fn remark(&mut self, primitive: &Primitive, place: &str) {
        for name in primitive.extensions.keys() {
            self.note(format!("{place}: {name} is left out"));
        }
        if primitive.attributes.contains_key("COLOR_1") {
            self.note(format!("{place}: colours past COLOR_0 are left out"));
        }
    }

    fn write(&mut self, source: &Source<'_>, mesh: &Mesh, name: &str, path: &str) -> Result<String, Error> {
        mesh.check().map_err(|fault| source.fault(ErrorKind::Malformed, path, fault.to_string(), "a sound mesh"))?;
        let bytes = ply_binary::write(mesh);
        if self.meshes.count(bytes.len() as u64) > limits::MADE_BYTES {
            let expected = format!("at most {} bytes of meshes", limits::MADE_BYTES);
            return Err(source.fault(ErrorKind::TooLarge, path, "meshes that add up to more", expected));
        }
        let name = format!("meshes/{}.ply", self.meshes.names.fresh(name, "mesh"));
        self.meshes.made.insert(name.clone(), bytes);
        Ok(name)
    }
}

fn triangles(source: &Source<'_>, (position, normal, uvs, colour, indices, mode): Key, path: &str) -> Result<Mesh, Error> {
    let mut mesh = Mesh { positions: source.vectors::<3>(position, path)?.into_iter().map(Vec3::from).collect(), ..Mesh::default() };
    if mesh.positions.len() > limits::MESH_ELEMENTS {
        let expected = format!("at most {}", limits::MESH_ELEMENTS);
        return Err(source.fault(ErrorKind::TooLarge, path, format!("{} vertices", mesh.positions.len()), expected));
    }
    if let Some(normal) = normal {
        mesh.normals = source.vectors::<3>(normal, path)?.into_iter().map(|n| Vec3::from(n).normalize_or_zero()).collect();
    }
    if let Some(uvs) = uvs {
        mesh.uvs = source.vectors::<2>(uvs, path)?.into_iter().map(|[u, v]| Vec2::new(u, 1.0 - v)).collect();
    }
    if let Some(colour) = colour {
        let four = source.document.accessors.get(colour).is_some_and(|accessor| accessor.kind == "VEC4");
        mesh.colours = if four {
            source.vectors::<4>(colour, path)?.into_iter().map(|[r, g, b, _]| Vec3::new(r, g, b)).collect()
        } else {
            source.vectors::<3>(colour, path)?.into_iter().map(Vec3::from).collect()
        };
    }
    let corners = match indices {
        Some(indices) => source.indices(indices, path)?,
        None => (0..mesh.positions.len() as u32).collect(),
    };
    mesh.triangles = match mode {
        4 => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        // Every other triangle of a strip would be inside out.
        5 => corners.windows(3).enumerate().map(|(k, c)| if k % 2 == 0 { [c[0], c[1], c[2]] } else { [c[1], c[0], c[2]] }).collect(),
        _ => match corners.split_first() {
            Some((hub, rim)) => rim.windows(2).map(|c| [*hub, c[0], c[1]]).collect(),
            None => Vec::new(),
        },
    };
    if mesh.triangles.len() > limits::MESH_ELEMENTS {
        let expected = format!("at most {}", limits::MESH_ELEMENTS);
        return Err(source.fault(ErrorKind::TooLarge, path, format!("{} triangles", mesh.triangles.len()), expected));
    }
    Ok(mesh)
}

/// Least and greatest corner of a mesh.
pub(super) fn corners(mesh: &Mesh) -> [DVec3; 2] {
    mesh.positions
        .iter()
        .map(|position| position.as_dvec3())
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[least, most], point| [least.min(point), most.max(point)])
}
