//! Jacobians against central differences: of each local rule, and of whole chains.
//!
//! The maps run in f32, so a difference over a step h carries rounding of about 10⁻⁷/h. Steps are therefore large, and
//! Richardson's extrapolation removes the leading truncation error that large steps bring.

use super::*;
use crate::geometry::{Hit, ShapeId, SurfacePoint};
use crate::light::LightPoint;
use crate::material::{Bsdf, Dielectric, Material, Microfacets};
use crate::math::{Frame, Vec2, Vec3};
use crate::medium::MediumId;
use crate::path::{Landing, Matter, connect, turn};
use crate::sampling::warp::uniform_sphere;
use crate::shift::{half_vector, reconnect};
use crate::spectrum::Spectrum;
use crate::testing::{Stage, diffuse, glass, metal};
use crate::texture::TexturePoint;
use glam::{DMat2, DMat3, DVec2, DVec3};

/// A sphere of directions around `centre`, one unit of solid angle per unit of area at its origin.
pub(super) struct Chart {
    centre: DVec3,
    axes: [DVec3; 2],
}

impl Chart {
    pub(super) fn new(centre: Vec3) -> Self {
        let frame = Frame::from_normal(centre);
        let centre = centre.as_dvec3().normalize();
        let u = (frame.tangent.as_dvec3() - centre * centre.dot(frame.tangent.as_dvec3())).normalize();
        Self { centre, axes: [u, centre.cross(u)] }
    }

    pub(super) fn direction(&self, at: DVec2) -> DVec3 {
        (self.centre + self.axes[0] * at.x + self.axes[1] * at.y).normalize()
    }

    pub(super) fn coordinates(&self, direction: DVec3) -> DVec2 {
        let d = direction / direction.dot(self.centre);
        DVec2::new(d.dot(self.axes[0]), d.dot(self.axes[1]))
    }
}

/// |det| of the derivative of a map of directions at `centre`, with its own uncertainty: how much it changes as the steps are halved.
/// `None` where the map is not defined all around.
fn determinant(centre: Vec3, map: impl Fn(DVec3) -> Option<DVec3>) -> Option<(f64, f64)> {
    let from = Chart::new(centre);
    let to = Chart::new(map(from.centre)?.as_vec3());
    let slope = |axis: DVec2, h: f64| -> Option<DVec2> {
        let end = |h: f64| Some(to.coordinates(map(from.direction(axis * h))?));
        Some((end(h)? - end(-h)?) / (2.0 * h))
    };
    let extrapolated = |axis: DVec2, h: f64| Some((slope(axis, 0.5 * h)? * 4.0 - slope(axis, h)?) / 3.0);
    let area = |h: f64| Some(DMat2::from_cols(extrapolated(DVec2::X, h)?, extrapolated(DVec2::Y, h)?).determinant().abs());
    let (coarse, fine) = (area(0.02)?, area(0.01)?);
    Some((fine, (fine - coarse).abs()))
}

/// Compares a Jacobian with its numeric value. `None` where the difference quotient is too uncertain to tell: next to total
/// reflection and to grazing angles the derivative changes over the step itself.
fn compare(jacobian: f64, numeric: Option<(f64, f64)>, what: impl Fn() -> String) -> Option<()> {
    let (value, uncertainty) = numeric?;
    if uncertainty > 0.01 * value {
        return None;
    }
    let allowed = 5e-4 * value + 2.0 * uncertainty;
    assert!((jacobian - value).abs() < allowed, "{}: {jacobian} is not {value} ± {uncertainty:e}", what());
    Some(())
}

/// Materials by shape, with nothing near the origin: vertices there are free to be anywhere.
fn samples_of_matter() -> Scene {
    let clear = |eta| {
        Material::from(Bsdf::Dielectric(Dielectric {
            eta,
            reflectance: Spectrum::WHITE,
            transmittance: Spectrum::WHITE,
            facets: Microfacets::ggx(0.3),
            bounced: None,
        }))
    };
    [metal(0.3), clear(1.5), clear(1.33), clear(1.9), diffuse(0.5, 0.5, 0.5), glass(0.0), metal(0.0)]
        .into_iter()
        .enumerate()
        .fold(Stage::default(), |stage, (k, material)| stage.sphere(Vec3::new(1e3 + 10.0 * k as f32, 0.0, 0.0), 1.0, material, 0.0))
        .seen(0.5, 0.0)
}

const METAL: u32 = 0;
const GLASS: u32 = 1;
const WATER: u32 = 2;
const FLINT: u32 = 3;
const DIFFUSE: u32 = 4;
const CLEAR: u32 = 5;
const MIRROR: u32 = 6;

/// Random directions and places.
struct Chance {
    index: u32,
    place: u32,
}

impl Chance {
    fn pair(&mut self) -> [f32; 2] {
        self.place += 1;
        SampleStream::open(SampleKey { seed: 3, frame: self.place, x: self.index, y: 0, index: 0 }).pair(Dimension::direction(9))
    }

    fn direction(&mut self) -> Vec3 {
        uniform_sphere(self.pair())
    }

    /// A vertex of this shape, met from a random side.
    fn vertex(&mut self, scene: &Scene, shape: u32) -> Vertex {
        let normal = self.direction();
        let position = self.direction();
        let surface = SurfacePoint {
            position,
            error: 1e-6,
            normal,
            shading_normal: normal,
            uv: Vec2::ZERO,
            t: 1.0,
            shape: ShapeId(shape),
            hit: Hit::default(),
        };
        let landing = Landing { surface, media: [MediumId::VACUUM; 2], opacity: 1.0 };
        Vertex::on_surface(scene, &landing, self.direction(), 0.001)
    }
}

fn step(vertex: &Vertex, wi: Vec3, delta: bool) -> Step {
    let transmits = vertex.wo.z * vertex.frame.normal.dot(wi) < 0.0;
    Step { wi, evaluation: crate::material::Evaluation::NONE, survival: 1.0, delta, transmits, leg: Leg::CLEAR }
}

/// Half-vector copies between two shapes: as many as wanted, each compared.
fn compare_half_vectors(base_shape: u32, offset_shape: u32, transmits: bool) {
    let scene = samples_of_matter();
    let (mut defined, mut compared) = (0, 0);
    for index in 0..4000 {
        let mut chance = Chance { index, place: base_shape * 64 + offset_shape * 1024 };
        let base = chance.vertex(&scene, base_shape);
        let offset = chance.vertex(&scene, offset_shape);
        let wi = chance.direction();
        let taken = step(&base, wi, false);
        if taken.transmits != transmits || !refracts(&scene, &base, wi) {
            continue;
        }
        let Ok((_, jacobian)) = half_vector(&scene, &base, &taken, &offset) else { continue };
        let numeric = determinant(wi, |w| {
            let (turned, _) = half_vector(&scene, &base, &step(&base, w.as_vec3(), false), &offset).ok()?;
            Some(turned.as_dvec3())
        });
        defined += 1;
        compared += usize::from(compare(jacobian, numeric, || format!("{base_shape} to {offset_shape}, number {index}")).is_some());
    }
    eprintln!("{base_shape} to {offset_shape}, transmits {transmits}: {compared} of {defined} compared");
    assert!(compared > 100 && compared * 10 > defined * 6, "only {compared} of {defined} could be compared");
}

/// Whether a microfacet can send light this way: for a refraction, whether both directions lie on different sides of it.
fn refracts(scene: &Scene, vertex: &Vertex, wi: Vec3) -> bool {
    let wi = vertex.frame.to_local(wi);
    let h = vertex.wo + wi * vertex.relative_ior(scene);
    vertex.wo.z * wi.z > 0.0 || vertex.wo.dot(h) * wi.dot(h) < 0.0
}

#[test]
fn reflections_have_their_determinant() {
    for shape in [METAL, GLASS, DIFFUSE] {
        compare_half_vectors(shape, shape, false);
    }
    compare_half_vectors(METAL, DIFFUSE, false);
}

#[test]
fn refractions_have_their_determinant() {
    compare_half_vectors(GLASS, GLASS, true);
    compare_half_vectors(WATER, WATER, true);
}

#[test]
fn refractions_between_different_indices_have_their_determinant() {
    compare_half_vectors(GLASS, WATER, true);
    compare_half_vectors(GLASS, FLINT, true);
    compare_half_vectors(FLINT, WATER, true);
}

#[test]
fn delta_lobes_copy_the_mirror_direction_without_a_jacobian() {
    let scene = samples_of_matter();
    for (shape, index) in [CLEAR, MIRROR].into_iter().flat_map(|shape| (0..500).map(move |index| (shape, index))) {
        let mut chance = Chance { index, place: 1 << 20 };
        let (base, offset) = (chance.vertex(&scene, shape), chance.vertex(&scene, shape));
        let Some(scatter) = base.sample(&scene, chance.pair()[0], [0.5; 2]) else { continue };
        let taken = step(&base, scatter.wi, true);
        let Ok((turned, jacobian)) = half_vector(&scene, &base, &taken, &offset) else { continue };
        assert_eq!(jacobian, 1.0);
        // The offset path may be drawn too: its direction is one that the delta lobe would choose.
        let own = offset.frame.to_local(turned);
        let tangential = Vec2::new(own.x, own.y);
        let bent = if taken.transmits { offset.relative_ior(&scene) } else { 1.0 };
        assert!((tangential * bent + Vec2::new(offset.wo.x, offset.wo.y)).length() < 1e-5, "{shape}, number {index}");
    }
}

#[test]
fn reconnections_inside_a_medium_have_their_determinant() {
    let scene = samples_of_matter();
    let mut compared = 0;
    for index in 0..1000 {
        let mut chance = Chance { index, place: 1 << 22 };
        let [base, offset, mut target] = [(); 3].map(|()| chance.vertex(&scene, DIFFUSE));
        (target.normal, target.matter) = (Vec3::ZERO, Matter::Medium(MediumId(0)));
        let (from, to) = (base.position.as_dvec3(), offset.position.as_dvec3());
        let edge = target.position.as_dvec3() - from;
        if edge.length() < 0.2 || (target.position - offset.position).length() < 0.2 {
            continue;
        }
        let Some((_, jacobian)) = turn(base.position, offset.position, target.position, target.normal) else { continue };
        // Directions and distances of the base leg are free; the offset leg ends in the same point. Its own three coordinates are
        // direction and distance too: |∂(ω′, t′)/∂(ω, t)|.
        let coordinates = |point: DVec3, from: DVec3, chart: &Chart| {
            let edge = point - from;
            chart.coordinates(edge.normalize()).extend(edge.length())
        };
        let point = edge + from;
        let (here, there) = (Chart::new(edge.normalize().as_vec3()), Chart::new((point - to).normalize().as_vec3()));
        let map = |c: DVec3| {
            let moved = from + here.direction(c.truncate()) * (edge.length() + c.z);
            coordinates(moved, to, &there)
        };
        let h = 1e-4;
        let column = |axis: DVec3| (map(axis * h) - map(axis * -h)) / (2.0 * h);
        let determinant = DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z)).determinant().abs();
        assert!((jacobian / determinant - 1.0).abs() < 1e-3, "number {index}: {jacobian} is not {determinant}");
        compared += 1;
    }
    assert!(compared > 500);
}

#[test]
fn reconnections_have_their_determinant() {
    let scene = samples_of_matter();
    let mut compared = 0;
    for index in 0..3000 {
        let mut chance = Chance { index, place: 1 << 21 };
        let [base, offset, target] = [(); 3].map(|()| chance.vertex(&scene, DIFFUSE));
        let apart = |v: &Vertex| (target.position - v.position).dot(target.normal).abs();
        if apart(&base) < 0.2 || apart(&offset) < 0.2 {
            continue;
        }
        let wi = (target.position - base.position).normalize();
        // Where a direction from the base vertex meets the tangent plane of the target.
        let met = |w: DVec3| {
            let normal = target.normal.as_dvec3();
            let from = base.position.as_dvec3();
            from + w * ((target.position.as_dvec3() - from).dot(normal) / w.dot(normal))
        };
        let (_, jacobian, _) = reconnect(&scene, &base, &offset, &target).unwrap();
        let numeric = determinant(wi, |w| {
            let mut target = target;
            target.position = met(w).as_vec3();
            Some(reconnect(&scene, &base, &offset, &target).ok()?.0.as_dvec3())
        });
        compared += usize::from(compare(jacobian, numeric, || format!("number {index}")).is_some());
        // A light point is joined by the same rule.
        let point = LightPoint {
            light: 0,
            position: target.position,
            error: 1e-6,
            normal: target.normal,
            at: TexturePoint::default(),
            infinite: false,
            delta: false,
        };
        assert_eq!(connect(&base, &offset, &point).unwrap().1, jacobian);
    }
    assert!(compared > 300, "only {compared} could be compared");
}

#[test]
fn light_at_infinity_keeps_its_direction() {
    let scene = samples_of_matter();
    let mut chance = Chance { index: 0, place: 1 << 22 };
    let (base, offset) = (chance.vertex(&scene, DIFFUSE), chance.vertex(&scene, DIFFUSE));
    let point = LightPoint {
        light: 0,
        position: chance.direction(),
        error: 0.0,
        normal: Vec3::ZERO,
        at: TexturePoint::default(),
        infinite: true,
        delta: false,
    };
    assert_eq!(connect(&base, &offset, &point), Some((point.position, 1.0)));
}
