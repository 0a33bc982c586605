//! Tubes without ends.

use super::bvh::Bounds;
use crate::math::{PI, Ray, Vec3, safe_sqrt};

/// The points at a distance from a straight axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Where the axis starts.
    pub start: Vec3,
    /// Its unit direction.
    pub axis: Vec3,
    /// Its length [m], > 0.
    pub length: f32,
    /// Radius [m], > 0.
    pub radius: f32,
}

impl Cylinder {
    /// Surface area [m²].
    pub fn area(&self) -> f32 {
        2.0 * PI * self.radius * self.length
    }

    /// Bounds.
    pub fn bounds(&self) -> Bounds {
        let reach = (Vec3::ONE - self.axis * self.axis).map(safe_sqrt) * self.radius;
        let end = self.start + self.axis * self.length;
        Bounds { lower: self.start.min(end) - reach, upper: self.start.max(end) + reach }
    }

    /// The nearest t with 0 < t ≤ reach. As for spheres, seen along the axis.
    #[inline]
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<f32> {
        let from_start = ray.origin - self.start;
        // The components across the axis, turned by a right angle, which changes no length between them.
        let (f, d) = (from_start.cross(self.axis), ray.direction.cross(self.axis));
        let a = d.length_squared();
        if a == 0.0 {
            return None;
        }
        let b = -f.dot(d);
        let nearest = f + d * (b / a);
        let discriminant = self.radius * self.radius - nearest.length_squared();
        if discriminant < 0.0 {
            return None;
        }
        let c = f.length_squared() - self.radius * self.radius;
        let q = b + safe_sqrt(discriminant * a).copysign(b);
        let (t0, t1) = (c / q, q / a);
        let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
        let (height, slope) = (from_start.dot(self.axis), ray.direction.dot(self.axis));
        [near, far].into_iter().find(|t| *t > 0.0 && *t <= ray.reach && (0.0..=self.length).contains(&(height + slope * *t)))
    }
}
