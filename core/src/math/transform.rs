//! Affine transforms, inverted in f64.

use super::Vec3;
use glam::{Affine3A, DMat3, DVec3, Mat3A, Vec3A};

/// An invertible affine map and its inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    forward: Affine3A,
    inverse: Affine3A,
}

impl Transform {
    /// The identity.
    pub const IDENTITY: Transform = Transform { forward: Affine3A::IDENTITY, inverse: Affine3A::IDENTITY };

    /// From a 3×4 row-major matrix. `None` if it is singular or not finite.
    pub fn from_rows(rows: [[f64; 4]; 3]) -> Option<Self> {
        let columns = [0, 1, 2].map(|c| [rows[0][c], rows[1][c], rows[2][c]]);
        let matrix = DMat3::from_cols_array_2d(&columns);
        // In f64, so that a scene scaled by 10⁻⁶, with a determinant of 10⁻¹⁸, is not taken for singular.
        let determinant = matrix.determinant();
        if !determinant.is_finite() || determinant == 0.0 {
            return None;
        }
        let inverse = matrix.inverse();
        let translation = DVec3::new(rows[0][3], rows[1][3], rows[2][3]);
        let out = Self { forward: affine(matrix, translation), inverse: affine(inverse, -(inverse * translation)) };
        (out.forward.is_finite() && out.inverse.is_finite()).then_some(out)
    }

    /// `self ∘ first`: first `first`, then `self`.
    pub fn after(&self, first: &Transform) -> Self {
        Self { forward: self.forward * first.forward, inverse: first.inverse * self.inverse }
    }

    /// Maps a point.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.forward.transform_point3(p)
    }

    /// Maps a vector.
    #[inline]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.forward.transform_vector3(v)
    }

    /// Maps a normal (by the inverse transpose); not normalised.
    #[inline]
    pub fn normal(&self, n: Vec3) -> Vec3 {
        let m = &self.inverse.matrix3;
        let n = Vec3A::from(n);
        Vec3::new(m.x_axis.dot(n), m.y_axis.dot(n), m.z_axis.dot(n))
    }

    /// Maps a point back.
    #[inline]
    pub fn point_back(&self, p: Vec3) -> Vec3 {
        self.inverse.transform_point3(p)
    }

    /// Maps a vector back.
    #[inline]
    pub fn vector_back(&self, v: Vec3) -> Vec3 {
        self.inverse.transform_vector3(v)
    }

    /// Whether the map turns right hands into left hands.
    pub fn mirrors(&self) -> bool {
        self.forward.matrix3.determinant() < 0.0
    }

    /// Largest row sum of absolute entries, translation aside: a bound on how much it stretches coordinates.
    pub fn stretch(&self) -> f32 {
        let m = self.forward.matrix3;
        (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element()
    }
}

fn affine(m: DMat3, t: DVec3) -> Affine3A {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|c| Vec3A::from(c.as_vec3()));
    Affine3A { matrix3: Mat3A::from_cols(x, y, z), translation: t.as_vec3().into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes() {
        let t = Transform::from_rows([[2.0, 0.5, 0.0, 1.0], [0.0, -1.0, 0.3, 2.0], [0.1, 0.0, 3.0, -4.0]]).unwrap();
        let p = Vec3::new(0.3, -2.0, 5.0);
        assert!((t.point_back(t.point(p)) - p).length() < 1e-5);
        assert!(t.mirrors());
        assert!(t.normal(Vec3::Z).dot(t.vector(Vec3::new(0.4, 0.7, 0.0))).abs() < 1e-5);
    }

    #[test]
    fn singular_is_refused_and_tiny_is_not() {
        let diagonal = |s: f64, last: f64| Transform::from_rows([[s, 0.0, 0.0, 0.0], [0.0, s, 0.0, 0.0], [0.0, 0.0, last, 0.0]]);
        assert!(diagonal(1.0, 0.0).is_none());
        assert!(diagonal(1e-12, 1e-12).is_some());
    }
}
