//! Mitsuba's cube with its texture coordinates, for cubes that carry a texture.

use crate::scene::description::{Geometry, MeshInline};

/// Corners of the faces −Y, +Y, +X, +Z, −X, −Z; each face has (0, 1), (1, 1), (1, 0), (0, 0) at its four.
const CORNERS: [[[f32; 3]; 4]; 6] = [
    [[1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]],
    [[1.0, 1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0]],
    [[1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]],
    [[1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]],
    [[-1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]],
    [[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]],
];

/// The cube [-1, 1]³ as a mesh.
pub(super) fn textured() -> Geometry {
    let positions = CORNERS.concat();
    let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].repeat(6);
    let indices = (0..6).flat_map(|face| [[4 * face, 4 * face + 1, 4 * face + 2], [4 * face + 3, 4 * face, 4 * face + 2]]).collect();
    Geometry::Mesh(MeshInline { positions, indices, normals: None, uvs: Some(uvs), ..MeshInline::default() })
}
