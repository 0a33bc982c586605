//! Surfaces given by a formula: where rays meet them, their texture coordinates, and points uniform on them.

use super::bvh::Bounds;
use super::cylinder::Cylinder;
use super::disk::Disk;
use super::sphere::Sphere;
use crate::math::{Frame, INV_PI, PI, Ray, Vec2, Vec3, safe_sqrt};
use crate::sampling::warp;

/// The form of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// A sphere; its front is its outside.
    Sphere(Sphere),
    /// A disk, maybe stretched.
    Disk(Disk),
    /// A tube without ends; its front is its outside.
    Cylinder(Cylinder),
}

/// A surface given by a formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Analytic {
    /// Its form.
    pub form: Form,
    /// The unit axes that its texture coordinates go by; a cylinder's normal axis is its own.
    pub frame: Frame,
    /// Whether its front is its back.
    pub flipped: bool,
    /// Whether anything asks for its texture coordinates; they are zero where nothing does.
    pub textured: bool,
}

/// A point on such a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position.
    pub position: Vec3,
    /// Unit normal of the front.
    pub normal: Vec3,
    /// Texture coordinates in [0, 1]².
    pub uv: Vec2,
}

impl From<Sphere> for Analytic {
    fn from(sphere: Sphere) -> Self {
        Self { form: Form::Sphere(sphere), frame: Frame::WORLD, flipped: false, textured: true }
    }
}

impl From<Disk> for Analytic {
    fn from(disk: Disk) -> Self {
        Self { form: Form::Disk(disk), frame: Frame::WORLD, flipped: false, textured: true }
    }
}

impl From<Cylinder> for Analytic {
    fn from(cylinder: Cylinder) -> Self {
        Self { form: Form::Cylinder(cylinder), frame: Frame::from_normal(cylinder.axis), flipped: false, textured: true }
    }
}

impl Analytic {
    /// Surface area [m²].
    pub fn area(&self) -> f32 {
        match &self.form {
            Form::Sphere(sphere) => sphere.area(),
            Form::Disk(disk) => disk.area(),
            Form::Cylinder(cylinder) => cylinder.area(),
        }
    }

    /// Bounds.
    pub fn bounds(&self) -> Bounds {
        match &self.form {
            Form::Sphere(s) => Bounds { lower: s.centre - Vec3::splat(s.radius), upper: s.centre + Vec3::splat(s.radius) },
            Form::Disk(disk) => disk.bounds(),
            Form::Cylinder(cylinder) => cylinder.bounds(),
        }
    }

    /// The largest coordinate that takes part in a position: rounding errors are in proportion to it.
    pub(crate) fn size(&self) -> f32 {
        match &self.form {
            Form::Sphere(sphere) => sphere.centre.abs().max_element() + sphere.radius,
            Form::Disk(disk) => (disk.centre.abs() + disk.x.abs() + disk.y.abs()).max_element(),
            Form::Cylinder(tube) => tube.start.abs().max_element() + tube.length + tube.radius,
        }
    }

    /// The nearest t with 0 < t ≤ reach.
    #[inline]
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<f32> {
        match &self.form {
            Form::Sphere(sphere) => sphere.intersect(ray),
            Form::Disk(disk) => disk.intersect(ray),
            Form::Cylinder(cylinder) => cylinder.intersect(ray),
        }
    }

    /// The place next to a point that lies on the surface but for rounding.
    #[inline]
    pub(super) fn place(&self, near: Vec3) -> Place {
        match &self.form {
            Form::Sphere(sphere) => self.of_sphere(sphere, (near - sphere.centre).normalize()),
            Form::Disk(disk) => self.of_disk(disk, disk.coordinates(near)),
            Form::Cylinder(tube) => {
                let from_start = near - tube.start;
                let height = (from_start.dot(tube.axis) / tube.length).clamp(0.0, 1.0);
                self.of_cylinder(tube, (from_start - tube.axis * from_start.dot(tube.axis)).normalize(), height)
            }
        }
    }

    /// A place uniform by area, by two numbers in [0, 1).
    #[inline]
    pub(crate) fn sample(&self, u: [f32; 2]) -> Place {
        match &self.form {
            Form::Sphere(sphere) => self.of_sphere(sphere, warp::uniform_sphere(u)),
            Form::Disk(disk) => self.of_disk(disk, warp::concentric_disk(u)),
            Form::Cylinder(tube) => {
                let (s, c) = crate::math::sin_cos(2.0 * PI * u[0]);
                self.of_cylinder(tube, self.frame.tangent * c + self.frame.bitangent * s, u[1])
            }
        }
    }

    /// Of a sphere, in the direction of a unit vector from its centre: u runs around the z axis from x, v from +z to −z.
    #[inline]
    pub(crate) fn of_sphere(&self, sphere: &Sphere, outwards: Vec3) -> Place {
        let uv = if self.textured {
            let local = self.frame.to_local(outwards);
            Vec2::new(turn(local.x, local.y), libm::acosf(local.z.clamp(-1.0, 1.0)) * INV_PI)
        } else {
            Vec2::ZERO
        };
        Place { position: sphere.centre + outwards * sphere.radius, normal: self.front(outwards), uv }
    }

    /// Of a disk: u runs from its centre to its rim, v around it from x to y.
    #[inline]
    fn of_disk(&self, disk: &Disk, at: Vec2) -> Place {
        let uv = if self.textured { Vec2::new(at.length().min(1.0), turn(at.x, at.y)) } else { Vec2::ZERO };
        Place { position: disk.centre + disk.x * at.x + disk.y * at.y, normal: self.front(disk.normal()), uv }
    }

    /// Of a tube, by its outward normal and the height in [0, 1]: u runs around the axis, v along it.
    #[inline]
    fn of_cylinder(&self, tube: &Cylinder, outwards: Vec3, height: f32) -> Place {
        let local = self.frame.to_local(outwards);
        let uv = if self.textured { Vec2::new(turn(local.x, local.y), height) } else { Vec2::ZERO };
        let position = tube.start + tube.axis * (height * tube.length) + outwards * tube.radius;
        Place { position, normal: self.front(outwards), uv }
    }

    #[inline]
    fn front(&self, normal: Vec3) -> Vec3 {
        if self.flipped { -normal } else { normal }
    }

    /// ∂p/∂u and ∂p/∂v next to a point of the surface; zero where the texture coordinates do not vary.
    pub(super) fn partials(&self, near: Vec3) -> (Vec3, Vec3) {
        match &self.form {
            Form::Sphere(sphere) => {
                let p = self.frame.to_local(near - sphere.centre);
                let across = safe_sqrt(p.x * p.x + p.y * p.y);
                let du = self.frame.to_world(Vec3::new(-p.y, p.x, 0.0)) * (2.0 * PI);
                if across == 0.0 {
                    return (Vec3::ZERO, Vec3::ZERO);
                }
                (du, self.frame.to_world(Vec3::new(p.z * p.x / across, p.z * p.y / across, -across)) * PI)
            }
            Form::Disk(disk) => {
                let at = disk.coordinates(near);
                let outwards = at.normalize_or_zero();
                (disk.x * outwards.x + disk.y * outwards.y, (disk.y * at.x - disk.x * at.y) * (2.0 * PI))
            }
            Form::Cylinder(tube) => (tube.axis.cross(near - tube.start) * (2.0 * PI), tube.axis * tube.length),
        }
    }
}

/// The angle of a point about the origin from the first axis to the second, in turns in [0, 1).
#[inline]
fn turn(x: f32, y: f32) -> f32 {
    let turns = libm::atan2f(y, x) * (0.5 * INV_PI);
    if turns < 0.0 { (turns + 1.0).min(1.0 - 0.5 * f32::EPSILON) } else { turns }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{ShapeId, WorldBuilder};
    use crate::math::spawn;
    use crate::sampling::{Dimension, SampleKey, SampleStream};

    fn stream(index: u32) -> SampleStream {
        SampleStream::open(SampleKey { seed: 11, frame: 0, x: 0, y: 0, index })
    }

    fn forms(scale: f32) -> [Analytic; 3] {
        let c = Vec3::new(3.0, -2.0, 5.0) * scale;
        let axis = Vec3::new(0.6, 0.0, 0.8);
        [
            Sphere { centre: c, radius: scale }.into(),
            Disk { centre: c, x: Vec3::new(1.0, 0.2, 0.0) * scale, y: Vec3::new(-0.1, 0.3, 0.7) * scale }.into(),
            Cylinder { start: c, axis, length: 2.0 * scale, radius: 0.5 * scale }.into(),
        ]
    }

    #[test]
    fn rays_find_the_places_that_were_aimed_at() {
        for scale in [1e-5f32, 1.0, 1e5] {
            for surface in forms(scale) {
                let world = WorldBuilder { analytic: vec![(surface, ShapeId(0))], ..WorldBuilder::default() }.build();
                for k in 0..2000 {
                    let s = stream(k);
                    let place = surface.sample(s.pair(Dimension::PIXEL));
                    // From outside along a direction of the front's side.
                    let away = warp::uniform_sphere(s.pair(Dimension::LENS));
                    let away = if away.dot(place.normal) < 0.0 { -away } else { away };
                    if away.dot(place.normal) < 0.05 {
                        continue;
                    }
                    let ray = Ray::new(place.position + away * (3.0 * scale), -away);
                    let hit = world.closest(&ray).expect("hit");
                    let met = world.surface(&ray, &hit);
                    assert!((met.position - place.position).length() < 1e-4 * scale, "{surface:?}: {met:?} {place:?}");
                    assert!((met.normal - place.normal).length() < 1e-3 && met.normal.is_normalized());
                    let apart = (met.uv - place.uv).abs();
                    assert!(apart.x.min(1.0 - apart.x) < 1e-2 && apart.y.min(1.0 - apart.y) < 1e-2, "{} {}", met.uv, place.uv);
                    // The way back is free; what goes on behind leaves without meeting the same place again.
                    assert!(!world.occluded(&spawn(met.position, met.error, met.normal, away)), "{surface:?}: {place:?}");
                    let on = spawn(met.position, met.error, met.normal, -away);
                    assert!(
                        !world.occluded(&Ray { reach: 1e-3 * scale, ..on }) || matches!(surface.form, Form::Cylinder(_) | Form::Sphere(_))
                    );
                    let bounds = surface.bounds();
                    let slack = Vec3::splat(1e-5 * scale);
                    assert!(met.position.cmpge(bounds.lower - slack).all() && met.position.cmple(bounds.upper + slack).all());
                }
            }
        }
    }

    #[test]
    fn partials_are_the_slopes_of_places() {
        for surface in forms(1.0) {
            for k in 0..200 {
                let place = surface.sample(stream(k).pair(Dimension::PIXEL));
                let (du, dv) = surface.partials(place.position);
                let h = 1e-3;
                for (slope, other) in [(du, 0), (dv, 1)] {
                    let near = surface.place(place.position + slope.normalize_or_zero() * (h * 0.5));
                    let moved = near.uv[other] - place.uv[other];
                    if slope.length() < 0.3 || moved.abs() > 0.5 {
                        continue;
                    }
                    let expected = (near.position - place.position).length() / slope.length();
                    assert!((moved - expected).abs() < 0.1 * expected + 1e-5, "{surface:?} {other}: {moved} {expected}");
                }
            }
        }
    }

    #[test]
    fn points_are_uniform_by_area() {
        // The mean of a coordinate over each surface is that of its middle.
        for surface in forms(1.0) {
            let n = 20_000;
            let mean = (0..n).map(|k| surface.sample(stream(k).pair(Dimension::PIXEL)).position).sum::<Vec3>() / n as f32;
            let middle = match surface.form {
                Form::Sphere(s) => s.centre,
                Form::Disk(d) => d.centre,
                Form::Cylinder(c) => c.start + c.axis * (0.5 * c.length),
            };
            assert!((mean - middle).length() < 1e-2, "{surface:?}: {mean}");
        }
    }
}
