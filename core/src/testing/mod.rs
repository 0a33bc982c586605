//! Small scenes built in code, for the tests of transport.

pub(crate) mod films;

use crate::geometry::{Analytic, Cylinder, Disk, Mesh, ShapeId, Sphere, WorldBuilder};
use crate::lattice::Extent;
use crate::light::{AreaLight, DirectionalLight, Emitter, Environment, Falloff, ImageEnvironment, Light, Lights, PointLight, SpotLight};
use crate::material::{Bsdf, Conductor, Dielectric, Diffuse, Material, Microfacets};
use crate::math::{Frame, Transform, Vec2, Vec3};
use crate::medium::{Homogeneous, Medium, MediumId, Phase};
use crate::plan::{Plan, ReconstructionKind, ShiftKind, Stop, Technique};
use crate::scene::{Boundary, Scene, Shape};
use crate::sensor::{FieldAxis, Perspective, PixelFilter, Projection, Sensor, Window};
use crate::spectrum::Spectrum;
use crate::texture::{Checkerboard, ColourInput, ScalarInput, Texture};
use std::sync::Arc;

/// Gathers a scene shape by shape.
#[derive(Default)]
pub(crate) struct Stage {
    world: WorldBuilder,
    shapes: Vec<Shape>,
    materials: Vec<Material>,
    lights: Vec<Light>,
    boundaries: Vec<Boundary>,
    media: Vec<Medium>,
    around: Option<MediumId>,
    /// The boundary of the next shape.
    boundary: Option<u32>,
}

impl Stage {
    fn shape(&mut self, material: Material, emitter: Option<(Emitter, f32)>) -> ShapeId {
        let light = emitter.map(|(emitter, radiance)| {
            self.lights.push(Light::Area(AreaLight { radiance: Spectrum::grey(radiance).into(), two_sided: false, emitter }));
            self.lights.len() as u32 - 1
        });
        self.materials.push(material);
        self.shapes.push(Shape { material: self.materials.len() as u32 - 1, light, boundary: self.boundary.take() });
        ShapeId(self.shapes.len() as u32 - 1)
    }

    /// A parallelogram; its front is the side of `a × b`.
    pub(crate) fn quad(mut self, corner: Vec3, a: Vec3, b: Vec3, material: Material, radiance: f32) -> Self {
        let mesh = Mesh {
            positions: vec![corner, corner + a, corner + a + b, corner + b],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let emitter = (radiance > 0.0).then(|| (Emitter::from_mesh(&mesh, false).unwrap(), radiance));
        let id = self.shape(material, emitter);
        self.world.meshes.push((mesh, id));
        self
    }

    /// A parallelogram that glows on both sides, in two radiances by fields of a checkerboard.
    pub(crate) fn screen(mut self, corner: Vec3, a: Vec3, b: Vec3, radiance: [f32; 2]) -> Self {
        let mesh = Mesh {
            positions: vec![corner, corner + a, corner + a + b, corner + b],
            uvs: [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(Vec2::from).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let [even, odd] = radiance.map(|radiance| Spectrum::grey(radiance).into());
        let fields = Texture::Checkerboard(Checkerboard { even, odd, uv: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] });
        let emitter = Emitter::from_mesh(&mesh, true).unwrap();
        let id = self.shape(diffuse(0.0, 0.0, 0.0), None);
        self.shapes[id.0 as usize].light = Some(self.lights.len() as u32);
        self.lights.push(Light::Area(AreaLight { radiance: ColourInput::Texture(Arc::new(fields)), two_sided: true, emitter }));
        self.world.meshes.push((mesh, id));
        self
    }

    pub(crate) fn sphere(self, centre: Vec3, radius: f32, material: Material, radiance: f32) -> Self {
        self.analytic(Sphere { centre, radius }.into(), material, radiance)
    }

    pub(crate) fn analytic(mut self, surface: Analytic, material: Material, radiance: f32) -> Self {
        let id = self.shape(material, (radiance > 0.0).then_some((Emitter::Analytic(surface), radiance)));
        self.world.analytic.push((surface, id));
        self
    }

    /// The next shape lets this share of light pass, and bounds these media.
    pub(crate) fn bounded(mut self, opacity: f32, media: Option<[MediumId; 2]>) -> Self {
        self.boundaries.push(Boundary { opacity: ScalarInput::Constant(opacity), media });
        self.boundary = Some(self.boundaries.len() as u32 - 1);
        self
    }

    /// Adds a medium, the k-th having the id k.
    pub(crate) fn medium(mut self, extinction: Spectrum, albedo: f32, mean_cosine: f32) -> Self {
        let medium = Homogeneous { extinction, albedo: Spectrum::grey(albedo), phase: Phase { mean_cosine } };
        self.media.push(Medium::Homogeneous(medium));
        self
    }

    /// The last medium fills the space around the camera.
    pub(crate) fn around(mut self) -> Self {
        self.around = Some(MediumId(self.media.len() as u32 - 1));
        self
    }

    /// A light without a surface.
    pub(crate) fn light(mut self, light: Light) -> Self {
        self.lights.push(light);
        self
    }

    pub(crate) fn environment(mut self, radiance: f32) -> Self {
        self.lights.push(Light::Environment(Environment { radiance: Spectrum::grey(radiance) }));
        self
    }

    /// Seen from the origin along +z with a field of view of 2·atan(half).
    pub(crate) fn seen(self, half_tangent: f32, lens_radius: f32) -> Scene {
        let perspective = Perspective { half_tangent, axis: FieldAxis::X, principal_point: [0.0; 2], lens_radius, focus_distance: 3.0 };
        self.through(Projection::Perspective(perspective), PixelFilter::Box)
    }

    /// Seen from the origin along +z.
    pub(crate) fn through(self, projection: Projection, filter: PixelFilter) -> Scene {
        let world = self.world.build();
        let radius = world.bounds().radius();
        Scene {
            world,
            shapes: self.shapes,
            materials: self.materials,
            boundaries: self.boundaries,
            media: self.media,
            around: self.around.unwrap_or(MediumId::VACUUM),
            // A tree for fewer lights than usual, so that small scenes have one.
            lights: Lights::choosing(self.lights, radius, 6),
            sensor: Sensor { to_world: Transform::IDENTITY, projection, window: Window::WHOLE, filter },
        }
    }
}

pub(crate) fn diffuse(r: f32, g: f32, b: f32) -> Material {
    Bsdf::Diffuse(Diffuse { reflectance: Spectrum::rgb(r, g, b), two_sided: true }).into()
}

pub(crate) fn metal(alpha: f32) -> Material {
    let (eta, k) = (Spectrum::rgb(0.2, 0.9, 1.1), Spectrum::rgb(3.9, 2.4, 2.1));
    Bsdf::Conductor(Conductor { eta, k, reflectance: Spectrum::WHITE, facets: Microfacets::ggx(alpha), bounced: None, two_sided: true })
        .into()
}

pub(crate) fn glass(alpha: f32) -> Material {
    Bsdf::Dielectric(Dielectric {
        eta: 1.5,
        reflectance: Spectrum::WHITE,
        transmittance: Spectrum::WHITE,
        facets: Microfacets::ggx(alpha),
        bounced: None,
    })
    .into()
}

/// A closed box of coloured walls from z = 1 to 5, a lamp under the ceiling, and room for objects.
pub(crate) fn room() -> Stage {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let p = Vec3::new;
    Stage::default()
        .quad(p(-1.0, -1.0, -1.0), x * 2.0, z * 6.0, diffuse(0.6, 0.6, 0.5), 0.0)
        .quad(p(-1.0, 1.0, -1.0), z * 6.0, x * 2.0, diffuse(0.7, 0.7, 0.7), 0.0)
        .quad(p(-1.0, -1.0, 5.0), y * 2.0, x * 2.0, diffuse(0.4, 0.5, 0.7), 0.0)
        .quad(p(-1.0, -1.0, -1.0), z * 6.0, y * 2.0, diffuse(0.7, 0.2, 0.1), 0.0)
        .quad(p(1.0, -1.0, -1.0), y * 2.0, z * 6.0, diffuse(0.2, 0.6, 0.2), 0.0)
        .quad(p(-1.0, -1.0, -1.0), x * 2.0, y * 2.0, diffuse(0.5, 0.5, 0.5), 0.0)
        .quad(p(-0.4, 0.95, 2.6), x * 0.8, z * 0.8, diffuse(0.0, 0.0, 0.0), 8.0)
}

/// A sky that is brighter on one side, over a dark ground.
fn sky() -> ImageEnvironment {
    let texels =
        (0..32).map(|k| if k < 16 { Spectrum::rgb(0.5, 0.7, 1.0) * (1.0 + 0.1 * (k % 8) as f32) } else { Spectrum::grey(0.3) }).collect();
    let axes = Frame { tangent: Vec3::X, bitangent: Vec3::Y, normal: Vec3::Z };
    ImageEnvironment::new(8, 4, texels, axes).unwrap()
}

/// The scenes that every technique and shift must render right, by name.
pub(crate) fn scenes() -> Vec<(&'static str, Scene)> {
    let p = Vec3::new;
    vec![
        ("diffuse", room().sphere(p(-0.3, -0.5, 3.2), 0.5, diffuse(0.8, 0.6, 0.3), 0.0).seen(0.35, 0.0)),
        ("mirror", room().sphere(p(-0.2, -0.4, 3.2), 0.6, metal(0.0), 0.0).seen(0.3, 0.0)),
        ("glass", room().sphere(p(0.1, -0.3, 3.0), 0.6, glass(0.0), 0.0).seen(0.3, 0.0)),
        ("rough", room().sphere(p(-0.4, -0.5, 3.4), 0.5, metal(0.15), 0.0).sphere(p(0.4, -0.5, 3.0), 0.5, glass(0.2), 0.0).seen(0.35, 0.0)),
        ("lens", room().sphere(p(0.0, -0.5, 2.4), 0.5, diffuse(0.8, 0.3, 0.3), 0.0).seen(0.35, 0.08)),
        (
            "open",
            Stage::default()
                .quad(p(-3.0, -1.0, 0.0), Vec3::X * 6.0, Vec3::Z * 8.0, diffuse(0.5, 0.5, 0.5), 0.0)
                .sphere(p(-0.5, -0.4, 3.0), 0.6, metal(0.0), 0.0)
                .sphere(p(0.6, -0.5, 3.2), 0.5, glass(0.0), 0.0)
                .sphere(p(0.3, 1.2, 3.0), 0.2, diffuse(0.0, 0.0, 0.0), 20.0)
                .environment(0.7)
                .seen(0.5, 0.0),
        ),
        (
            "points",
            room()
                .sphere(p(-0.4, -0.5, 3.2), 0.5, metal(0.0), 0.0)
                .sphere(p(0.4, -0.5, 2.8), 0.5, metal(0.2), 0.0)
                .light(Light::Point(PointLight { position: p(-0.5, 0.2, 2.0), intensity: Spectrum::rgb(0.4, 0.6, 0.9) }))
                .light(Light::Spot(SpotLight {
                    position: p(0.5, 0.8, 2.0),
                    axis: p(-0.2, -0.8, 0.6).normalize(),
                    intensity: Spectrum::rgb(3.0, 2.0, 1.0),
                    inner: 0.3,
                    outer: 0.6,
                    falloff: Falloff::Linear,
                }))
                .seen(0.35, 0.0),
        ),
        (
            "sky",
            Stage::default()
                .quad(p(-3.0, -1.0, 0.0), Vec3::X * 6.0, Vec3::Z * 8.0, diffuse(0.5, 0.5, 0.5), 0.0)
                .sphere(p(-0.5, -0.4, 3.0), 0.6, metal(0.25), 0.0)
                .sphere(p(0.6, -0.5, 3.2), 0.5, glass(0.0), 0.0)
                .light(Light::Directional(DirectionalLight {
                    towards: p(0.4, 0.8, -0.4).normalize(),
                    irradiance: Spectrum::rgb(2.0, 1.8, 1.5),
                }))
                .light(Light::Image(Arc::new(sky())))
                .seen(0.5, 0.0),
        ),
        (
            // Enough lights for a tree among them.
            "lamps",
            (0..6)
                .map(|k| p(0.3 * k as f32 - 0.8, -0.9 + 0.25 * (k % 3) as f32, 2.0 + 0.4 * (k % 4) as f32))
                .fold(room(), |room, centre| {
                    let (x, y) = (p(0.05, 0.02, 0.0), p(0.0, 0.03, 0.06));
                    room.analytic(Disk { centre, x, y }.into(), diffuse(0.1, 0.1, 0.1), 20.0)
                })
                .screen(p(-0.8, -0.2, 3.8), p(0.6, 0.0, -0.3), p(0.0, 0.5, 0.2), [3.0, 0.5])
                .analytic(Cylinder { start: p(0.5, -1.0, 3.2), axis: Vec3::Y, length: 1.2, radius: 0.2 }.into(), metal(0.0), 0.0)
                .light(Light::Point(PointLight { position: p(0.1, 0.6, 2.0), intensity: Spectrum::rgb(0.2, 0.3, 0.4) }))
                .through(Projection::Orthographic(0.9), PixelFilter::mitchell(1.0 / 3.0, 1.0 / 3.0)),
        ),
        (
            "fog",
            room()
                .sphere(p(-0.3, -0.5, 3.2), 0.5, diffuse(0.8, 0.6, 0.3), 0.0)
                .medium(Spectrum::rgb(0.1, 0.25, 0.4), 0.9, 0.3)
                .around()
                .seen(0.35, 0.0),
        ),
        (
            "bounded",
            room()
                .medium(Spectrum::rgb(2.0, 1.0, 0.5), 0.8, 0.8)
                .medium(Spectrum::rgb(0.5, 1.0, 2.0), 0.7, 0.0)
                .bounded(0.0, Some([MediumId::VACUUM, MediumId(0)]))
                .sphere(p(-0.45, -0.2, 3.0), 0.5, diffuse(0.0, 0.0, 0.0), 0.0)
                .bounded(1.0, Some([MediumId::VACUUM, MediumId(1)]))
                .sphere(p(0.45, -0.4, 2.8), 0.45, glass(0.0), 0.0)
                .bounded(0.4, None)
                .quad(p(-0.9, 0.3, 2.4), Vec3::X * 1.8, Vec3::Z * 1.2, diffuse(0.7, 0.7, 0.2), 0.0)
                .seen(0.35, 0.0),
        ),
    ]
}

/// A plan for tests: everything that matters is an argument.
pub(crate) fn plan(technique: Technique, edge: u32, samples: u32, max_depth: u32, seed: u64) -> Plan {
    Plan {
        extent: Extent { width: edge, height: edge },
        technique,
        reconstruction: ReconstructionKind::None,
        samples,
        batch: Plan::BATCH,
        seed,
        alpha: Some(0.2),
        clamp: false,
        max_depth,
        roulette_depth: 4,
        shift: ShiftKind::Hybrid,
        shift_threshold: 0.001,
        shift_survival: 1.0,
        reuse_edge: 6,
        links: 8,
        rounds: 1,
        stop: Stop::default(),
        timeline: None,
        temporal: None,
        reasons: Vec::new(),
    }
}
