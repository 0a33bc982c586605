//! Unidirectional path tracing with next-event estimation.
//!
//! # Source
//! Kajiya, "The Rendering Equation", SIGGRAPH 1986; multiple importance sampling by Veach and Guibas, SIGGRAPH 1995, balance heuristic.

use crate::light::LightPoint;
use crate::math::Ray;
use crate::path::{Arrival, FirstSurface, Integrator, Joint, Leg, Passage, Step, Strategy, Subpath, Vertex, passage_to_light, seen, walk};
use crate::sampling::{Dimension, SampleStream};
use crate::scene::Scene;
use crate::spectrum::Spectrum;

/// The path integrator.
#[derive(Clone, Copy, Debug)]
pub struct PathIntegrator {
    /// Longest path in edges.
    pub max_depth: u32,
    /// Edges after which Russian roulette starts.
    pub roulette_depth: u32,
    /// Roughness at and above which a vertex is connectable.
    pub shift_threshold: f32,
}

/// Roulette never lets more than this through, so that closed white rooms end.
const MOST_SURVIVAL: f32 = 0.95;

impl Integrator for PathIntegrator {
    fn generate(&self, scene: &Scene, camera: &Ray, stream: &SampleStream, out: &mut Subpath) {
        out.clear();
        out.rays = 1;
        out.stream = *stream;
        let (leg, arrival) = walk(scene, camera, scene.around, |i| stream.number(Dimension::leg(0, i)));
        out.camera = leg;
        out.direct = if scene.is_clear() { emitted(scene, &arrival, camera) } else { seen(scene, camera, scene.around) };
        let Some(vertex) = Vertex::arrived(scene, &arrival, camera.direction, self.shift_threshold) else { return };
        out.first = Some(FirstSurface {
            albedo: vertex.albedo(scene),
            normal: if vertex.wo.z < 0.0 { -vertex.frame.normal } else { vertex.frame.normal },
            depth: match &arrival {
                Arrival::Surface(landing) => landing.surface.t,
                Arrival::Medium(collision) => collision.distance,
                Arrival::Escaped => 0.0,
            },
        });
        if self.max_depth > 1 {
            out.vertices.push(vertex);
        }
        let mut throughput = leg.passage.weight();
        // A joint at vertex k has k + 2 edges.
        for k in 0..self.max_depth.saturating_sub(1) as usize {
            let vertex = &mut out.vertices[k];
            let choice = vertex.decide(scene, || stream.number(Dimension::lobe(k)));
            if !vertex.delta
                && let Some(joint) = next_event(scene, vertex, k, stream)
            {
                out.rays += u32::from(!joint.evaluation.is_none());
                out.joints.push(joint);
            }
            let Some(scatter) = vertex.sample(scene, choice, stream.pair(Dimension::direction(k))) else {
                break;
            };
            let mut step = Step {
                wi: scatter.wi,
                evaluation: scatter.evaluation,
                survival: 1.0,
                delta: scatter.delta,
                transmits: vertex.wo.z * vertex.frame.normal.dot(scatter.wi) < 0.0,
                leg: Leg::CLEAR,
            };
            if k as u32 + 2 > self.roulette_depth {
                step.survival = (throughput * step.weight()).max().min(MOST_SURVIVAL);
                if stream.number(Dimension::roulette(k)) >= step.survival {
                    break;
                }
            }
            let (leg, arrival) =
                walk(scene, &vertex.leave(step.wi), vertex.medium_towards(step.wi), |i| stream.number(Dimension::leg(k + 1, i)));
            step.leg = leg;
            throughput *= step.weight();
            out.steps.push(step);
            out.rays += 1;
            let point = match &arrival {
                Arrival::Surface(landing) => scene.light_point(&landing.surface),
                Arrival::Medium(_) => None,
                Arrival::Escaped => scene.lights.at_infinity(step.wi),
            };
            if let Some(point) = point {
                let joint = hit(scene, vertex, k, &step, point);
                if !joint.radiance.is_black() {
                    out.joints.push(joint);
                }
            }
            let Some(next) = Vertex::arrived(scene, &arrival, step.wi, self.shift_threshold) else { break };
            out.vertices.push(next);
            if k as u32 + 2 == self.max_depth {
                // Beyond the last edge nothing is gathered, but shifts must know what the last step met.
                out.vertices[k + 1].decide(scene, || stream.number(Dimension::lobe(k + 1)));
            }
        }
        out.gather();
    }
}

/// A light point seen from a vertex. Blocked ones are kept too: they may be visible from the offset path.
#[inline]
fn next_event(scene: &Scene, vertex: &Vertex, k: usize, stream: &SampleStream) -> Option<Joint> {
    let sample =
        scene.lights.sample(vertex.position, || stream.number(Dimension::light_choice(k)), stream.pair(Dimension::light_point(k)))?;
    let point = sample.point;
    let wi = if point.infinite { point.position } else { (point.position - vertex.position).normalize() };
    let evaluation = vertex.evaluate(scene, wi);
    let radiance = scene.lights.radiance(&point, vertex.position);
    let passage = if evaluation.is_none() { Passage::BLOCKED } else { passage_to_light(scene, vertex, &point) };
    Some(Joint {
        vertex: k as u32,
        strategy: Strategy::NextEvent,
        wi,
        point,
        radiance,
        evaluation,
        light_density: sample.density * vertex.lobe_probability,
        passage,
        survival: 1.0,
    })
}

/// What the camera's ray meets that gives light.
#[inline]
fn emitted(scene: &Scene, arrival: &Arrival, camera: &Ray) -> Spectrum {
    let point = match arrival {
        Arrival::Surface(landing) => scene.light_point(&landing.surface),
        Arrival::Medium(_) => None,
        Arrival::Escaped => scene.lights.at_infinity(camera.direction),
    };
    point.map_or(Spectrum::BLACK, |point| scene.lights.radiance(&point, camera.origin))
}

/// The joint of a step that met a light.
#[inline]
fn hit(scene: &Scene, vertex: &Vertex, k: usize, step: &Step, point: LightPoint) -> Joint {
    Joint {
        vertex: k as u32,
        strategy: Strategy::Hit,
        wi: step.wi,
        point,
        radiance: scene.lights.radiance(&point, vertex.position),
        evaluation: step.evaluation,
        light_density: if step.delta { 0.0 } else { scene.lights.density(vertex.position, &point) * vertex.lobe_probability },
        passage: step.leg.passage,
        survival: step.survival,
    }
}
