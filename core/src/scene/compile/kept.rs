//! What the instants of a scene share: files read once, trees of what rests built once.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{light, material, texture};
use crate::geometry::{Group, Mesh};
use crate::light::Emitter;
use crate::material::Material;
use crate::scene::assets::Assets;
use crate::scene::description::{self, Normals, SceneDescription};
use crate::scene::error::Error;
use crate::scene::mesh::{self, MeshFormat};

/// What earlier instants have read and built. Shapes go by their numbers, which are the same at all instants.
#[derive(Debug, Default)]
pub(in crate::scene) struct Kept {
    /// Mesh files, read once each however often they are used.
    files: BTreeMap<(String, MeshFormat, u8), Arc<Mesh>>,
    images: texture::Images,
    pub(super) surfaces: Option<Surfaces>,
    pub(super) environment: light::KnownEnvironment,
    /// What stands in the world and rests.
    pub(super) own: Option<Arc<Group>>,
    /// Groups by name. Those in which something moves are built anew all the same.
    pub(super) groups: BTreeMap<String, Arc<Group>>,
    /// Shapes that move as they are, in their own frames.
    pub(super) rigid: BTreeMap<u32, Arc<Group>>,
    /// What glows, in the frame of the world.
    pub(super) emitters: BTreeMap<u32, Emitter>,
}

/// Textures and materials, and the descriptions that they were compiled from.
#[derive(Debug, Default)]
pub(super) struct Surfaces {
    pub(super) textures: texture::Textures,
    pub(super) materials: Vec<Material>,
    pub(super) of: (BTreeMap<String, description::Texture>, BTreeMap<String, description::Material>),
}

impl Kept {
    /// The triangles of a file.
    pub(super) fn file(&mut self, file: &str, format: MeshFormat, normals: Normals, assets: &dyn Assets) -> Result<Mesh, Error> {
        let key = (file.to_string(), format, normals as u8);
        if let Some(mesh) = self.files.get(&key) {
            return Ok(mesh.as_ref().clone());
        }
        let mesh = mesh::read(assets, file, format, normals)?;
        self.files.insert(key, Arc::new(mesh.clone()));
        Ok(mesh)
    }

    /// Compiles textures and materials, unless the instant before had the same.
    pub(super) fn surfaces(&mut self, still: &SceneDescription, assets: &dyn Assets) -> Result<(), Error> {
        let same = |known: &Surfaces| known.of.0 == still.textures && known.of.1 == still.materials;
        if self.surfaces.as_ref().is_some_and(same) {
            return Ok(());
        }
        let textures = texture::compile(still, assets, &mut self.images)?;
        let materials = material::compile(still, &textures)?;
        self.surfaces = Some(Surfaces { textures, materials, of: Default::default() });
        Ok(())
    }

    /// Forgets the files, once everything that is made of them is built.
    pub(in crate::scene) fn forget_files(&mut self) {
        self.files.clear();
    }
}
