//! From the description to the scene that transport reads: files are opened, transforms applied, groups placed, lights gathered.

use std::collections::BTreeMap;

use glam::DMat4;

use super::assets::Assets;
use super::description::{self, Colour, Geometry, SceneDescription};
use super::error::{Error, ErrorKind};
use super::mesh::{self, MeshFormat};
use super::runtime::{Boundary, Scene, Shape};
use crate::geometry::{Analytic, Group, Instance, Mesh, ShapeId, WorldBuilder};
use crate::light::{AreaLight, Emitter, Light, Lights};
use crate::math::{Transform, Vec2, Vec3};
use crate::spectrum::Spectrum;
use crate::texture::ColourInput;

mod analytic;
mod camera;
mod light;
mod material;
mod medium;
mod texture;

/// The name that errors carry for faults of the description itself; those of its files carry the file's name.
const DESCRIPTION: &str = "scene";

impl Scene {
    /// Compiles a description; its files come from `assets`. Of one that moves, the instant 0.
    ///
    /// # Errors
    /// The description is invalid (it is checked again here, since it may come from elsewhere than a file), or a file of it is missing or faulty.
    pub fn compile(description: &SceneDescription, assets: &dyn Assets) -> Result<Scene, Error> {
        description.validate(DESCRIPTION)?;
        if !description.is_still() {
            return Scene::compile(&description.at(0.0)?, assets);
        }
        let textures = texture::compile(description, assets)?;
        let materials = material::compile(description, &textures)?;
        let sensor = camera::sensor(&description.camera, &description.film)?;
        let mut compiler = Compiler::new(description, assets, &textures);
        let mut builder = WorldBuilder::default();
        let groups = compiler.groups(&mut builder)?;
        for (index, shape) in description.shapes.iter().enumerate() {
            let path = format!("shapes[{index}]");
            if let Geometry::Instance(instance) = &shape.geometry {
                compiler.place(&instance.of, shape.to_world.matrix(), &groups, &path, &mut builder.instances)?;
            } else {
                let shape = compiler.shape(shape, &path)?;
                shape.put(&mut builder.meshes, &mut builder.analytic);
            }
        }
        let world = builder.build();
        compiler.lights.extend(light::compile(description, assets)?);
        let radius = world.bounds().radius();
        Ok(Scene {
            shapes: compiler.shapes,
            materials,
            boundaries: compiler.boundaries,
            media: medium::compile(description),
            around: medium::id(description, description.medium.as_ref()),
            lights: Lights::new(compiler.lights, radius),
            sensor,
            world,
        })
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

struct Compiler<'a> {
    description: &'a SceneDescription,
    assets: &'a dyn Assets,
    /// Materials are numbered in the order of their names.
    materials: BTreeMap<&'a str, u32>,
    /// Mesh files, read once each however often they are used.
    files: BTreeMap<(&'a str, MeshFormat, u8), Mesh>,
    textures: &'a texture::Textures,
    shapes: Vec<Shape>,
    boundaries: Vec<Boundary>,
    lights: Vec<Light>,
}

impl<'a> Compiler<'a> {
    fn new(description: &'a SceneDescription, assets: &'a dyn Assets, textures: &'a texture::Textures) -> Compiler<'a> {
        let materials = description.materials.keys().map(String::as_str).zip(0..).collect();
        Compiler {
            description,
            assets,
            materials,
            files: BTreeMap::new(),
            textures,
            shapes: Vec::new(),
            boundaries: Vec::new(),
            lights: Vec::new(),
        }
    }

    /// Builds every group that holds shapes of its own, and says which number it got.
    fn groups(&mut self, builder: &mut WorldBuilder) -> Result<BTreeMap<&'a str, u32>, Error> {
        let mut numbers = BTreeMap::new();
        for (name, shapes) in &self.description.groups {
            let (mut meshes, mut analytic) = (Vec::new(), Vec::new());
            for (index, shape) in shapes.iter().enumerate().filter(|(_, shape)| !matches!(shape.geometry, Geometry::Instance(_))) {
                self.shape(shape, &format!("groups.{name}[{index}]"))?.put(&mut meshes, &mut analytic);
            }
            if !meshes.is_empty() || !analytic.is_empty() {
                numbers.insert(name.as_str(), builder.groups.len() as u32);
                builder.groups.push(Group::build(meshes, analytic));
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

    /// One shape that is no instance: its geometry, its entry in the table, its light.
    fn shape(&mut self, shape: &'a description::Shape, path: &str) -> Result<Placed, Error> {
        let to_world = transform(shape.to_world.matrix(), &format!("{path}.to_world"))?;
        let id = ShapeId(self.shapes.len() as u32);
        let placed = match analytic::compile(self.description, shape, &to_world, path)? {
            Some(surface) => Placed::Analytic(surface, id),
            None => {
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
                mesh.check().map_err(|fault| Error::new(ErrorKind::Invalid, DESCRIPTION, path, fault.to_string(), "numbers that fit"))?;
                Placed::Mesh(mesh, id)
            }
        };
        let light = self.light(shape, &placed, path)?;
        let material = shape.material.as_deref().and_then(|name| self.materials.get(name)).copied().unwrap_or_default();
        let boundary = medium::boundary(self.description, shape, self.textures).map(|boundary| {
            self.boundaries.push(boundary);
            self.boundaries.len() as u32 - 1
        });
        self.shapes.push(Shape { material, light, boundary });
        Ok(placed)
    }

    fn light(&mut self, shape: &description::Shape, placed: &Placed, path: &str) -> Result<Option<u32>, Error> {
        let Some(emission) = shape.emission.as_ref().filter(|emission| !emission.radiance.is_black()) else { return Ok(None) };
        let radiance = texture::colour(&emission.radiance, self.textures);
        let emitter = match placed {
            Placed::Analytic(surface, _) => Some(Emitter::Analytic(*surface)),
            Placed::Mesh(mesh, _) => Emitter::from_mesh(mesh, matches!(radiance, ColourInput::Texture(_))),
        };
        let emitter = emitter.ok_or_else(|| {
            let path = format!("{path}.emission");
            Error::new(ErrorKind::Invalid, DESCRIPTION, &path, "emission from a surface without area", "a surface with some area")
        })?;
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
        let key = (file.file.as_str(), format, file.normals as u8);
        if let Some(mesh) = self.files.get(&key) {
            return Ok(mesh.clone());
        }
        let mesh = mesh::read(self.assets, &file.file, format, file.normals)?;
        self.files.insert(key, mesh.clone());
        Ok(mesh)
    }
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
