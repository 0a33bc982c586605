//! A vertex of a path: where it lies, how it is oriented, and what it can do.

use crate::geometry::SurfacePoint;
use crate::material::{Evaluation, Material, Scatter};
use crate::math::{Frame, Ray, Vec3, spawn};
use crate::scene::Scene;
use crate::texture::TexturePoint;

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
    /// Where textures are looked up.
    pub at: TexturePoint,
    /// Index of the material.
    pub material: u32,
    /// Whether light takes a delta lobe here. Decided once for a path: the two kinds of lobe make two kinds of path.
    pub delta: bool,
    /// Whether a shift may reconnect here: light takes no delta lobe, and the sharpest other is no sharper than the plan's threshold.
    pub connectable: bool,
    /// Probability with which `delta` was decided as it is, in (0, 1].
    pub lobe_probability: f32,
    /// Whether the sharpest lobe that is no delta is no sharper than the plan's threshold.
    rough: bool,
    /// Whether shading and geometric normal agree about the side that `wo` points to; else nothing is scattered.
    faces: bool,
}

impl Vertex {
    /// The vertex where a ray of this unit direction met a surface.
    #[inline]
    pub fn new(scene: &Scene, surface: &SurfacePoint, direction: Vec3, threshold: f32) -> Self {
        let material = scene.shape(surface.shape).material;
        let surface_material = &scene.materials[material as usize];
        let at = if surface_material.is_textured() { scene.texture_point(surface) } else { TexturePoint::default() };
        let frame = if surface_material.needs_tangents() {
            Frame::from_tangent(surface.shading_normal, scene.world.tangent(surface))
        } else {
            Frame::from_normal(surface.shading_normal)
        };
        let wo = frame.to_local(-direction);
        let roughness = surface_material.roughness(&at);
        let rough = roughness > 0.0 && roughness >= threshold;
        Self {
            position: surface.position,
            error: surface.error,
            normal: surface.normal,
            frame,
            wo,
            at,
            material,
            delta: false,
            connectable: rough,
            lobe_probability: 1.0,
            rough,
            faces: -surface.normal.dot(direction) * wo.z > 0.0,
        }
    }

    /// Its material.
    #[inline]
    pub fn material<'s>(&self, scene: &'s Scene) -> &'s Material {
        &scene.materials[self.material as usize]
    }

    /// Decides by a number, drawn only where it matters, whether light takes a delta lobe, and gives the number back for
    /// [`sample`](Self::sample).
    #[inline]
    pub fn decide(&mut self, scene: &Scene, choice: impl FnOnce() -> f32) -> f32 {
        let material = self.material(scene);
        let choice = if material.has_choice() { choice() } else { 0.0 };
        let probability = material.delta_probability(&self.at, self.wo);
        self.decided(choice < probability, probability);
        choice
    }

    /// Decides as another path did. `false` where that cannot happen here.
    #[inline]
    pub fn decide_as(&mut self, scene: &Scene, delta: bool) -> bool {
        self.decided(delta, self.material(scene).delta_probability(&self.at, self.wo));
        self.lobe_probability > 0.0
    }

    #[inline]
    fn decided(&mut self, delta: bool, probability: f32) {
        self.delta = delta;
        self.connectable = self.rough && !delta;
        self.lobe_probability = if delta { probability } else { 1.0 - probability };
    }

    /// The same vertex on a path that came from another point, its kind of lobe decided as here.
    #[inline]
    pub fn seen_from(&self, scene: &Scene, predecessor: Vec3) -> Vertex {
        let world = (predecessor - self.position).normalize_or_zero();
        let wo = self.frame.to_local(world);
        let mut vertex = Vertex { wo, faces: self.same_side(world, wo), ..*self };
        vertex.decide_as(scene, self.delta);
        vertex
    }

    /// Value and density of leaving in the world direction `wi`.
    #[inline]
    pub fn evaluate(&self, scene: &Scene, wi: Vec3) -> Evaluation {
        let local = self.frame.to_local(wi);
        if !self.faces || !self.same_side(wi, local) {
            return Evaluation::NONE;
        }
        self.material(scene).evaluate(&self.at, self.wo, local)
    }

    /// Value and probability of the delta lobe that leads in the world direction `wi`.
    #[inline]
    pub fn evaluate_delta(&self, scene: &Scene, transmits: bool, wi: Vec3) -> Evaluation {
        if !self.faces || !self.same_side(wi, self.frame.to_local(wi)) {
            return Evaluation::NONE;
        }
        self.material(scene).evaluate_delta(&self.at, self.wo, transmits)
    }

    /// Samples a direction by the number that [`decide`](Self::decide) gave and by two more; the one returned is in world space.
    #[inline]
    pub fn sample(&self, scene: &Scene, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        if !self.faces {
            return None;
        }
        let scatter = self.material(scene).sample(&self.at, self.wo, choice, u)?;
        let wi = self.frame.to_world(scatter.wi);
        self.same_side(wi, scatter.wi).then_some(Scatter { wi, ..scatter })
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
