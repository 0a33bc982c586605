//! Where a material point of one instant is at another.

use super::{ANALYTIC, Group, WORLD, World};
use crate::geometry::analytic::{Analytic, Form};
use crate::geometry::{Hit, SurfacePoint};
use crate::math::Vec3;

impl World {
    /// The place in the world `there` of the material point that is at `surface` in this one: the same triangle and barycentric
    /// coordinates, or the same place in a surface's own frame. `None` where `there` has no such part.
    ///
    /// Both must be instants of one scene: parts are matched by their numbers.
    pub fn carry(&self, surface: &SurfacePoint, there: &World) -> Option<Vec3> {
        let hit = &surface.hit;
        if hit.instance == WORLD {
            return self.own.carry(hit, surface.position, &there.own);
        }
        let (here, then) = (self.instances.get(hit.instance as usize)?, there.instances.get(hit.instance as usize)?);
        let (group, other) = (self.groups.get(here.group as usize)?, there.groups.get(then.group as usize)?);
        let local = here.to_world.point_back(surface.position);
        Some(then.to_world.point(group.carry(hit, local, other)?))
    }
}

impl Group {
    fn carry(&self, hit: &Hit, position: Vec3, there: &Group) -> Option<Vec3> {
        if hit.primitive & ANALYTIC != 0 {
            let index = (hit.primitive & !ANALYTIC) as usize;
            let ((here, shape), (other, same)) = (self.analytic.get(index)?, there.analytic.get(index)?);
            return if shape == same { carried(here, position, other) } else { None };
        }
        let ((m, t), (other_m, other_t)) = (self.triangles.get(hit.primitive as usize)?, there.triangles.get(hit.primitive as usize)?);
        let ((_, shape), (mesh, same)) = (self.meshes.get(*m as usize)?, there.meshes.get(*other_m as usize)?);
        if shape != same || t != other_t {
            return None;
        }
        let [a, b, c] = mesh.corners(*other_t as usize);
        let [v, w] = hit.barycentric;
        Some(a * (1.0 - v - w) + b * v + c * w)
    }
}

/// A point of one surface, on the same surface after it moved.
fn carried(here: &Analytic, position: Vec3, there: &Analytic) -> Option<Vec3> {
    match (&here.form, &there.form) {
        (Form::Sphere(from), Form::Sphere(to)) => {
            let outwards = here.frame.to_local((position - from.centre) / from.radius);
            Some(to.centre + there.frame.to_world(outwards) * to.radius)
        }
        (Form::Disk(from), Form::Disk(to)) => {
            let at = from.coordinates(position);
            Some(to.centre + to.x * at.x + to.y * at.y)
        }
        (Form::Cylinder(from), Form::Cylinder(to)) => {
            let from_start = here.frame.to_local(position - from.start);
            let scale = Vec3::new(to.radius / from.radius, to.radius / from.radius, to.length / from.length);
            Some(to.start + there.frame.to_world(from_start * scale))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Cylinder, Disk, Group, Instance, Mesh, ShapeId, Sphere, WorldBuilder};
    use crate::math::{Ray, Transform};

    fn moved(by: f64) -> Transform {
        let (s, c) = (libm::sin(by), libm::cos(by));
        Transform::from_rows([[c, -s, 0.0, by], [s, c, 0.0, -0.5 * by], [0.0, 0.0, 1.0, 0.25 * by]]).unwrap()
    }

    /// A triangle and three surfaces; the triangle also in a group of its own.
    fn world(to: &Transform) -> World {
        let corners = [Vec3::new(-1.0, -1.0, 4.0), Vec3::new(1.0, -1.0, 4.0), Vec3::new(0.0, 1.0, 5.0)];
        let triangle = |to: &Transform| Mesh {
            positions: corners.iter().map(|corner| to.point(*corner)).collect(),
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| to.vector(axis));
        let frame = crate::math::Frame { tangent: x, bitangent: y, normal: z };
        let at = |x: f32| to.point(Vec3::new(x, 0.0, 5.0));
        let analytic = [
            Analytic { frame, ..Sphere { centre: at(4.0), radius: 1.0 }.into() },
            Disk { centre: at(8.0), x, y: y * 0.5 }.into(),
            Analytic { frame, ..Cylinder { start: at(12.0), axis: z, length: 2.0, radius: 1.0 }.into() },
        ];
        let aside = Transform::from_rows([[1.0, 0.0, 0.0, -4.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]).unwrap();
        WorldBuilder {
            meshes: vec![(triangle(to), ShapeId(0))],
            analytic: analytic.into_iter().zip([1, 2, 3].map(ShapeId)).collect(),
            built: None,
            groups: vec![Group::build(vec![(triangle(&Transform::IDENTITY), ShapeId(4))], Vec::new()).into()],
            instances: vec![Instance { group: 0, to_world: to.after(&aside) }],
        }
        .build()
    }

    #[test]
    fn material_points_move_with_what_they_belong_to() {
        let (here, to) = (world(&Transform::IDENTITY), moved(0.3));
        let there = world(&to);
        let mut met = [false; 5];
        for x in [-4.2, -4.0, 0.1, 0.2, 3.7, 4.3, 7.6, 8.1, 11.6, 12.86] {
            for y in [-0.3, 0.1, 0.35] {
                let ray = Ray::new(Vec3::new(x, y, 0.0), Vec3::new(0.02, 0.01, 1.0));
                let Some(hit) = here.closest(&ray) else { continue };
                let surface = here.surface(&ray, &hit);
                met[surface.shape.0 as usize] = true;
                let carried = here.carry(&surface, &there).unwrap();
                assert!((carried - to.point(surface.position)).length() < 1e-5, "{surface:?}: {carried}");
                assert!((here.carry(&surface, &here).unwrap() - surface.position).length() < 1e-5);
            }
        }
        assert_eq!(met, [true; 5]);
    }

    #[test]
    fn what_is_not_there_is_nowhere() {
        let here = world(&Transform::IDENTITY);
        let ray = Ray::new(Vec3::new(4.0, 0.0, 0.0), Vec3::Z);
        let surface = here.surface(&ray, &here.closest(&ray).unwrap());
        assert_eq!(here.carry(&surface, &World::default()), None);
    }
}
