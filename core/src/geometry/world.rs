//! The whole geometry of a scene: groups of shapes, each with its tree, and instances of groups under a transform.

mod carry;

use super::analytic::{Analytic, Place};
use super::bvh::{Bounds, Probe, Tree, any, closest};
use super::mesh::Mesh;
use super::surface::SurfacePoint;
use super::triangle::{Packet, Sheared};
use crate::math::{Ray, Transform, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Index of a shape in the scene's table of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShapeId(pub u32);

/// What a ray met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray direction's length.
    pub t: f32,
    instance: u32,
    primitive: u32,
    barycentric: [f32; 2],
}

/// `instance` of a hit on geometry that stands in the world itself.
const WORLD: u32 = u32::MAX;
/// Set in `primitive` for surfaces given by a formula.
const ANALYTIC: u32 = 1 << 31;

/// Shapes with one tree over them.
#[derive(Clone, Debug, Default)]
pub struct Group {
    meshes: Vec<(Mesh, ShapeId)>,
    /// Triangle → (mesh, triangle in it).
    triangles: Vec<(u32, u32)>,
    triangle_tree: Tree,
    /// One for each leaf of the triangle tree, which names it.
    packets: Vec<Packet>,
    analytic: Vec<(Analytic, ShapeId)>,
    analytic_tree: Tree,
}

/// Triangles in a leaf: one packet.
const LEAF: usize = 4;

/// Names a leaf of one item by that item.
fn only(items: &[u32]) -> usize {
    items[0] as usize
}

impl Group {
    /// Builds the trees. Degenerate triangles may be among them: no ray meets one.
    pub fn build(meshes: Vec<(Mesh, ShapeId)>, analytic: Vec<(Analytic, ShapeId)>) -> Self {
        let mut triangles = Vec::new();
        for (m, (mesh, _)) in meshes.iter().enumerate() {
            triangles.extend((0..mesh.triangles.len()).map(|t| (m as u32, t as u32)));
        }
        let corners = |&(m, t): &(u32, u32)| meshes[m as usize].0.corners(t as usize);
        let boxes: Vec<Bounds> = triangles.par_iter().map(|t| Bounds::around(corners(t))).collect();
        let mut packets = Vec::new();
        let triangle_tree = Tree::build(&boxes, LEAF, |items| {
            let lanes: Vec<_> = items.iter().map(|id| (corners(&triangles[*id as usize]), *id)).collect();
            packets.push(Packet::new(&lanes));
            packets.len() - 1
        });
        let boxes: Vec<Bounds> = analytic.iter().map(|(surface, _)| surface.bounds().widened(rounding(surface.size()))).collect();
        let analytic_tree = Tree::build(&boxes, 1, only);
        Self { meshes, triangles, triangle_tree, packets, analytic, analytic_tree }
    }

    /// Bounds of all shapes.
    pub fn bounds(&self) -> Bounds {
        self.triangle_tree.bounds().union(self.analytic_tree.bounds())
    }

    #[inline]
    fn closest(&self, ray: &Ray, instance: u32, best: &mut Option<Hit>) -> f32 {
        let probe = Probe::new(ray);
        let mut reach = ray.reach;
        let mut offer = |t: f32, primitive: u32, barycentric: [f32; 2]| {
            let nearer = best.is_none_or(|b| t < b.t || (t == b.t && (instance, primitive) < (b.instance, b.primitive)));
            if nearer {
                *best = Some(Hit { t, instance, primitive, barycentric });
            }
        };
        if !self.packets.is_empty() {
            let sheared = Sheared::new(ray);
            closest(&self.triangle_tree, &probe, reach, |leaf, limit| match sheared.closest(&self.packets[leaf as usize], limit) {
                Some(hit) => {
                    offer(hit.t, hit.id, hit.barycentric);
                    reach = reach.min(hit.t);
                    hit.t
                }
                None => limit,
            });
        }
        if !self.analytic.is_empty() {
            let start = reach;
            closest(&self.analytic_tree, &probe, start, |leaf, limit| {
                match self.analytic[leaf as usize].0.intersect(&Ray { reach: limit, ..*ray }) {
                    Some(t) => {
                        offer(t, leaf | ANALYTIC, [0.0; 2]);
                        reach = reach.min(t);
                        t
                    }
                    None => limit,
                }
            });
        }
        reach
    }

    #[inline]
    fn any(&self, ray: &Ray) -> bool {
        let probe = Probe::new(ray);
        if !self.packets.is_empty() {
            let sheared = Sheared::new(ray);
            if any(&self.triangle_tree, &probe, ray.reach, |leaf| sheared.any(&self.packets[leaf as usize], ray.reach)) {
                return true;
            }
        }
        !self.analytic.is_empty()
            && any(&self.analytic_tree, &probe, ray.reach, |leaf| self.analytic[leaf as usize].0.intersect(ray).is_some())
    }

    /// The surface point in the group's own frame; `error` is filled in, `t` and the position along an instance's transform are not.
    #[inline(always)]
    fn point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        if hit.primitive & ANALYTIC != 0 {
            let (surface, shape) = &self.analytic[(hit.primitive & !ANALYTIC) as usize];
            let Place { position, normal, uv } = surface.place(ray.origin + ray.direction * hit.t);
            let error = rounding(surface.size());
            return SurfacePoint { position, error, normal, shading_normal: normal, uv, t: hit.t, shape: *shape, hit: *hit };
        }
        let (m, t) = self.triangles[hit.primitive as usize];
        let (mesh, shape) = &self.meshes[m as usize];
        let corners = mesh.triangles[t as usize];
        let [a, b, c] = corners.map(|k| mesh.positions[k as usize]);
        let [v, w] = hit.barycentric;
        let u = 1.0 - v - w;
        let position = a * u + b * v + c * w;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let error = rounding(a.abs().max(b.abs()).max(c.abs()).max_element());
        let shading_normal = if mesh.normals.is_empty() {
            normal
        } else {
            let [na, nb, nc] = corners.map(|k| mesh.normals[k as usize]);
            let n = (na * u + nb * v + nc * w).normalize_or_zero();
            if n.dot(normal) > 0.0 {
                n
            } else if n.dot(normal) < 0.0 {
                -n
            } else {
                normal
            }
        };
        let uv = mesh.uv(t as usize, hit.barycentric);
        SurfacePoint { position, error, normal, shading_normal, uv, t: hit.t, shape: *shape, hit: *hit }
    }
}

/// Bound on the rounding error of a position interpolated from coordinates of this size: γ₇ along each axis, with room for the normal's own error.
#[inline]
fn rounding(size: f32) -> f32 {
    size * (16.0 * f32::EPSILON)
}

/// A group placed in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index of the group.
    pub group: u32,
    /// Group to world.
    pub to_world: Transform,
}

/// All geometry, ready to be traced.
#[derive(Clone, Debug, Default)]
pub struct World {
    own: Arc<Group>,
    groups: Vec<Arc<Group>>,
    instances: Vec<Instance>,
    instance_tree: Tree,
}

/// Gathers geometry for a [`World`].
#[derive(Clone, Debug, Default)]
pub struct WorldBuilder {
    /// Meshes in world space.
    pub meshes: Vec<(Mesh, ShapeId)>,
    /// Surfaces given by a formula, in world space.
    pub analytic: Vec<(Analytic, ShapeId)>,
    /// What stands in the world and was built before, in the place of `meshes` and `analytic`.
    pub built: Option<Arc<Group>>,
    /// Groups to be instanced.
    pub groups: Vec<Arc<Group>>,
    /// Placed groups; a group inside a group is placed by the product of their transforms.
    pub instances: Vec<Instance>,
}

impl WorldBuilder {
    /// Builds all trees.
    pub fn build(self) -> World {
        let boxes: Vec<Bounds> = self
            .instances
            .iter()
            .map(|i| Bounds::around(self.groups[i.group as usize].bounds().corners().map(|p| i.to_world.point(p))))
            .map(|b| {
                let margin = Vec3::splat(rounding(b.lower.abs().max(b.upper.abs()).max_element()));
                Bounds { lower: b.lower - margin, upper: b.upper + margin }
            })
            .collect();
        let instance_tree = Tree::build(&boxes, 1, only);
        let own = self.built.unwrap_or_else(|| Arc::new(Group::build(self.meshes, self.analytic)));
        World { own, groups: self.groups, instances: self.instances, instance_tree }
    }
}

impl World {
    /// Bounds of everything.
    pub fn bounds(&self) -> Bounds {
        self.own.bounds().union(self.instance_tree.bounds())
    }

    /// What stands in the world itself, to be shared with another world.
    pub fn own(&self) -> Arc<Group> {
        self.own.clone()
    }

    /// The nearest surface within the ray's reach.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best = None;
        let reach = self.own.closest(ray, WORLD, &mut best);
        if !self.instances.is_empty() {
            self.closest_instance(&Ray { reach, ..*ray }, &mut best);
        }
        best
    }

    fn closest_instance(&self, ray: &Ray, best: &mut Option<Hit>) {
        closest(&self.instance_tree, &Probe::new(ray), ray.reach, |leaf, limit| {
            let instance = &self.instances[leaf as usize];
            let local = into_instance(&Ray { reach: limit, ..*ray }, instance);
            self.groups[instance.group as usize].closest(&local, leaf, best)
        });
    }

    /// Whether anything lies within the ray's reach.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.own.any(ray)
            || (!self.instances.is_empty()
                && any(&self.instance_tree, &Probe::new(ray), ray.reach, |leaf| {
                    let instance = &self.instances[leaf as usize];
                    self.groups[instance.group as usize].any(&into_instance(ray, instance))
                }))
    }

    /// The surface at a hit of this ray, in world space.
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        if hit.instance == WORLD {
            return self.own.point(ray, hit);
        }
        let instance = &self.instances[hit.instance as usize];
        let local = self.groups[instance.group as usize].point(&into_instance(ray, instance), hit);
        let map = &instance.to_world;
        let position = map.point(local.position);
        let normal = map.normal(local.normal).normalize_or_zero();
        let shading_normal = map.normal(local.shading_normal).normalize_or_zero();
        SurfacePoint {
            position,
            normal,
            shading_normal,
            error: local.error * map.stretch() + rounding(position.abs().max_element()),
            ..local
        }
    }
}

impl World {
    /// Direction in which the first texture coordinate grows, ∂p/∂u, of no certain length; zero where there is none.
    pub fn tangent(&self, surface: &SurfacePoint) -> Vec3 {
        self.partials(surface).0
    }

    /// ∂p/∂u and ∂p/∂v at a surface point, in world space; zero where the texture coordinates do not vary.
    pub fn partials(&self, surface: &SurfacePoint) -> (Vec3, Vec3) {
        let hit = &surface.hit;
        if hit.instance == WORLD {
            return self.own.partials(hit, surface.position);
        }
        let instance = &self.instances[hit.instance as usize];
        let position = instance.to_world.point_back(surface.position);
        let (du, dv) = self.groups[instance.group as usize].partials(hit, position);
        (instance.to_world.vector(du), instance.to_world.vector(dv))
    }

    /// Colour of the mesh's vertices, interpolated at a surface point; (1, 1, 1) where it has none.
    pub fn colour(&self, surface: &SurfacePoint) -> Vec3 {
        let hit = &surface.hit;
        let group = if hit.instance == WORLD { &self.own } else { &self.groups[self.instances[hit.instance as usize].group as usize] };
        group.colour(hit)
    }
}

impl Group {
    fn partials(&self, hit: &Hit, position: Vec3) -> (Vec3, Vec3) {
        if hit.primitive & ANALYTIC != 0 {
            return self.analytic[(hit.primitive & !ANALYTIC) as usize].0.partials(position);
        }
        let (m, t) = self.triangles[hit.primitive as usize];
        let mesh = &self.meshes[m as usize].0;
        let [a, b, c] = mesh.corners(t as usize);
        let corners = mesh.triangles[t as usize];
        let [ua, ub, uc] = if mesh.uvs.is_empty() { [Vec2::ZERO, Vec2::X, Vec2::Y] } else { corners.map(|k| mesh.uvs[k as usize]) };
        let (d1, d2) = (ub - ua, uc - ua);
        let determinant = d1.perp_dot(d2);
        if determinant == 0.0 {
            return (Vec3::ZERO, Vec3::ZERO);
        }
        let (e1, e2) = (b - a, c - a);
        ((e1 * d2.y - e2 * d1.y) / determinant, (e2 * d1.x - e1 * d2.x) / determinant)
    }

    fn colour(&self, hit: &Hit) -> Vec3 {
        if hit.primitive & ANALYTIC != 0 {
            return Vec3::ONE;
        }
        let (m, t) = self.triangles[hit.primitive as usize];
        let mesh = &self.meshes[m as usize].0;
        mesh.colour(t as usize, hit.barycentric)
    }
}

/// The ray in the instance's own frame. Its direction keeps its length there, so that t means the same.
#[inline]
fn into_instance(ray: &Ray, instance: &Instance) -> Ray {
    Ray { origin: instance.to_world.point_back(ray.origin), direction: instance.to_world.vector_back(ray.direction), reach: ray.reach }
}
