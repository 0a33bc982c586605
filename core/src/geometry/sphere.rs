//! Spheres, intersected without cancellation.

use crate::math::{PI, Ray, Vec3, safe_sqrt};

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub centre: Vec3,
    /// Radius, > 0.
    pub radius: f32,
}

impl Sphere {
    /// Surface area [m²].
    pub fn area(&self) -> f32 {
        4.0 * PI * self.radius * self.radius
    }

    /// The nearest t with 0 < t ≤ reach.
    ///
    /// The discriminant is formed from the distance of the centre to the ray, and the smaller root from the product of the roots.
    ///
    /// # Source
    /// Haines et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019.
    #[inline]
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<f32> {
        let f = ray.origin - self.centre;
        let a = ray.direction.length_squared();
        let b = -f.dot(ray.direction);
        let nearest = f + ray.direction * (b / a);
        let discriminant = self.radius * self.radius - nearest.length_squared();
        if discriminant < 0.0 {
            return None;
        }
        let c = f.length_squared() - self.radius * self.radius;
        let q = b + safe_sqrt(discriminant * a).copysign(b);
        let (t0, t1) = (c / q, q / a);
        let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
        [near, far].into_iter().find(|t| *t > 0.0 && *t <= ray.reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_and_near_roots() {
        let s = Sphere { centre: Vec3::new(0.0, 0.0, 5.0), radius: 1.0 };
        assert!((s.intersect(&Ray::new(Vec3::ZERO, Vec3::Z)).unwrap() - 4.0).abs() < 1e-6);
        assert!((s.intersect(&Ray::new(Vec3::new(0.0, 0.0, 5.0), Vec3::Z * 2.0)).unwrap() - 0.5).abs() < 1e-6);
        assert!(s.intersect(&Ray::new(Vec3::ZERO, -Vec3::Z)).is_none());
        assert!(s.intersect(&Ray::new(Vec3::new(1.001, 0.0, 0.0), Vec3::Z)).is_none());
    }

    #[test]
    fn small_sphere_far_away_is_met() {
        let s = Sphere { centre: Vec3::new(0.0, 0.0, 1e4), radius: 0.01 };
        let t = s.intersect(&Ray::new(Vec3::ZERO, Vec3::Z)).unwrap();
        assert!((t - 9999.99).abs() < 0.01);
    }
}
