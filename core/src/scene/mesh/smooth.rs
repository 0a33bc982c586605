//! Shading normals from the faces around each vertex.

use crate::geometry::Mesh;
use crate::math::Vec3;

/// One unit normal a vertex: the mean of its faces' normals, each weighted by the angle that the face takes at the vertex.
/// A vertex without a proper face gets zero, which means flat.
///
/// # Source
/// Thürmer and Wüthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1), 1998.
pub(super) fn vertex_normals(mesh: &Mesh) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(triangle);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for k in 0..3 {
            let towards = |other: usize| (corners[other % 3] - corners[k]).normalize_or_zero();
            let cosine = towards(k + 1).dot(towards(k + 2)).clamp(-1.0, 1.0);
            normals[vertices[k] as usize] += normal * libm::acosf(cosine);
        }
    }
    normals.into_iter().map(Vec3::normalize_or_zero).collect()
}
