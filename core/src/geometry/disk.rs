//! Disks, and what affine maps make of them.

use super::bvh::Bounds;
use crate::math::{PI, Ray, Vec2, Vec3};

/// The points `centre + a·x + b·y` with a² + b² ≤ 1; its front is the side of `x × y`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// Centre.
    pub centre: Vec3,
    /// To the rim.
    pub x: Vec3,
    /// To the rim, along another line than `x`.
    pub y: Vec3,
}

impl Disk {
    /// Surface area [m²].
    pub fn area(&self) -> f32 {
        PI * self.x.cross(self.y).length()
    }

    /// Unit normal of the side of `x × y`.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        // Scaled first, so that squares of small or large numbers stay in range.
        self.x.normalize().cross(self.y.normalize()).normalize_or_zero()
    }

    /// Bounds.
    pub fn bounds(&self) -> Bounds {
        let reach = (self.x * self.x + self.y * self.y).map(f32::sqrt);
        Bounds { lower: self.centre - reach, upper: self.centre + reach }
    }

    /// (a, b) of the point of its plane next to a position.
    #[inline]
    pub(super) fn coordinates(&self, position: Vec3) -> Vec2 {
        let p = position - self.centre;
        let (xx, xy, yy) = (self.x.length_squared(), self.x.dot(self.y), self.y.length_squared());
        let (px, py) = (p.dot(self.x), p.dot(self.y));
        // Normal equations of p ≈ a·x + b·y; each row is scaled by its own length.
        let skew = xy / xx;
        let b = (py - px * skew) / (yy - xy * skew);
        Vec2::new((px - b * xy) / xx, b)
    }

    /// The t with 0 < t ≤ reach where the ray meets it.
    #[inline]
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<f32> {
        let normal = self.normal();
        let t = (self.centre - ray.origin).dot(normal) / ray.direction.dot(normal);
        // Not a number where the ray lies in the plane.
        if !(t > 0.0 && t <= ray.reach) {
            return None;
        }
        (self.coordinates(ray.origin + ray.direction * t).length_squared() <= 1.0).then_some(t)
    }
}
