//! Orthonormal frames.

use super::Vec3;

/// A right-handed orthonormal frame; `normal` is its z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// x axis.
    pub tangent: Vec3,
    /// y axis.
    pub bitangent: Vec3,
    /// z axis.
    pub normal: Vec3,
}

impl Frame {
    /// The axes of the world.
    pub const WORLD: Frame = Frame { tangent: Vec3::X, bitangent: Vec3::Y, normal: Vec3::Z };

    /// A frame around a unit normal, without a singularity that matters in f32.
    ///
    /// # Source
    /// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    #[inline]
    pub fn from_normal(n: Vec3) -> Self {
        let sign = 1.0f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            bitangent: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            normal: n,
        }
    }

    /// A frame around a unit normal whose x axis lies along a tangent, as far as the normal lets it; any frame where the tangent vanishes.
    #[inline]
    pub fn from_tangent(n: Vec3, along: Vec3) -> Self {
        let tangent = (along - n * n.dot(along)).normalize_or_zero();
        if tangent == Vec3::ZERO { Self::from_normal(n) } else { Self { tangent, bitangent: n.cross(tangent), normal: n } }
    }

    /// World to local.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.tangent.dot(v), self.bitangent.dot(v), self.normal.dot(v))
    }

    /// Local to world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal() {
        for n in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.3, -0.4, -0.866_025_4).normalize(), Vec3::new(1e-4, 1e-4, -1.0).normalize()] {
            let f = Frame::from_normal(n);
            assert!(f.tangent.dot(f.bitangent).abs() < 1e-6);
            assert!(f.tangent.dot(n).abs() < 1e-6);
            assert!((f.tangent.cross(f.bitangent) - n).length() < 1e-5);
            let v = Vec3::new(0.2, 0.7, -0.1);
            assert!((f.to_world(f.to_local(v)) - v).length() < 1e-6);
        }
    }
}
