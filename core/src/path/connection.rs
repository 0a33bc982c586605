//! A vertex joined straight to a point: the direction, and how solid angle changes where the edge starts elsewhere.

use super::vertex::Vertex;
use crate::light::LightPoint;
use crate::math::Vec3;

/// Direction and Jacobian of joining the offset path to a light point; visibility is part of the contribution and left to the caller.
/// `None` where the light point is seen edge-on or not at all.
#[inline]
pub fn connect(base: &Vertex, offset: &Vertex, point: &LightPoint) -> Option<(Vec3, f64)> {
    if point.infinite {
        Some((point.position, 1.0))
    } else if point.delta {
        // Measured by the choice of the light alone: nothing is turned.
        Some(((point.position - offset.position).normalize(), 1.0))
    } else {
        turn(base.position, offset.position, point.position, point.normal)
    }
}

/// Unit direction from `offset` to `target`, and the ratio of solid angles that an area element at `target` with this unit normal fills
/// seen from `offset` and from `base` [1]; of a volume element where the normal is zero. `None` where it is edge-on to either.
#[inline]
pub fn turn(base: Vec3, offset: Vec3, target: Vec3, normal: Vec3) -> Option<(Vec3, f64)> {
    let (a, b) = (target - base, target - offset);
    let (a2, b2) = (f64::from(a.length_squared()), f64::from(b.length_squared()));
    let (cos_a, cos_b) =
        if normal == Vec3::ZERO { (a2.sqrt(), b2.sqrt()) } else { (f64::from(a.dot(normal).abs()), f64::from(b.dot(normal).abs())) };
    // cosθ carries one edge length each: the remaining power is 3/2.
    let jacobian = (cos_b / cos_a) * (a2 * a2.sqrt()) / (b2 * b2.sqrt());
    (jacobian > 0.0 && jacobian.is_finite()).then(|| (b / b.length(), jacobian))
}
