//! Surfaces that emit light, from their front or from both sides.

use super::LightPoint;
use super::tree::Reach;
use crate::geometry::{Analytic, Bounds, Form, Mesh, Place, Sphere};
use crate::math::{Frame, PI, Vec2, Vec3, safe_sqrt, sin_cos};
use crate::sampling::{Discrete, warp};
use crate::spectrum::Spectrum;
use crate::texture::{ColourInput, TexturePoint};

/// A surface with the same radiance in all directions of its side.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// Radiance [W·m⁻²·sr⁻¹].
    pub radiance: ColourInput,
    /// Whether light leaves the back too.
    pub two_sided: bool,
    /// Where it leaves from.
    pub emitter: Emitter,
}

/// The shape of an area light.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// Triangles, chosen by area.
    Triangles {
        /// The triangles.
        mesh: Mesh,
        /// Choice by area.
        choice: Discrete,
        /// Sum of areas [m²].
        area: f32,
    },
    /// A parallelogram spanned from a corner; its front is the side of `edges[0] × edges[1]`. It has no texture.
    Parallelogram {
        /// A corner.
        corner: Vec3,
        /// The two edges that leave it.
        edges: [Vec3; 2],
    },
    /// A surface given by a formula; a sphere is sampled from outside by the cone that it fills.
    Analytic(Analytic),
}

/// A point of an emitter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) at: TexturePoint,
}

impl From<Place> for Spot {
    fn from(place: Place) -> Self {
        Self { position: place.position, normal: place.normal, at: TexturePoint { uv: place.uv, colour: Vec3::ONE } }
    }
}

impl Emitter {
    /// From a mesh in world space. `None` if it has no area. Two triangles that form a parallelogram become one, unless the place on
    /// them is to be told to a texture.
    pub fn from_mesh(mesh: &Mesh, textured: bool) -> Option<Self> {
        let corners = |t: usize| mesh.corners(t);
        if mesh.triangles.len() == 2
            && !textured
            && let ([a, b, c], [d, e, f]) = (corners(0), corners(1))
            && a == d
            && c == e
            && (b - a - (c - f)).length() <= 1e-6 * (c - a).length()
        {
            return Some(Emitter::Parallelogram { corner: a, edges: [b - a, f - a] });
        }
        let areas: Vec<f32> = (0..mesh.triangles.len()).map(|t| mesh.area(t)).collect();
        let choice = Discrete::new(&areas)?;
        let area = areas.iter().map(|a| f64::from(*a)).sum::<f64>() as f32;
        let mut mesh = Mesh { normals: Vec::new(), ..mesh.clone() };
        if !textured {
            mesh = Mesh { uvs: Vec::new(), colours: Vec::new(), ..mesh };
        }
        Some(Emitter::Triangles { mesh, choice, area })
    }

    /// Area [m²].
    pub fn area(&self) -> f32 {
        match self {
            Emitter::Triangles { area, .. } => *area,
            Emitter::Parallelogram { edges, .. } => edges[0].cross(edges[1]).length(),
            Emitter::Analytic(surface) => surface.area(),
        }
    }

    /// Its bounds, and axis and half angle [rad] of a cone around the normals of its front; `None` where they point everywhere.
    fn extent(&self) -> (Bounds, Option<(Vec3, f32)>) {
        match self {
            Emitter::Triangles { mesh, .. } => {
                let normals = || {
                    (0..mesh.triangles.len()).map(|t| {
                        let [a, b, c] = mesh.corners(t);
                        (b - a).cross(c - a).normalize_or_zero()
                    })
                };
                let axis = normals().sum::<Vec3>().normalize_or_zero();
                let cos = normals().filter(|normal| *normal != Vec3::ZERO).fold(1.0f32, |cos, normal| cos.min(normal.dot(axis)));
                let corners = mesh.triangles.iter().flatten().map(|k| mesh.positions[*k as usize]);
                (Bounds::around(corners), (axis != Vec3::ZERO).then(|| (axis, libm::acosf(cos.clamp(-1.0, 1.0)))))
            }
            Emitter::Parallelogram { corner, edges: [a, b] } => {
                let corners = [*corner, *corner + *a, *corner + *b, *corner + *a + *b];
                (Bounds::around(corners), Some((a.cross(*b).normalize_or_zero(), 0.0)))
            }
            Emitter::Analytic(surface) => {
                let flat = matches!(surface.form, Form::Disk(_)).then(|| (surface.sample([0.5; 2]).normal, 0.0));
                (surface.bounds(), flat)
            }
        }
    }

    /// What may take part in a position besides its own coordinates.
    #[inline]
    fn size(&self) -> f32 {
        match self {
            Emitter::Analytic(surface) => surface.size(),
            Emitter::Triangles { .. } | Emitter::Parallelogram { .. } => 0.0,
        }
    }

    /// A point uniform by area.
    pub(super) fn point(&self, u: [f32; 2]) -> Spot {
        match self {
            Emitter::Triangles { mesh, choice, .. } => {
                let (t, _, rest) = choice.sample(u[0]);
                let [a, b, c] = mesh.corners(t);
                let [v, w] = warp::triangle([rest, u[1]]);
                Spot {
                    position: a + (b - a) * v + (c - a) * w,
                    normal: (b - a).cross(c - a).normalize_or_zero(),
                    at: TexturePoint { uv: mesh.uv(t, [v, w]), colour: mesh.colour(t, [v, w]) },
                }
            }
            Emitter::Parallelogram { corner, edges } => Spot {
                position: *corner + edges[0] * u[0] + edges[1] * u[1],
                normal: edges[0].cross(edges[1]).normalize_or_zero(),
                at: TexturePoint { uv: Vec2::ZERO, colour: Vec3::ONE },
            },
            Emitter::Analytic(surface) => surface.sample(u).into(),
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

/// Points of a texture that its mean radiance is taken from, along each side of a grid.
const GRID: u32 = 32;

impl AreaLight {
    #[inline]
    pub(super) fn sample(&self, light: u32, from: Vec3, u: [f32; 2]) -> Option<(LightPoint, f32)> {
        let spot = match &self.emitter {
            Emitter::Analytic(surface @ Analytic { form: Form::Sphere(sphere), .. }) => match cone(sphere, from) {
                Some(cone) => surface.of_sphere(sphere, towards(sphere, cone, from, u)).into(),
                None => surface.sample(u).into(),
            },
            emitter => emitter.point(u),
        };
        let error = error(spot.position, self.emitter.size());
        let Spot { position, normal, at } = spot;
        let point = LightPoint { light, position, error, normal, at, infinite: false, delta: false };
        let density = self.density(from, &point);
        (density > 0.0 && density.is_finite()).then_some((point, density))
    }

    #[inline]
    pub(super) fn density(&self, from: Vec3, point: &LightPoint) -> f32 {
        let to = point.position - from;
        let distance2 = to.length_squared();
        let facing = -to.dot(point.normal);
        let facing = if self.two_sided { facing.abs() } else { facing };
        if facing <= 0.0 || distance2 == 0.0 {
            return 0.0;
        }
        if let Emitter::Analytic(Analytic { form: Form::Sphere(sphere), .. }) = &self.emitter
            && let Some((one_minus_cos, _)) = cone(sphere, from)
        {
            return 1.0 / (2.0 * PI * one_minus_cos);
        }
        // Area to solid angle: d² / (cosθ A), with cosθ = facing / d.
        distance2 * distance2.sqrt() / (facing * self.emitter.area())
    }

    /// Radiance that leaves a point of it towards `from`.
    #[inline]
    pub(super) fn radiance(&self, point: &LightPoint, from: Vec3) -> Spectrum {
        let seen = (from - point.position).dot(point.normal);
        if seen > 0.0 || (self.two_sided && seen < 0.0) { self.radiance.at(&point.at) } else { Spectrum::BLACK }
    }

    /// Where it lies and which way it shines.
    pub(super) fn reach(&self) -> Reach {
        let (bounds, normals) = self.emitter.extent();
        let facing = self.mean() * self.emitter.area();
        match normals {
            Some((axis, spread)) if !self.two_sided => Reach { bounds, axis, spread, falloff: 0.5 * PI, intensity: facing },
            Some(_) => Reach::everywhere(bounds, facing),
            // Convex bodies show a quarter of their surface (Cauchy).
            None => Reach::everywhere(bounds, 0.25 * facing),
        }
    }

    /// Power over π, all sides together [W].
    pub(super) fn power(&self) -> f32 {
        self.mean() * self.emitter.area() * if self.two_sided { 2.0 } else { 1.0 }
    }

    /// Radiance, averaged over the surface and the channels.
    fn mean(&self) -> f32 {
        match &self.radiance {
            ColourInput::Constant(radiance) => radiance.mean(),
            radiance => {
                let place = |k: u32| (k as f32 + 0.5) / GRID as f32;
                let sum: f32 =
                    (0..GRID * GRID).map(|k| radiance.at(&self.emitter.point([place(k % GRID), place(k / GRID)]).at).mean()).sum();
                // What the grid misses must be found all the same.
                (sum / (GRID * GRID) as f32).max(1e-3)
            }
        }
    }
}

/// The outward normal where a direction inside the cone, chosen by two numbers, meets the sphere first.
#[inline]
fn towards(sphere: &Sphere, (one_minus_cos, sin2_max): (f32, f32), from: Vec3, u: [f32; 2]) -> Vec3 {
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
    frame.to_world(Vec3::new(sin_alpha * c, sin_alpha * s, cos_alpha)).normalize()
}

/// Bound on the rounding error of a sampled position.
#[inline]
fn error(position: Vec3, size: f32) -> f32 {
    (position.abs().max_element() + size) * (16.0 * f32::EPSILON)
}

#[cfg(test)]
mod tests;
