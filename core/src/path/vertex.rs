//! A vertex of a path: where it lies, how it is oriented, and what it can do.

use crate::geometry::SurfacePoint;
use crate::material::{Evaluation, Material, Scatter};
use crate::math::{Frame, Ray, Vec3, spawn};
use crate::scene::Scene;

/// A path vertex on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// World position.
    pub position: Vec3,
    /// Bound on the rounding error of `position` [scene units].
    pub error: f32,
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Shading frame.
    pub frame: Frame,
    /// Unit direction to the previous vertex, in the shading frame.
    pub wo: Vec3,
    /// Index of the material.
    pub material: u32,
    /// Whether a shift may reconnect here: the material's sharpest lobe is no delta and no sharper than the plan's threshold.
    pub connectable: bool,
    /// Whether shading and geometric normal agree about the side that `wo` points to; else nothing is scattered.
    faces: bool,
}

impl Vertex {
    /// The vertex where a ray of this unit direction met a surface.
    #[inline]
    pub fn new(scene: &Scene, surface: &SurfacePoint, direction: Vec3, threshold: f32) -> Self {
        let frame = Frame::from_normal(surface.shading_normal);
        let material = scene.shape(surface.shape).material;
        let wo = frame.to_local(-direction);
        let roughness = scene.materials[material as usize].roughness();
        Self {
            position: surface.position,
            error: surface.error,
            normal: surface.normal,
            frame,
            wo,
            material,
            connectable: roughness > 0.0 && roughness >= threshold,
            faces: -surface.normal.dot(direction) * wo.z > 0.0,
        }
    }

    /// Its material.
    #[inline]
    pub fn material<'s>(&self, scene: &'s Scene) -> &'s Material {
        &scene.materials[self.material as usize]
    }

    /// Value and density of leaving in the world direction `wi`.
    #[inline]
    pub fn evaluate(&self, scene: &Scene, wi: Vec3) -> Evaluation {
        self.scatter(scene, self.faces, self.wo, wi)
    }

    /// The same for a path that came from another point than the vertex's own predecessor.
    #[inline]
    pub fn evaluate_from(&self, scene: &Scene, predecessor: Vec3, wi: Vec3) -> Evaluation {
        let world = (predecessor - self.position).normalize_or_zero();
        let wo = self.frame.to_local(world);
        self.scatter(scene, self.same_side(world, wo), wo, wi)
    }

    /// Value and probability of the delta lobe that leads in the world direction `wi`.
    #[inline]
    pub fn evaluate_delta(&self, scene: &Scene, transmits: bool, wi: Vec3) -> Evaluation {
        if !self.faces || !self.same_side(wi, self.frame.to_local(wi)) {
            return Evaluation::NONE;
        }
        self.material(scene).evaluate_delta(self.wo, transmits)
    }

    /// Samples a direction; the one returned is in world space.
    #[inline]
    pub fn sample(&self, scene: &Scene, choice: impl FnOnce() -> f32, u: [f32; 2]) -> Option<Scatter> {
        if !self.faces {
            return None;
        }
        let scatter = self.material(scene).sample(self.wo, choice, u)?;
        let wi = self.frame.to_world(scatter.wi);
        self.same_side(wi, scatter.wi).then_some(Scatter { wi, ..scatter })
    }

    #[inline]
    fn scatter(&self, scene: &Scene, faces: bool, wo: Vec3, wi: Vec3) -> Evaluation {
        let local = self.frame.to_local(wi);
        if !faces || !self.same_side(wi, local) {
            return Evaluation::NONE;
        }
        self.material(scene).evaluate(wo, local)
    }

    /// Light leaks where shading and geometric normal disagree about the side of a direction: such directions carry nothing, on base and offset paths alike.
    #[inline]
    fn same_side(&self, world: Vec3, local: Vec3) -> bool {
        self.normal.dot(world) * local.z > 0.0
    }

    /// A ray that leaves in a world direction.
    #[inline]
    pub fn leave(&self, direction: Vec3) -> Ray {
        spawn(self.position, self.error, self.normal, direction)
    }

    /// The end of a segment, for [`crate::math::segment`].
    #[inline]
    pub fn end(&self) -> (Vec3, f32, Vec3) {
        (self.position, self.error, self.normal)
    }
}
