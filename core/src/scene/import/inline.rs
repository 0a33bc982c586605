//! Meshes written into the description.

use crate::geometry::Mesh;
use crate::math::Vec3;
use crate::scene::description::MeshInline;

impl From<&Mesh> for MeshInline {
    fn from(mesh: &Mesh) -> MeshInline {
        let vectors = |list: &[Vec3]| (!list.is_empty()).then(|| list.iter().map(|vector| vector.to_array()).collect());
        MeshInline {
            positions: vectors(&mesh.positions).unwrap_or_default(),
            indices: mesh.triangles.clone(),
            normals: vectors(&mesh.normals),
            uvs: (!mesh.uvs.is_empty()).then(|| mesh.uvs.iter().map(|uv| uv.to_array()).collect()),
            colours: vectors(&mesh.colours),
            ..MeshInline::default()
        }
    }
}
