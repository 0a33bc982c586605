//! Rays, and where they start: as far from the surface that they left as its own rounding error demands, and no further.

use super::Vec3;

/// A half-line `origin + t · direction`, 0 < t ≤ `reach`. The direction need not be a unit vector.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start.
    pub origin: Vec3,
    /// Direction.
    pub direction: Vec3,
    /// Largest t.
    pub reach: f32,
}

impl Ray {
    /// An unbounded ray.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, reach: f32::INFINITY }
    }
}

/// Moves a surface point off its surface, to the side that `direction` leaves by; `error` bounds its rounding error [scene units].
#[inline]
fn leave(position: Vec3, error: f32, normal: Vec3, direction: Vec3) -> Vec3 {
    position + normal * error.copysign(normal.dot(direction))
}

/// A ray that leaves a surface point.
///
/// `error` bounds the rounding error of `position` [scene units]; `normal` is the geometric normal, of either side.
#[inline]
pub fn spawn(position: Vec3, error: f32, normal: Vec3, direction: Vec3) -> Ray {
    Ray::new(leave(position, error, normal, direction), direction)
}

/// The open segment between two surface points (position, error, geometric normal): its direction is their difference, its reach 1.
#[inline]
pub fn segment(from: (Vec3, f32, Vec3), to: (Vec3, f32, Vec3)) -> Ray {
    let direction = to.0 - from.0;
    let start = leave(from.0, from.1, from.2, direction);
    let end = leave(to.0, to.1, to.2, -direction);
    Ray { origin: start, direction: end - start, reach: 1.0 - 1e-5 }
}
