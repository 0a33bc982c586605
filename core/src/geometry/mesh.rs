//! Indexed triangle meshes.

use super::bvh::Bounds;
use crate::math::{Transform, Vec2, Vec3};

/// A triangle mesh. Normals, texture coordinates and colours are either absent (empty) or one a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, or empty: the mesh is then flat.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, or empty.
    pub uvs: Vec<Vec2>,
    /// Colours, linear Rec.709, or empty.
    pub colours: Vec<Vec3>,
    /// Corners of each triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// What is wrong with a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A corner names a vertex that is not there.
    #[error("triangle {triangle} names vertex {found}, the mesh has {vertices}")]
    Corner {
        /// Which triangle.
        triangle: usize,
        /// The vertex that it names.
        found: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A position or normal that is not finite.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Which vertex.
        vertex: usize,
    },
    /// Normals, texture coordinates or colours in another number than positions.
    #[error("{found} {what} for {vertices} vertices")]
    Length {
        /// `normals`, `uvs` or `colours`.
        what: &'static str,
        /// How many.
        found: usize,
        /// How many there should be.
        vertices: usize,
    },
}

impl Mesh {
    /// Checks that indices and lengths fit and values are finite.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        for (what, found) in [("normals", self.normals.len()), ("uvs", self.uvs.len()), ("colours", self.colours.len())] {
            if found != 0 && found != vertices {
                return Err(MeshError::Length { what, found, vertices });
            }
        }
        for (vertex, p) in self.positions.iter().enumerate() {
            if !p.is_finite() || self.normals.get(vertex).is_some_and(|n| !n.is_finite()) {
                return Err(MeshError::NotFinite { vertex });
            }
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(found) = corners.iter().find(|c| **c as usize >= vertices) {
                return Err(MeshError::Corner { triangle, found: *found, vertices });
            }
        }
        Ok(())
    }

    /// The mesh in another frame. A mirroring transform flips the winding, so that the front stays the front.
    pub fn transformed(mut self, transform: &Transform) -> Self {
        for p in &mut self.positions {
            *p = transform.point(*p);
        }
        for n in &mut self.normals {
            *n = transform.normal(*n).normalize_or_zero();
        }
        if transform.mirrors() {
            self.flip_winding();
        }
        self
    }

    /// Swaps front and back.
    pub fn flipped(mut self) -> Self {
        for n in &mut self.normals {
            *n = -*n;
        }
        self.flip_winding();
        self
    }

    fn flip_winding(&mut self) {
        for corners in &mut self.triangles {
            corners.swap(1, 2);
        }
    }

    /// Corner positions of a triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|c| self.positions[c as usize])
    }

    /// Texture coordinates at (v, w), which weigh the second and the third corner; those two numbers where the mesh has none.
    #[inline]
    pub fn uv(&self, triangle: usize, [v, w]: [f32; 2]) -> Vec2 {
        if self.uvs.is_empty() {
            return Vec2::new(v, w);
        }
        let [a, b, c] = self.triangles[triangle].map(|k| self.uvs[k as usize]);
        a * (1.0 - v - w) + b * v + c * w
    }

    /// Colour at (v, w); (1, 1, 1) where the mesh has none.
    #[inline]
    pub fn colour(&self, triangle: usize, [v, w]: [f32; 2]) -> Vec3 {
        if self.colours.is_empty() {
            return Vec3::ONE;
        }
        let [a, b, c] = self.triangles[triangle].map(|k| self.colours[k as usize]);
        a * (1.0 - v - w) + b * v + c * w
    }

    /// Area of a triangle [m²].
    pub fn area(&self, triangle: usize) -> f32 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).length() * 0.5
    }

    /// Bounds of all vertices.
    pub fn bounds(&self) -> Bounds {
        Bounds::around(self.positions.iter().copied())
    }
}
