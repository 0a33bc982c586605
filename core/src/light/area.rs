//! Surfaces that emit from their front.

use super::LightPoint;
use crate::geometry::{Mesh, Sphere};
use crate::math::{Frame, PI, Vec2, Vec3, safe_sqrt, sin_cos};
use crate::sampling::{Discrete, warp};
use crate::spectrum::Spectrum;

/// A surface with the same radiance everywhere and in all directions of its front.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// Radiance [W·m⁻²·sr⁻¹].
    pub radiance: Spectrum,
    /// Where it leaves from.
    pub emitter: Emitter,
}

/// The shape of an area light.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// Triangles, chosen by area.
    Triangles {
        /// Corners of each, counter-clockwise seen from the front.
        corners: Vec<[Vec3; 3]>,
        /// Choice by area.
        choice: Discrete,
        /// Sum of areas [m²].
        area: f32,
    },
    /// A parallelogram spanned from a corner; its front is the side of `edges[0] × edges[1]`.
    Parallelogram {
        /// A corner.
        corner: Vec3,
        /// The two edges that leave it.
        edges: [Vec3; 2],
    },
    /// The outside of a sphere, sampled by the cone that it fills.
    Sphere(Sphere),
}

impl Emitter {
    /// From a mesh in world space. `None` if it has no area. Two triangles that form a parallelogram become one.
    pub fn from_mesh(mesh: &Mesh) -> Option<Self> {
        let corners: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        if let [[a, b, c], [d, e, f]] = corners[..]
            && a == d
            && c == e
            && (b - a - (c - f)).length() <= 1e-6 * (c - a).length()
        {
            return Some(Emitter::Parallelogram { corner: a, edges: [b - a, f - a] });
        }
        let areas: Vec<f32> = (0..corners.len()).map(|t| mesh.area(t)).collect();
        let choice = Discrete::new(&areas)?;
        let area = areas.iter().map(|a| f64::from(*a)).sum::<f64>() as f32;
        Some(Emitter::Triangles { corners, choice, area })
    }

    /// Area [m²].
    pub fn area(&self) -> f32 {
        match self {
            Emitter::Triangles { area, .. } => *area,
            Emitter::Parallelogram { edges, .. } => edges[0].cross(edges[1]).length(),
            Emitter::Sphere(s) => s.area(),
        }
    }

    /// A point uniform by area: position and normal.
    fn point(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        match self {
            Emitter::Triangles { corners, choice, .. } => {
                let (t, _, rest) = choice.sample(u[0]);
                let [a, b, c] = corners[t];
                let [v, w] = warp::triangle([rest, u[1]]);
                (a + (b - a) * v + (c - a) * w, (b - a).cross(c - a).normalize_or_zero())
            }
            Emitter::Parallelogram { corner, edges } => {
                (*corner + edges[0] * u[0] + edges[1] * u[1], edges[0].cross(edges[1]).normalize_or_zero())
            }
            Emitter::Sphere(s) => {
                let normal = warp::uniform_sphere(u);
                (s.centre + normal * s.radius, normal)
            }
        }
    }
}

/// 1 − cos of the half angle that a sphere fills, and sin² of it, seen from outside; `None` from inside or on it.
#[inline]
fn cone(sphere: &Sphere, from: Vec3) -> Option<(f32, f32)> {
    let distance2 = (sphere.centre - from).length_squared();
    let sin2 = sphere.radius * sphere.radius / distance2;
    // 1 − cos without cancellation for small spheres.
    (sin2 < 0.999_999).then(|| (sin2 / (1.0 + safe_sqrt(1.0 - sin2)), sin2))
}

impl AreaLight {
    #[inline]
    pub(super) fn sample(&self, light: u32, from: Vec3, u: [f32; 2]) -> Option<(LightPoint, f32)> {
        if let Emitter::Sphere(sphere) = &self.emitter
            && let Some((one_minus_cos, sin2_max)) = cone(sphere, from)
        {
            let to_centre = sphere.centre - from;
            let distance = to_centre.length();
            // Direction inside the cone, then the point of the sphere that it meets first, by the angle at the centre.
            let one_minus = u[0] * one_minus_cos;
            let cos_theta = 1.0 - one_minus;
            let sin2_theta = one_minus * (2.0 - one_minus);
            let sin_max = sin2_max.sqrt();
            let cos_alpha = sin2_theta / sin_max + cos_theta * safe_sqrt(1.0 - sin2_theta / sin2_max);
            let sin_alpha = safe_sqrt(1.0 - cos_alpha * cos_alpha);
            let (s, c) = sin_cos(2.0 * PI * u[1]);
            let frame = Frame::from_normal(-to_centre / distance);
            let normal = frame.to_world(Vec3::new(sin_alpha * c, sin_alpha * s, cos_alpha)).normalize();
            let position = sphere.centre + normal * sphere.radius;
            let point = LightPoint {
                light,
                position,
                error: error(position, sphere.radius),
                normal,
                uv: Vec2::ZERO,
                infinite: false,
                delta: false,
            };
            let density = self.density(from, &point);
            return (density > 0.0).then_some((point, density));
        }
        let (position, normal) = self.emitter.point(u);
        let point = LightPoint { light, position, error: error(position, 0.0), normal, uv: Vec2::ZERO, infinite: false, delta: false };
        let density = self.density(from, &point);
        (density > 0.0 && density.is_finite()).then_some((point, density))
    }

    #[inline]
    pub(super) fn density(&self, from: Vec3, point: &LightPoint) -> f32 {
        let to = point.position - from;
        let distance2 = to.length_squared();
        let facing = -to.dot(point.normal);
        if facing <= 0.0 || distance2 == 0.0 {
            return 0.0;
        }
        if let Emitter::Sphere(sphere) = &self.emitter
            && let Some((one_minus_cos, _)) = cone(sphere, from)
        {
            return 1.0 / (2.0 * PI * one_minus_cos);
        }
        // Area to solid angle: d² / (cosθ A), with cosθ = facing / d.
        distance2 * distance2.sqrt() / (facing * self.emitter.area())
    }
}

/// Bound on the rounding error of a sampled position.
#[inline]
fn error(position: Vec3, radius: f32) -> f32 {
    (position.abs().max_element() + radius) * (16.0 * f32::EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Dimension, SampleKey, SampleStream};

    /// ∫ over directions of 1 = solid angle, estimated by 1/density of sampled points.
    fn solid_angle(light: &AreaLight, from: Vec3) -> f64 {
        let n = 20_000;
        let sum: f64 = (0..n)
            .filter_map(|k| {
                let u = SampleStream::open(SampleKey { seed: 2, frame: 0, x: 0, y: 0, index: k }).pair(Dimension::light_point(0));
                light.sample(0, from, u).map(|(_, density)| 1.0 / f64::from(density))
            })
            .sum();
        sum / f64::from(n)
    }

    #[test]
    fn densities_integrate_to_the_solid_angle() {
        let sphere = AreaLight { radiance: Spectrum::WHITE, emitter: Emitter::Sphere(Sphere { centre: Vec3::ZERO, radius: 1.0 }) };
        let expected = 2.0 * std::f64::consts::PI * (1.0 - (1.0f64 - 0.25).sqrt());
        assert!((solid_angle(&sphere, Vec3::new(0.0, 2.0, 0.0)) / expected - 1.0).abs() < 1e-3);
        // A unit square seen from one unit above a corner fills asin-shaped Ω = atan(1/√3) = π/6.
        let square =
            AreaLight { radiance: Spectrum::WHITE, emitter: Emitter::Parallelogram { corner: Vec3::ZERO, edges: [Vec3::X, Vec3::Y] } };
        assert!((solid_angle(&square, Vec3::Z) / (std::f64::consts::PI / 6.0) - 1.0).abs() < 1e-3);
        assert_eq!(solid_angle(&square, -Vec3::Z), 0.0);
    }

    #[test]
    fn two_triangles_become_a_parallelogram() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let emitter = Emitter::from_mesh(&mesh).unwrap();
        assert!(matches!(emitter, Emitter::Parallelogram { .. }));
        assert_eq!(emitter.area(), 1.0);
    }
}
