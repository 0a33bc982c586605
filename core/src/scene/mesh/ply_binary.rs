//! Meshes as binary PLY: how importers hand on meshes that no file of their own holds.

use crate::geometry::Mesh;

/// The bytes of a little-endian PLY file of single precision, which [`super::read`] gives back as it was. Normals, texture
/// coordinates and colours are written where the mesh has them.
pub(in crate::scene) fn write(mesh: &Mesh) -> Vec<u8> {
    let mut properties = vec!["x", "y", "z"];
    if !mesh.normals.is_empty() {
        properties.extend(["nx", "ny", "nz"]);
    }
    if !mesh.uvs.is_empty() {
        properties.extend(["u", "v"]);
    }
    if !mesh.colours.is_empty() {
        properties.extend(["red", "green", "blue"]);
    }
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.len());
    for property in &properties {
        header.push_str(&format!("property float {property}\n"));
    }
    header.push_str(&format!("element face {}\nproperty list uchar uint vertex_indices\nend_header\n", mesh.triangles.len()));
    let mut bytes = header.into_bytes();
    bytes.reserve(mesh.positions.len() * properties.len() * 4 + mesh.triangles.len() * 13);
    for (vertex, position) in mesh.positions.iter().enumerate() {
        let normal = mesh.normals.get(vertex).map(|normal| normal.to_array());
        let uv = mesh.uvs.get(vertex).map(|uv| uv.to_array());
        let colour = mesh.colours.get(vertex).map(|colour| colour.to_array());
        let values = position
            .to_array()
            .into_iter()
            .chain(normal.into_iter().flatten())
            .chain(uv.into_iter().flatten())
            .chain(colour.into_iter().flatten());
        bytes.extend(values.flat_map(f32::to_le_bytes));
    }
    for corners in &mesh.triangles {
        bytes.push(3);
        bytes.extend(corners.iter().flat_map(|corner| corner.to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::ply;
    use super::*;
    use crate::math::{Vec2, Vec3};

    #[test]
    fn it_reads_back_what_it_writes() {
        let plain = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.1, 2.0, -3e-20), Vec3::Z],
            triangles: vec![[0, 1, 2], [3, 2, 1]],
            ..Mesh::default()
        };
        let normals = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X];
        let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::new(-2.5, 7.0), Vec2::ONE];
        let textured = Mesh { uvs: uvs.clone(), ..plain.clone() };
        let full = Mesh { normals, uvs, ..plain.clone() };
        let coloured = Mesh { colours: vec![Vec3::ONE, Vec3::X, Vec3::new(0.2, 0.4, 1.5), Vec3::ZERO], ..full.clone() };
        for mesh in [plain, textured, full, coloured] {
            assert_eq!(ply::parse(&write(&mesh), "t.ply").unwrap(), mesh);
        }
    }
}
