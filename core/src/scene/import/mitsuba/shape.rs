//! Mitsuba's shapes, the area lights inside them, groups and their instances.

use super::super::xml::Element;
use super::bsdf;
use super::context::Context;
use super::values::Meaning;
use crate::scene::description::{ColourInput, Cylinder, Diffuse, Emission, Geometry, Instance, Material, MeshFile, Normals, Shape, Sphere};
use crate::scene::error::{Error, ErrorKind};

const KNOWN: &str = "rectangle, cube, sphere, disk, cylinder, obj, ply, serialized, shapegroup or instance";

/// What a shape's form leaves to be said.
struct Form {
    geometry: Geometry,
    /// Whether Mitsuba turns v round when it reads the shape's texture coordinates.
    turns_v: bool,
    /// Whether only its faces say where its front is, which a mirroring transform then swaps.
    faceted: bool,
}

impl<'a> Context<'a> {
    /// Reads a `<shape>` of the scene or of a group; `None` for a group itself, which stands nowhere until an instance places it.
    pub(super) fn shape(&mut self, element: &'a Element) -> Result<Option<Shape>, Error> {
        match self.kind(element)? {
            "shapegroup" => Ok(None),
            "instance" => self.instance(element).map(Some),
            _ => self.solid(element).map(Some),
        }
    }

    fn solid(&mut self, element: &'a Element) -> Result<Shape, Error> {
        let emitter = self.nested_one(element, "emitter")?;
        let (interior, exterior) = self.boundary(element)?;
        let has_media = interior.is_some() || exterior.is_some();
        let mut material = match self.nested_one(element, "bsdf")? {
            Some(bsdf) => self.material(bsdf)?,
            None => self.unsaid(emitter.is_some(), has_media),
        };
        let form = self.form(element)?;
        let to_world = self.placing(element)?;
        let mut flip_normals = self.boolean(element, "flip_normals")?.unwrap_or(false);
        let mut emission = emitter.map(|emitter| self.emission(emitter)).transpose()?;
        let mut geometry = form.geometry;
        if !form.turns_v {
            let turned = self.mirrored_material(&material);
            let textured = turned != material || emission.as_ref().is_some_and(|emission| emission.radiance.texture().is_some());
            material = turned;
            emission = emission.map(|emission| Emission { radiance: self.mirrored_input(emission.radiance), ..emission });
            if textured && geometry == Geometry::Cube {
                geometry = super::cube::textured();
            }
        }
        if mirrors(self.first(&to_world)) {
            if form.faceted {
                flip_normals = !flip_normals;
            } else if matches!(geometry, Geometry::Obj(_) | Geometry::Ply(_)) {
                self.note(element, "its transform mirrors: the front stays the front, as for a mesh that has normals of its own");
            }
        }
        let sampling = ["silhouette_sampling_weight", "silhouettes"];
        self.leave(element, &sampling, "says how Mitsuba samples")?;
        if self.old
            && let Some(subsurface) = element.children.iter().find(|child| child.tag == "subsurface")
        {
            return Err(self.unsupported(subsurface, "a bsdf, or media inside"));
        }
        self.finish(element, "to_world, flip_normals, a bsdf, an area emitter, media, and what the kind of shape needs")?;
        let name = element.attribute("id").unwrap_or_default().to_string();
        Ok(Shape { name, geometry, to_world, material: Some(material), emission, interior, exterior, flip_normals })
    }

    /// The surface of a shape that names none: black on lights, and nothing at all between media of Mitsuba 0.x.
    fn unsaid(&mut self, emits: bool, has_media: bool) -> String {
        let (name, material) = if self.old && has_media {
            ("null", Material::Null)
        } else if emits {
            ("black", Material::Diffuse(Diffuse { reflectance: ColourInput::black(), two_sided: false }))
        } else {
            ("default", bsdf::default_material())
        };
        // An id of the scene may be the same word.
        let name = format!("{name} of shapes without a bsdf");
        self.materials.entry(name.clone()).or_insert(material);
        name
    }

    /// Names of the media inside and outside.
    fn boundary(&mut self, element: &'a Element) -> Result<(Option<String>, Option<String>), Error> {
        let mut names = [None, None];
        for (side, name) in ["interior", "exterior"].iter().zip(&mut names) {
            if let Some(child) = self.parameter(element, side)? {
                let medium = self.resolved(child, "medium")?;
                *name = Some(self.medium(medium)?);
            }
        }
        let [interior, exterior] = names;
        Ok((interior, exterior))
    }

    fn form(&mut self, element: &'a Element) -> Result<Form, Error> {
        let plain = |geometry| Form { geometry, turns_v: false, faceted: false };
        Ok(match self.kind(element)? {
            "rectangle" => plain(Geometry::Rectangle),
            "cube" => plain(Geometry::Cube),
            "disk" => plain(Geometry::Disk),
            "sphere" => plain(Geometry::Sphere(Sphere {
                center: self.point(element, "center")?.unwrap_or_default(),
                radius: self.number(element, "radius")?.unwrap_or(1.0),
            })),
            "cylinder" => plain(Geometry::Cylinder(Cylinder {
                p0: self.point(element, "p0")?.unwrap_or_default(),
                p1: self.point(element, "p1")?.unwrap_or([0.0, 0.0, 1.0]),
                radius: self.number(element, "radius")?.unwrap_or(1.0),
            })),
            "obj" => {
                let turns_v = self.boolean(element, "flip_tex_coords")?.unwrap_or(true);
                let mesh = self.mesh_file(element)?;
                let faceted = mesh.normals == Normals::Flat;
                if self.integer(element, "shape_index")?.is_some_and(|index| index >= 0) {
                    self.note(element, "shape_index: all objects of the file are shown");
                }
                Form { geometry: Geometry::Obj(mesh), turns_v, faceted }
            }
            "ply" => {
                let turns_v = self.boolean(element, "flip_tex_coords")?.unwrap_or(false);
                let mesh = self.mesh_file(element)?;
                let faceted = mesh.normals == Normals::Flat;
                self.leave(element, &["srgb"], "vertex colours are linear here")?;
                Form { geometry: Geometry::Ply(mesh), turns_v, faceted }
            }
            "serialized" => {
                let turns_v = self.boolean(element, "flip_tex_coords")?.unwrap_or(false);
                let mesh = self.serialized(element)?;
                let faceted = mesh.normals == Normals::Flat;
                Form { geometry: Geometry::Ply(mesh), turns_v, faceted }
            }
            _ => return Err(self.unsupported(element, KNOWN)),
        })
    }

    /// A mesh file. Without normals of its own Mitsuba makes smooth ones, unless `face_normals` says otherwise.
    fn mesh_file(&mut self, element: &'a Element) -> Result<MeshFile, Error> {
        let file = self.word(element, "filename")?;
        let file = file.ok_or_else(|| element.fault(ErrorKind::Malformed, "no filename", "<string name=\"filename\" value=\"…\"/>"))?;
        let file = self.file_name(element, file)?;
        let normals = if self.boolean(element, "face_normals")?.unwrap_or(false) { Normals::Flat } else { Normals::Smooth };
        self.leave(element, &["max_smooth_angle"], "normals are smooth all over")?;
        self.leave(element, &["collapse", "merge"], "says how Mitsuba stores the mesh")?;
        Ok(MeshFile { file, normals })
    }

    /// A mesh out of a `.serialized` file, handed on as a file of its own.
    fn serialized(&mut self, element: &'a Element) -> Result<MeshFile, Error> {
        let mut mesh = self.mesh_file(element)?;
        let index = self.integer(element, "shape_index")?.unwrap_or(0);
        let index = usize::try_from(index).map_err(|_| element.fault(ErrorKind::Invalid, format!("shape_index {index}"), "0 or more"))?;
        let (file, faceted) = self.unpacked(element, &mesh.file, index)?;
        mesh.file = file;
        if faceted {
            mesh.normals = Normals::Flat;
        }
        Ok(mesh)
    }

    fn emission(&mut self, element: &'a Element) -> Result<Emission, Error> {
        if self.kind(element)? != "area" {
            return Err(self.unsupported(element, "area"));
        }
        let radiance = self.input(element, "radiance", Meaning::Radiance)?.unwrap_or(ColourInput::white());
        self.number(element, "sampling_weight")?;
        self.finish(element, "radiance")?;
        Ok(Emission { radiance, two_sided: false })
    }

    fn instance(&mut self, element: &'a Element) -> Result<Shape, Error> {
        let group = self.nested_one(element, "shape")?;
        let group = group.ok_or_else(|| element.fault(ErrorKind::Malformed, "no shapegroup", "one, or a ref to one"))?;
        if self.kind(group)? != "shapegroup" {
            return Err(self.unsupported(group, "shapegroup"));
        }
        let of = self.group(group)?;
        let to_world = self.placing(element)?;
        self.finish(element, "to_world and a shapegroup")?;
        let name = element.attribute("id").unwrap_or_default().to_string();
        let geometry = Geometry::Instance(Instance { of });
        Ok(Shape { name, geometry, to_world, material: None, emission: None, interior: None, exterior: None, flip_normals: false })
    }

    /// Reads a group once, and gives its name.
    fn group(&mut self, element: &'a Element) -> Result<String, Error> {
        let name = self.name(element)?;
        if self.groups.contains_key(&name) {
            return Ok(name);
        }
        let to_world = self.placing(element)?;
        let shapes = self.inside(element, &name, |context| {
            let mut shapes = Vec::new();
            for child in context.nested(element, "shape")? {
                if let Some(mut shape) = context.shape(child)? {
                    shape.to_world.0.extend(to_world.0.iter().cloned());
                    context.origins.insert(format!("groups.{name}[{}]", shapes.len()), child);
                    shapes.push(shape);
                }
            }
            Ok(shapes)
        })?;
        self.finish(element, "shapes")?;
        self.groups.insert(name.clone(), shapes);
        Ok(name)
    }
}

fn mirrors(matrix: glam::DMat4) -> bool {
    glam::DMat3::from_mat4(matrix).determinant() < 0.0
}
