//! A vertex of a path, on a surface or inside a medium: where it lies, how it is oriented, and what it can do.

use super::leg::{Arrival, Collision, Landing};
use crate::material::{Evaluation, Material, Scatter, Surface};
use crate::math::{Frame, Ray, Vec3, spawn};
use crate::medium::{Medium, MediumId};
use crate::scene::Scene;
use crate::spectrum::Spectrum;
use crate::texture::TexturePoint;

/// What light meets at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Matter {
    /// A surface, by the index of its material.
    Surface(u32),
    /// A medium.
    Medium(MediumId),
}

/// A path vertex.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// World position.
    pub position: Vec3,
    /// Bound on the rounding error of `position` [scene units].
    pub error: f32,
    /// Unit geometric normal; zero inside a medium.
    pub normal: Vec3,
    /// Shading frame; inside a medium its normal is the direction to the previous vertex.
    pub frame: Frame,
    /// Unit direction to the previous vertex, in the shading frame.
    pub wo: Vec3,
    /// Where textures are looked up.
    pub at: TexturePoint,
    /// What light meets here.
    pub matter: Matter,
    /// The media before and behind it.
    pub media: [MediumId; 2],
    /// How much of the surface is there, in (0, 1]; 1 inside a medium.
    pub opacity: f32,
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
    /// The vertex where a leg of this unit direction met a surface.
    #[inline(always)]
    pub fn on_surface(scene: &Scene, landing: &Landing, direction: Vec3, threshold: f32) -> Self {
        let surface = &landing.surface;
        let material = scene.shape(surface.shape).material;
        let surface_material = &scene.materials[material as usize];
        let at = if surface_material.is_textured() { scene.texture_point(surface) } else { TexturePoint::default() };
        let frame = if surface_material.bends() {
            let (du, dv) = scene.world.partials(surface);
            let from_front = surface.normal.dot(direction) < 0.0;
            Frame::from_tangent(surface_material.bent(&at, &Surface { normal: surface.shading_normal, du, dv }, from_front), du)
        } else if surface_material.needs_tangents() {
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
            matter: Matter::Surface(material),
            media: landing.media,
            opacity: landing.opacity,
            delta: false,
            connectable: rough,
            lobe_probability: 1.0,
            rough,
            faces: -surface.normal.dot(direction) * wo.z > 0.0,
        }
    }

    /// The vertex where a leg of this unit direction ended inside a medium.
    #[inline]
    pub fn in_medium(scene: &Scene, collision: &Collision, direction: Vec3) -> Self {
        let rough = scene.medium(collision.medium).is_some_and(|medium| !medium.phase().is_sharp());
        Self {
            position: collision.position,
            error: (collision.position.abs().max_element() + collision.distance) * (4.0 * f32::EPSILON),
            normal: Vec3::ZERO,
            frame: Frame::from_normal(-direction),
            wo: Vec3::Z,
            at: TexturePoint::default(),
            matter: Matter::Medium(collision.medium),
            media: [collision.medium; 2],
            opacity: 1.0,
            delta: false,
            connectable: rough,
            lobe_probability: 1.0,
            rough,
            faces: true,
        }
    }

    /// Its material, on a surface.
    #[inline]
    pub fn material<'s>(&self, scene: &'s Scene) -> Option<&'s Material> {
        match self.matter {
            Matter::Surface(material) => Some(&scene.materials[material as usize]),
            Matter::Medium(_) => None,
        }
    }

    /// The medium that it lies in, if it is not on a surface.
    #[inline]
    pub fn medium(&self) -> Option<MediumId> {
        match self.matter {
            Matter::Surface(_) => None,
            Matter::Medium(medium) => Some(medium),
        }
    }

    /// The medium on the side that a world direction leaves to.
    #[inline]
    pub fn medium_towards(&self, direction: Vec3) -> MediumId {
        self.media[usize::from(self.normal.dot(direction) < 0.0)]
    }

    /// Reflectance, or albedo of the medium, for the feature of that name [1].
    pub fn albedo(&self, scene: &Scene) -> Spectrum {
        match self.matter {
            Matter::Surface(material) => scene.materials[material as usize].albedo(&self.at),
            Matter::Medium(medium) => scene.medium(medium).map_or(Spectrum::BLACK, Medium::albedo),
        }
    }

    /// Relative index of refraction, transmitted over incident side, for light seen from `wo`; 1 where nothing is bent.
    #[inline]
    pub fn relative_ior(&self, scene: &Scene) -> f32 {
        self.material(scene).map_or(1.0, |material| material.relative_ior(&self.at, self.wo))
    }

    /// Decides by a number, drawn only where it matters, whether light takes a delta lobe, and gives the number back for
    /// [`sample`](Self::sample).
    #[inline]
    pub fn decide(&mut self, scene: &Scene, choice: impl FnOnce() -> f32) -> f32 {
        let Some(material) = self.material(scene) else { return 0.0 };
        let choice = if material.has_choice() { choice() } else { 0.0 };
        let probability = material.delta_probability(&self.at, self.wo);
        self.decided(choice < probability, probability);
        choice
    }

    /// Decides as another path did. `false` where that cannot happen here.
    #[inline]
    pub fn decide_as(&mut self, scene: &Scene, delta: bool) -> bool {
        self.decided(delta, self.material(scene).map_or(0.0, |material| material.delta_probability(&self.at, self.wo)));
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
        if self.medium().is_some() {
            return Vertex { frame: Frame::from_normal(world), ..*self };
        }
        let wo = self.frame.to_local(world);
        let mut vertex = Vertex { wo, faces: self.same_side(world, wo), ..*self };
        vertex.decide_as(scene, self.delta);
        vertex
    }

    /// Value and density of leaving in the world direction `wi`.
    #[inline]
    pub fn evaluate(&self, scene: &Scene, wi: Vec3) -> Evaluation {
        match self.matter {
            Matter::Surface(material) => {
                let local = self.frame.to_local(wi);
                if !self.faces || !self.same_side(wi, local) {
                    return Evaluation::NONE;
                }
                scene.materials[material as usize].evaluate(&self.at, self.wo, local)
            }
            Matter::Medium(medium) => self.scatter(scene, medium, wi),
        }
    }

    /// Value and probability of the delta lobe that leads in the world direction `wi`.
    #[inline]
    pub fn evaluate_delta(&self, scene: &Scene, transmits: bool, wi: Vec3) -> Evaluation {
        if !self.faces || !self.same_side(wi, self.frame.to_local(wi)) {
            return Evaluation::NONE;
        }
        self.material(scene).map_or(Evaluation::NONE, |material| material.evaluate_delta(&self.at, self.wo, transmits))
    }

    /// Samples a direction by the number that [`decide`](Self::decide) gave and by two more; the one returned is in world space.
    #[inline]
    pub fn sample(&self, scene: &Scene, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        if !self.faces {
            return None;
        }
        let Matter::Surface(material) = self.matter else {
            let medium = scene.medium(self.media[0])?;
            let wi = medium.phase().sample(self.frame.normal, u);
            return Some(Scatter { wi, evaluation: self.evaluate(scene, wi), delta: false });
        };
        let scatter = scene.materials[material as usize].sample(&self.at, self.wo, choice, u)?;
        let wi = self.frame.to_world(scatter.wi);
        self.same_side(wi, scatter.wi).then_some(Scatter { wi, ..scatter })
    }

    /// Scattering inside a medium: the phase function is its own density.
    fn scatter(&self, scene: &Scene, medium: MediumId, wi: Vec3) -> Evaluation {
        scene.medium(medium).map_or(Evaluation::NONE, |medium| {
            let density = medium.phase().evaluate(self.frame.normal, wi);
            Evaluation { value: Spectrum::grey(density), density }
        })
    }

    /// Light leaks where shading and geometric normal disagree about the side of a direction: such directions carry nothing, on base and offset paths alike.
    #[inline]
    fn same_side(&self, world: Vec3, local: Vec3) -> bool {
        self.normal.dot(world) * local.z > 0.0
    }

    /// The vertex where a leg ended; `None` where it met nothing.
    #[inline(always)]
    pub fn arrived(scene: &Scene, arrival: &Arrival, direction: Vec3, threshold: f32) -> Option<Self> {
        match arrival {
            Arrival::Surface(landing) => Some(Self::on_surface(scene, landing, direction, threshold)),
            Arrival::Medium(collision) => Some(Self::in_medium(scene, collision, direction)),
            Arrival::Escaped => None,
        }
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
