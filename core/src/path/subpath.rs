//! The cached base path.

use super::leg::{Leg, Passage};
use super::vertex::Vertex;
use crate::light::LightPoint;
use crate::material::Evaluation;
use crate::math::Vec3;
use crate::sampling::SampleStream;
use crate::spectrum::Spectrum;

/// How the walk went on from a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Unit world direction.
    pub wi: Vec3,
    /// Its value and density; of the delta lobe where `delta`.
    pub evaluation: Evaluation,
    /// Probability with which Russian roulette let the walk go on, in (0, 1].
    pub survival: f32,
    /// Whether a delta lobe was chosen.
    pub delta: bool,
    /// Whether the direction crosses the surface.
    pub transmits: bool,
    /// The leg that it leads along.
    pub leg: Leg,
}

impl Step {
    /// f · |cosθ| / p, roulette and the leg included: the factor on the throughput.
    #[inline]
    pub fn weight(&self) -> Spectrum {
        self.evaluation.value * self.leg.passage.value / (self.evaluation.density * self.leg.passage.density * self.survival)
    }
}

/// The strategy that found a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// The sampled direction met the light.
    Hit,
    /// The light point was sampled.
    NextEvent,
}

/// One way in which the camera subpath reaches a light: from a vertex straight to a light point.
///
/// Both strategies can find it, so it carries both densities; with the balance heuristic its contribution is
/// throughput · value / (light density + direction density), whichever strategy found it.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// Index of the vertex.
    pub vertex: u32,
    /// Who found it.
    pub strategy: Strategy,
    /// Unit world direction from the vertex to the light point.
    pub wi: Vec3,
    /// The light point.
    pub point: LightPoint,
    /// Radiance from the light point to the vertex.
    pub radiance: Spectrum,
    /// The vertex's scattering towards the light point.
    pub evaluation: Evaluation,
    /// Density of sampling the light point [sr⁻¹ at the vertex; 1 for lights without extent], the decision against delta lobes
    /// included; 0 where next-event estimation cannot.
    pub light_density: f32,
    /// What lies between.
    pub passage: Passage,
    /// Probability with which Russian roulette let the walk reach it, in (0, 1].
    pub survival: f32,
}

impl Joint {
    /// Scattering times radiance times what gets through: the measurement without the throughput up to the vertex.
    #[inline]
    pub fn value(&self) -> Spectrum {
        self.evaluation.value * self.radiance * self.passage.value
    }

    /// Sum of the densities with which either strategy finds this joint [sr⁻¹]; walking finds neither what it
    /// cannot see nor a light without extent.
    #[inline]
    pub fn density(&self) -> f32 {
        self.light_density + if self.point.delta { 0.0 } else { self.evaluation.density * self.passage.density }
    }

    /// The joint's contribution for unit throughput, MIS weight included.
    #[inline]
    pub fn contribution(&self) -> Spectrum {
        self.value() / (self.density() * self.survival)
    }
}

/// What stands at the end of the camera's leg.
#[derive(Clone, Copy, Debug)]
pub struct FirstSurface {
    /// Reflectance [1].
    pub albedo: Spectrum,
    /// Unit shading normal, turned to the camera; the direction to the camera inside a medium.
    pub normal: Vec3,
    /// Distance along the ray.
    pub depth: f32,
}

/// A camera subpath with everything that shifting it needs. Scratch: cleared and refilled for each sample, never freed.
#[derive(Clone, Debug)]
pub struct Subpath {
    /// Emission and environment that the camera sees directly.
    pub direct: Spectrum,
    /// The leg from the camera.
    pub camera: Leg,
    /// What stands at its end, if it ends on a surface or inside a medium.
    pub first: Option<FirstSurface>,
    /// Vertices, the first one at the end of the camera's leg.
    pub vertices: Vec<Vertex>,
    /// Step k leads from vertex k to vertex k + 1, or out of the scene where that does not exist.
    pub steps: Vec<Step>,
    /// Joints, by vertex.
    pub joints: Vec<Joint>,
    /// Estimate of the radiance that leaves vertex k towards the vertex before it, from all joints at k and beyond.
    pub radiance: Vec<Spectrum>,
    /// Rays traced for it.
    pub rays: u32,
    /// The numbers that it was drawn with; shifts may replay them.
    pub stream: SampleStream,
}

impl Default for Subpath {
    fn default() -> Self {
        Self {
            direct: Spectrum::BLACK,
            camera: Leg::CLEAR,
            first: None,
            vertices: Vec::new(),
            steps: Vec::new(),
            joints: Vec::new(),
            radiance: Vec::new(),
            rays: 0,
            stream: SampleStream::default(),
        }
    }
}

impl Subpath {
    /// Empties it.
    pub fn clear(&mut self) {
        self.direct = Spectrum::BLACK;
        self.camera = Leg::CLEAR;
        self.first = None;
        self.vertices.clear();
        self.steps.clear();
        self.joints.clear();
        self.radiance.clear();
        self.rays = 0;
    }

    /// Adds the joints up, from the last vertex to the first. Gradients need the partial sums, so the primal is summed in this order too.
    pub fn gather(&mut self) {
        self.radiance.resize(self.vertices.len(), Spectrum::BLACK);
        let mut joints = self.joints.iter().rev().peekable();
        let mut beyond = Spectrum::BLACK;
        for k in (0..self.vertices.len()).rev() {
            let mut sum = match self.steps.get(k) {
                Some(step) if k + 1 < self.vertices.len() => step.weight() * beyond,
                _ => Spectrum::BLACK,
            };
            while let Some(joint) = joints.next_if(|j| j.vertex as usize == k) {
                sum += joint.contribution();
            }
            self.radiance[k] = sum;
            beyond = sum;
        }
    }

    /// The primal estimate of this sample, without what is directly visible.
    #[inline]
    pub fn primal(&self) -> Spectrum {
        self.radiance.first().map_or(Spectrum::BLACK, |radiance| *radiance * self.camera.passage.weight())
    }
}
