//! From the description to the scene that transport reads: files are opened, transforms applied, groups placed, lights gathered.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DMat4;

use super::animate::Motion;
use super::assets::Assets;
use super::description::{self, Colour, Geometry, SceneDescription};
use super::error::{Error, ErrorKind};
use super::mesh::MeshFormat;
use super::runtime::{Boundary, Scene, Shape};
use crate::geometry::{Analytic, Group, Instance, Mesh, ShapeId, WorldBuilder};
use crate::light::{AreaLight, Emitter, Light, Lights};
use crate::material::Material;
use crate::math::{Transform, Vec2, Vec3};
use crate::spectrum::Spectrum;
use crate::texture::ColourInput;

mod analytic;
mod camera;
mod kept;
mod light;
mod material;
mod medium;
mod texture;

pub(super) use kept::Kept;
use kept::Surfaces;

/// The name that errors carry for faults of the description itself; those of its files carry the file's name.
const DESCRIPTION: &str = "scene";

impl Scene {
    /// Compiles a description; its files come from `assets`. Of one that moves, the instant 0.
    ///
    /// # Errors
    /// The description is invalid (it is checked again here, since it may come from elsewhere than a file), or a file of it is missing or faulty.
    pub fn compile(description: &SceneDescription, assets: &dyn Assets) -> Result<Scene, Error> {
        description.validate(DESCRIPTION)?;
        let still;
        let description = if description.is_still() {
            description
        } else {
            still = description.at(0.0)?;
            &still
        };
        instant(description, &Motion::default(), &mut Kept::default(), assets)
    }
}

/// Compiles one instant of a scene. `motion` tells what stands elsewhere at another instant, `kept` holds what the others have built.
///
/// Shapes, groups and instances get the same numbers at all instants.
pub(super) fn instant(still: &SceneDescription, motion: &Motion, kept: &mut Kept, assets: &dyn Assets) -> Result<Scene, Error> {
    kept.surfaces(still, assets)?;
    let Surfaces { textures, materials, .. } = kept.surfaces.take().unwrap_or_default();
    let scene = Compiler::new(still, assets, &textures, kept).scene(motion, &materials);
    kept.surfaces = Some(Surfaces { textures, materials, of: (still.textures.clone(), still.materials.clone()) });
    scene
}

struct Compiler<'a> {
    description: &'a SceneDescription,
    assets: &'a dyn Assets,
    /// Materials are numbered in the order of their names.
    materials: BTreeMap<&'a str, u32>,
    textures: &'a texture::Textures,
    kept: &'a mut Kept,
    shapes: Vec<Shape>,
    boundaries: Vec<Boundary>,
    lights: Vec<Light>,
}

impl<'a> Compiler<'a> {
    fn new(description: &'a SceneDescription, assets: &'a dyn Assets, textures: &'a texture::Textures, kept: &'a mut Kept) -> Compiler<'a> {
        let materials = description.materials.keys().map(String::as_str).zip(0..).collect();
        Compiler { description, assets, materials, textures, kept, shapes: Vec::new(), boundaries: Vec::new(), lights: Vec::new() }
    }

    fn scene(mut self, motion: &Motion, materials: &[Material]) -> Result<Scene, Error> {
        let description = self.description;
        let sensor = camera::sensor(&description.camera, &description.film)?;
        let mut builder = WorldBuilder { built: self.kept.own.clone(), ..WorldBuilder::default() };
        let groups = self.groups(motion, &mut builder)?;
        for (index, shape) in description.shapes.iter().enumerate() {
            let path = format!("shapes[{index}]");
            if let Geometry::Instance(instance) = &shape.geometry {
                self.place(&instance.of, shape.to_world.matrix(), &groups, &path, &mut builder.instances)?;
            } else if motion.moved.contains(&index) || motion.deformed.contains(&index) {
                self.moving(shape, &path, motion.deformed.contains(&index), &mut builder)?;
            } else if let Some(placed) = self.shape(shape, &path, builder.built.is_some())? {
                placed.put(&mut builder.meshes, &mut builder.analytic);
            }
        }
        let world = builder.build();
        self.kept.own = Some(world.own());
        self.lights.extend(light::compile(description, self.assets, &mut self.kept.environment)?);
        let radius = world.bounds().radius();
        Ok(Scene {
            shapes: self.shapes,
            materials: materials.to_vec(),
            boundaries: self.boundaries,
            media: medium::compile(description),
            around: medium::id(description, description.medium.as_ref()),
            lights: Lights::new(self.lights, radius),
            sensor,
            world,
        })
    }

    /// Builds every group that holds shapes of its own, and says which number it got.
    fn groups(&mut self, motion: &Motion, builder: &mut WorldBuilder) -> Result<BTreeMap<&'a str, u32>, Error> {
        let mut numbers = BTreeMap::new();
        for (name, shapes) in &self.description.groups {
            let built = self.kept.groups.get(name).filter(|_| !motion.groups.contains(name)).cloned();
            let (mut meshes, mut analytic) = (Vec::new(), Vec::new());
            let own = shapes.iter().enumerate().filter(|(_, shape)| !matches!(shape.geometry, Geometry::Instance(_)));
            let mut any = false;
            for (index, shape) in own {
                any = true;
                if let Some(placed) = self.shape(shape, &format!("groups.{name}[{index}]"), built.is_some())? {
                    placed.put(&mut meshes, &mut analytic);
                }
            }
            if any {
                numbers.insert(name.as_str(), builder.groups.len() as u32);
                let group = built.unwrap_or_else(|| Arc::new(Group::build(meshes, analytic)));
                self.kept.groups.insert(name.clone(), group.clone());
                builder.groups.push(group);
            }
        }
        Ok(numbers)
    }

    /// Places a group and, through it, the groups that it places. Depth and number are bounded by the check of the description.
    fn place(&self, of: &str, to_world: DMat4, numbers: &BTreeMap<&str, u32>, path: &str, into: &mut Vec<Instance>) -> Result<(), Error> {
        if let Some(group) = numbers.get(of) {
            into.push(Instance { group: *group, to_world: transform(to_world, path)? });
        }
        for shape in self.description.groups.get(of).into_iter().flatten() {
            if let Geometry::Instance(instance) = &shape.geometry {
                self.place(&instance.of, to_world * shape.to_world.matrix(), numbers, path, into)?;
            }
        }
        Ok(())
    }

    /// A shape that moves is a group of its own. Triangles that only stand elsewhere are built once, in their own frame; lights
    /// need them in the world's, and what a formula gives is as soon built anew.
    fn moving(&mut self, shape: &'a description::Shape, path: &str, deformed: bool, builder: &mut WorldBuilder) -> Result<(), Error> {
        let rigid = !deformed && shape.emission.is_none() && analytic::is_mesh(&shape.geometry);
        let id = ShapeId(self.shapes.len() as u32);
        let (group, to_world) = if rigid {
            self.shape(shape, path, true)?;
            let to_world = transform(shape.to_world.matrix(), &format!("{path}.to_world"))?;
            let group = match self.kept.rigid.get(&id.0) {
                Some(group) => group.clone(),
                None => {
                    let mesh = self.mesh(&shape.geometry)?;
                    let mesh = if shape.flip_normals { mesh.flipped() } else { mesh };
                    check(&mesh, path)?;
                    let group = Arc::new(Group::build(vec![(mesh, id)], Vec::new()));
                    self.kept.rigid.insert(id.0, group.clone());
                    group
                }
            };
            (group, to_world)
        } else {
            let (mut meshes, mut analytic) = (Vec::new(), Vec::new());
            if let Some(placed) = self.shape(shape, path, false)? {
                placed.put(&mut meshes, &mut analytic);
            }
            (Arc::new(Group::build(meshes, analytic)), Transform::IDENTITY)
        };
        builder.instances.push(Instance { group: builder.groups.len() as u32, to_world });
        builder.groups.push(group);
        Ok(())
    }

    /// One shape that is no instance: its entry in the table, its light, and its geometry unless a tree that holds it was `built` before.
    fn shape(&mut self, shape: &'a description::Shape, path: &str, built: bool) -> Result<Option<Placed>, Error> {
        let id = ShapeId(self.shapes.len() as u32);
        let placed = if built { None } else { Some(self.geometry(shape, id, path)?) };
        let light = self.light(shape, placed.as_ref(), id, path)?;
        let material = shape.material.as_deref().and_then(|name| self.materials.get(name)).copied().unwrap_or_default();
        let boundary = medium::boundary(self.description, shape, self.textures).map(|boundary| {
            self.boundaries.push(boundary);
            self.boundaries.len() as u32 - 1
        });
        self.shapes.push(Shape { material, light, boundary });
        Ok(placed)
    }

    /// A shape's geometry in the frame of the world or its group.
    fn geometry(&mut self, shape: &'a description::Shape, id: ShapeId, path: &str) -> Result<Placed, Error> {
        let to_world = transform(shape.to_world.matrix(), &format!("{path}.to_world"))?;
        if let Some(surface) = analytic::compile(self.description, shape, &to_world, path)? {
            return Ok(Placed::Analytic(surface, id));
        }
        let geometry = &shape.geometry;
        let mut mesh = self.mesh(geometry)?.transformed(&to_world);
        if shape.flip_normals {
            mesh = mesh.flipped();
        }
        let turned = to_world.mirrors() != shape.flip_normals;
        if turned && matches!(geometry, Geometry::Rectangle) {
            // Keeps the two halves in the order that lets a light know the rectangle for a parallelogram.
            mesh.triangles.reverse();
        }
        check(&mesh, path)?;
        Ok(Placed::Mesh(mesh, id))
    }

    fn light(&mut self, shape: &'a description::Shape, placed: Option<&Placed>, id: ShapeId, path: &str) -> Result<Option<u32>, Error> {
        let Some(emission) = shape.emission.as_ref().filter(|emission| !emission.radiance.is_black()) else { return Ok(None) };
        let radiance = texture::colour(&emission.radiance, self.textures);
        let known = if placed.is_none() { self.kept.emitters.get(&id.0).cloned() } else { None };
        let emitter = match known {
            Some(emitter) => emitter,
            None => {
                let made = match placed {
                    Some(placed) => emitter(placed, &radiance),
                    None => emitter(&self.geometry(shape, id, path)?, &radiance),
                };
                let made = made.ok_or_else(|| {
                    let path = format!("{path}.emission");
                    Error::new(ErrorKind::Invalid, DESCRIPTION, &path, "emission from a surface without area", "a surface with some area")
                })?;
                self.kept.emitters.insert(id.0, made.clone());
                made
            }
        };
        self.lights.push(Light::Area(AreaLight { radiance, two_sided: emission.two_sided, emitter }));
        Ok(Some(self.lights.len() as u32 - 1))
    }

    /// The triangles of a geometry in its own frame.
    fn mesh(&mut self, geometry: &'a Geometry) -> Result<Mesh, Error> {
        let (file, format) = match geometry {
            Geometry::Rectangle => return Ok(rectangle()),
            Geometry::Cube => return Ok(cube()),
            Geometry::Mesh(mesh) => return Ok(inline(mesh)),
            Geometry::Obj(file) => (file, MeshFormat::Obj),
            Geometry::Ply(file) => (file, MeshFormat::Ply),
            // None of these is made of triangles, and none is asked for here.
            Geometry::Sphere(_) | Geometry::Disk | Geometry::Cylinder(_) | Geometry::Instance(_) => return Ok(Mesh::default()),
        };
        self.kept.file(&file.file, format, file.normals, self.assets)
    }
}

/// A shape's geometry in the frame of the world or its group.
enum Placed {
    Mesh(Mesh, ShapeId),
    Analytic(Analytic, ShapeId),
}

impl Placed {
    fn put(self, meshes: &mut Vec<(Mesh, ShapeId)>, analytic: &mut Vec<(Analytic, ShapeId)>) {
        match self {
            Placed::Mesh(mesh, id) => meshes.push((mesh, id)),
            Placed::Analytic(surface, id) => analytic.push((surface, id)),
        }
    }
}

fn emitter(placed: &Placed, radiance: &ColourInput) -> Option<Emitter> {
    match placed {
        Placed::Analytic(surface, _) => Some(Emitter::Analytic(*surface)),
        Placed::Mesh(mesh, _) => Emitter::from_mesh(mesh, matches!(radiance, ColourInput::Texture(_))),
    }
}

fn check(mesh: &Mesh, path: &str) -> Result<(), Error> {
    mesh.check().map_err(|fault| Error::new(ErrorKind::Invalid, DESCRIPTION, path, fault.to_string(), "numbers that fit"))
}

/// What the description can say and this renderer cannot do.
fn unsupported(path: &str, what: &str) -> Error {
    Error::new(ErrorKind::Unsupported, DESCRIPTION, path, what, "something that can be rendered")
}

fn transform(matrix: DMat4, path: &str) -> Result<Transform, Error> {
    let rows = [0, 1, 2].map(|row| matrix.row(row).to_array());
    Transform::from_rows(rows).ok_or_else(|| {
        let found = "a transform that flattens space or overflows";
        Error::new(ErrorKind::Invalid, DESCRIPTION, path, found, "one that can be undone")
    })
}

/// [-1, 1]² in the XY plane, normal +Z, texture coordinates [0, 1]².
fn rectangle() -> Mesh {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Vec2::from);
    Mesh {
        positions: corners.iter().map(|corner| corner.extend(0.0)).collect(),
        uvs: corners.iter().map(|corner| (*corner + 1.0) * 0.5).collect(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// [-1, 1]³, normals outwards. Vertex k has its bits as coordinates: 0 is −1, 1 is +1; bit 0 is x.
fn cube() -> Mesh {
    let coordinate = |k: u32, axis: u32| if k >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh {
        positions: (0..8).map(|k| Vec3::new(coordinate(k, 0), coordinate(k, 1), coordinate(k, 2))).collect(),
        triangles: faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect(),
        ..Mesh::default()
    }
}

fn inline(mesh: &description::MeshInline) -> Mesh {
    Mesh {
        positions: mesh.positions.iter().copied().map(Vec3::from).collect(),
        normals: mesh.normals.iter().flatten().map(|normal| Vec3::from(*normal).normalize_or_zero()).collect(),
        uvs: mesh.uvs.iter().flatten().copied().map(Vec2::from).collect(),
        colours: mesh.colours.iter().flatten().copied().map(Vec3::from).collect(),
        triangles: mesh.indices.clone(),
    }
}

fn spectrum(colour: Colour) -> Spectrum {
    let [r, g, b] = colour.to_f32();
    Spectrum::rgb(r, g, b)
}

#[cfg(test)]
mod tests;
