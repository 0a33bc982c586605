//! Axis-aligned boxes.

use crate::math::Vec3;
use obvhs::{Boundable, aabb::Aabb};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub lower: Vec3,
    /// Upper corner.
    pub upper: Vec3,
}

impl Bounds {
    /// The empty box.
    pub const EMPTY: Bounds = Bounds { lower: Vec3::INFINITY, upper: Vec3::NEG_INFINITY };

    /// The smallest box around points.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Bounds { lower: b.lower.min(p), upper: b.upper.max(p) })
    }

    /// The smallest box around both.
    pub fn union(self, other: Bounds) -> Self {
        Bounds { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// The box that reaches this much further on every side.
    pub fn widened(self, by: f32) -> Self {
        Self { lower: self.lower - Vec3::splat(by), upper: self.upper + Vec3::splat(by) }
    }

    /// The corners.
    pub fn corners(self) -> [Vec3; 8] {
        std::array::from_fn(|k| {
            let pick = |axis: usize| if k >> axis & 1 == 0 { self.lower[axis] } else { self.upper[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// Centre.
    pub fn centre(self) -> Vec3 {
        (self.lower + self.upper) * 0.5
    }

    /// Radius of the sphere around it. 0 if empty.
    pub fn radius(self) -> f32 {
        if self.lower.x > self.upper.x { 0.0 } else { (self.upper - self.lower).length() * 0.5 }
    }
}

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        Aabb::new(self.lower.into(), self.upper.into())
    }
}
