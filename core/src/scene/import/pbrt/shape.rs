//! Shapes: meshes, patches, subdivision surfaces, spheres, disks, cylinders.

use glam::DMat4;

use super::parameters::Parameters;
use super::{Importer, quadric, subdivide};
use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};
use crate::scene::assets::check_name;
use crate::scene::description::{
    Bitmap, Channels, Colour, Cylinder, Diffuse, Emission, Encoding, Geometry, Input, Material, MeshFile, MeshInline, Normals, Operation,
    Shape, Sphere, Texture, TextureFilter, Transform, UvTransform, Wrap,
};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;
use crate::scene::mesh::{self, MeshFormat, ply_binary};

/// Vertices up to which a mesh stands in the description itself.
const INLINE: usize = 32;

/// The form of a shape, with what placing it needs to know.
struct Formed {
    geometry: Geometry,
    /// Applied before the present transform.
    inner: Option<DMat4>,
    /// Area in the world, where it was asked for.
    area: f64,
    /// Pieces that pbrt would count as shapes of their own.
    parts: usize,
    flip: bool,
}

impl Importer<'_> {
    /// `Shape`.
    pub(super) fn shape(&mut self, kind: &str, parameters: &Parameters) -> Result<(), Error> {
        let alpha = self.scalar_input(parameters, "alpha")?;
        let Some(to_world) = self.placed(parameters)? else { return Ok(()) };
        let formed = match kind {
            "trianglemesh" => self.triangles(parameters)?,
            "bilinearmesh" => self.patches(parameters)?,
            "loopsubdiv" => self.subdivision(parameters)?,
            "plymesh" => self.ply(parameters)?,
            "sphere" => self.sphere(parameters)?,
            "disk" => self.disk(parameters)?,
            "cylinder" => self.cylinder(parameters)?,
            _ => {
                self.note(parameters, "left out: a shape that is not here");
                return Ok(());
            }
        };
        self.note_unread(parameters);
        let Some(formed) = formed else { return Ok(()) };
        let mut material = match &self.state.material {
            Some(material) => material.clone(),
            None => self.default_material(),
        };
        let emission = self.emission(&formed, parameters);
        match alpha {
            None | Some(Input::Constant(1.0)) => {}
            Some(_) if emission.is_some() => {
                self.note(parameters, "its alpha is left out, since what gives off light has no holes here");
            }
            Some(_) if self.is_empty(&material) => self.note(parameters, "its alpha is left out, its material has holes of its own"),
            Some(alpha) => material = self.masked(material, alpha),
        }
        if emission.is_some() && self.is_empty(&material) {
            self.note(parameters, "a surface that gives off light is black and not empty here");
            material = self.black();
        }
        let mut to_world = to_world;
        if let Some(inner) = formed.inner {
            to_world.0.insert(0, super::directive::rows(inner));
        }
        let shape = Shape {
            to_world,
            material: Some(material),
            emission,
            interior: self.state.inside.clone(),
            exterior: self.state.outside.clone(),
            flip_normals: formed.flip,
            ..bare(formed.geometry)
        };
        self.put(shape, parameters)
    }

    fn is_empty(&self, material: &str) -> bool {
        matches!(self.described.materials.get(material), Some(Material::Null | Material::Mask(_)))
    }

    fn black(&mut self) -> String {
        if let Some(name) = &self.black {
            return name.clone();
        }
        let name = self.names.materials.fresh("black", "black");
        let black = Diffuse { reflectance: Colour::grey(0.0).into(), two_sided: true };
        self.described.materials.insert(name.clone(), Material::Diffuse(black));
        self.black = Some(name.clone());
        name
    }

    fn emission(&mut self, formed: &Formed, parameters: &Parameters) -> Option<Emission> {
        let light = self.state.light.clone().filter(|light| !light.is_dark())?;
        if self.object.is_some() {
            self.note(parameters, "its light is left out: objects that are instanced give off none");
            return None;
        }
        if light.power.is_some() && formed.parts > 1 {
            self.note(parameters, "its power is spread evenly over its pieces, which pbrt counts as one light each");
        }
        let radiance = light.of(formed.area, formed.parts);
        let radiance = match light.image {
            None => Input::Constant(radiance),
            Some(file) => {
                let texture = Bitmap {
                    file,
                    encoding: Encoding::Auto,
                    channels: Channels::Rgb,
                    filter: TextureFilter::Bilinear,
                    wrap: Wrap::Clamp,
                    uv: UvTransform::default(),
                    scale: radiance,
                };
                let name = self.names.textures.fresh("light", "light");
                self.described.textures.insert(name.clone(), Texture::Bitmap(texture));
                Input::Texture(name)
            }
        };
        Some(Emission { radiance, two_sided: light.two_sided })
    }

    /// Whether it matters which side of a surface is its front.
    fn sides_matter(&self) -> bool {
        let light = self.state.light.as_ref().is_some_and(|light| !light.is_dark() && !light.two_sided);
        let material = self.state.material.as_ref().and_then(|name| self.described.materials.get(name));
        let plain = matches!(material, None | Some(Material::Diffuse(_) | Material::Conductor(_) | Material::Plastic(_)));
        light || !plain || self.state.inside != self.state.outside
    }

    /// A mesh as it stands in the frame of the present transform.
    fn meshed(&mut self, mut mesh: Mesh, normals: Normals, name: &str, parameters: &Parameters) -> Result<Option<Formed>, Error> {
        mesh.check().map_err(|fault| parameters.fault_here(ErrorKind::Malformed, fault.to_string(), "a sound mesh"))?;
        if mesh.triangles.is_empty() {
            self.note(parameters, "left out: it has no faces");
            return Ok(None);
        }
        quadric::align(&mut mesh);
        let (area, parts) = (self.area(&mesh), mesh.triangles.len());
        let geometry = if mesh.positions.len() <= INLINE && normals == Normals::AsWritten {
            Geometry::Mesh(MeshInline::from(&mesh))
        } else {
            let file = self.make("meshes", name, "ply", ply_binary::write(&mesh), parameters)?;
            Geometry::Ply(MeshFile { file, normals })
        };
        Ok(Some(Formed { geometry, inner: None, area, parts, flip: self.state.reverse }))
    }

    /// Area of a mesh in the world; 0 where nobody asks for it.
    fn area(&self, mesh: &Mesh) -> f64 {
        if self.state.light.as_ref().is_none_or(|light| light.power.is_none()) {
            return 0.0;
        }
        let ctm = self.state.ctm;
        let world = |corner: Vec3| ctm.transform_point3(corner.as_dvec3());
        let one = |triangle: usize| {
            let [a, b, c] = mesh.corners(triangle).map(world);
            (b - a).cross(c - a).length() * 0.5
        };
        (0..mesh.triangles.len()).map(one).sum()
    }

    fn triangles(&mut self, parameters: &Parameters) -> Result<Option<Formed>, Error> {
        let mut mesh = vertices(parameters)?;
        let corners = match parameters.indices("indices")? {
            Some(indices) => indices,
            None if mesh.positions.len() == 3 => vec![0, 1, 2],
            None => return Err(parameters.fault_here(ErrorKind::Malformed, "no indices", "\"integer indices\"")),
        };
        let (triangles, rest) = corners.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(parameters.fault_here(ErrorKind::Malformed, format!("{} indices", corners.len()), "three for each triangle"));
        }
        mesh.triangles = triangles.to_vec();
        parameters.pass_over(&["S", "faceIndices"]);
        self.meshed(mesh, Normals::AsWritten, "mesh", parameters)
    }

    /// Bilinear patches: flat ones as two triangles, others as a grid of them.
    fn patches(&mut self, parameters: &Parameters) -> Result<Option<Formed>, Error> {
        let mesh = vertices(parameters)?;
        let corners = match parameters.indices("indices")? {
            Some(indices) => indices,
            None if mesh.positions.len() == 4 => vec![0, 1, 2, 3],
            None => return Err(parameters.fault_here(ErrorKind::Malformed, "no indices", "\"integer indices\"")),
        };
        let (patches, rest) = corners.as_chunks::<4>();
        if !rest.is_empty() {
            return Err(parameters.fault_here(ErrorKind::Malformed, format!("{} indices", corners.len()), "four for each patch"));
        }
        if let Some(missing) = corners.iter().find(|corner| **corner as usize >= mesh.positions.len()) {
            let expected = format!("0 to {}", mesh.positions.len().saturating_sub(1));
            return Err(parameters.fault_here(ErrorKind::Malformed, format!("vertex {missing}"), expected));
        }
        parameters.pass_over(&["emissionfilename", "faceIndices"]);
        let mut whole = Mesh { triangles: Vec::new(), ..mesh };
        let mut bent = false;
        for patch in patches {
            bent |= subdivide::patch(&mut whole, *patch);
            if whole.triangles.len() > limits::MESH_ELEMENTS {
                return Err(parameters.fault_here(ErrorKind::TooLarge, "more triangles", format!("at most {}", limits::MESH_ELEMENTS)));
            }
        }
        if bent {
            self.note(parameters, "its bent patches are triangles");
        }
        self.meshed(whole, Normals::AsWritten, "patches", parameters)
    }

    fn subdivision(&mut self, parameters: &Parameters) -> Result<Option<Formed>, Error> {
        let mut mesh = vertices(parameters)?;
        let corners = parameters.indices("indices")?.unwrap_or_default();
        mesh.triangles = corners.as_chunks::<3>().0.to_vec();
        mesh.check().map_err(|fault| parameters.fault_here(ErrorKind::Malformed, fault.to_string(), "a sound mesh"))?;
        let levels = parameters.index("levels")?.unwrap_or(3);
        parameters.pass_over(&["scheme"]);
        let refined = subdivide::refine(mesh, levels)
            .map_err(|found| parameters.fault_here(ErrorKind::TooLarge, found, format!("at most {} triangles", subdivide::TRIANGLES)))?;
        self.meshed(refined, Normals::Smooth, "subdivision", parameters)
    }

    fn ply(&mut self, parameters: &Parameters) -> Result<Option<Formed>, Error> {
        let file = parameters.text("filename")?.map(str::to_string);
        let file = file.ok_or_else(|| parameters.fault_here(ErrorKind::Malformed, "no filename", "\"string filename\""))?;
        let file = file.strip_prefix("./").unwrap_or(&file).to_string();
        check_name(&file).map_err(|expected| parameters.fault_here(ErrorKind::OutsideFolder, format!("{file:?}"), expected))?;
        if file.ends_with(".gz") {
            self.note(parameters, format!("left out: {file:?} is compressed"));
            return Ok(None);
        }
        if parameters.get("displacement").is_some() {
            self.note(parameters, "its displacement is left out");
        }
        parameters.pass_over(&["edgelength"]);
        // The file's own triangles may be the other way round than its normals, and their area counts for lights of a given power.
        if self.sides_matter() {
            let mut mesh = mesh::read(self.assets, &file, MeshFormat::Ply, Normals::AsWritten)?;
            let (area, parts) = (self.area(&mesh), mesh.triangles.len());
            if quadric::align(&mut mesh) {
                let stem = file.rsplit('/').next().unwrap_or(&file).trim_end_matches(".ply").to_string();
                return self.meshed(mesh, Normals::AsWritten, &stem, parameters);
            }
            let geometry = Geometry::Ply(MeshFile { file, normals: Normals::AsWritten });
            return Ok(Some(Formed { geometry, inner: None, area, parts, flip: self.state.reverse }));
        }
        let geometry = Geometry::Ply(MeshFile { file, normals: Normals::AsWritten });
        Ok(Some(Formed { geometry, inner: None, area: 0.0, parts: 1, flip: self.state.reverse }))
    }

    fn sphere(&mut self, parameters: &Parameters) -> Result<Option<Formed>, Error> {
        let radius = size(parameters, "radius", 1.0)?;
        let z_min = parameters.number_or("zmin", -radius)?.clamp(-radius, radius);
        let z_max = parameters.number_or("zmax", radius)?.clamp(-radius, radius);
        let phi_max = parameters.number_or("phimax", 360.0)?;
        let scale = even_scale(self.state.ctm);
        let whole = z_min <= -radius && z_max >= radius && phi_max >= 360.0;
        let turned = self.state.reverse && self.sides_matter();
        match scale.filter(|_| whole && !turned) {
            Some(scale) => {
                let area = 4.0 * std::f64::consts::PI * radius * radius * scale * scale;
                let geometry = Geometry::Sphere(Sphere { center: [0.0; 3], radius });
                Ok(Some(Formed { geometry, inner: None, area, parts: 1, flip: false }))
            }
            None => {
                self.note(parameters, "cut, stretched or turned inside out: it is made of triangles");
                let formed = self.meshed(quadric::sphere(radius, z_min, z_max, phi_max), Normals::AsWritten, "sphere", parameters)?;
                Ok(formed.map(|formed| Formed { parts: 1, ..formed }))
            }
        }
    }

    fn disk(&mut self, parameters: &Parameters) -> Result<Option<Formed>, Error> {
        let height = parameters.number_or("height", 0.0)?;
        let radius = size(parameters, "radius", 1.0)?;
        let inner = parameters.number_or("innerradius", 0.0)?.clamp(0.0, radius);
        let phi_max = parameters.number_or("phimax", 360.0)?;
        match even_scale(self.state.ctm).filter(|_| inner == 0.0 && phi_max >= 360.0) {
            Some(scale) => {
                let frame =
                    DMat4::from_cols_array(&[radius, 0.0, 0.0, 0.0, 0.0, radius, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, height, 1.0]);
                let area = std::f64::consts::PI * radius * radius * scale * scale;
                Ok(Some(Formed { geometry: Geometry::Disk, inner: Some(frame), area, parts: 1, flip: self.state.reverse }))
            }
            None => {
                self.note(parameters, "cut or stretched: it is made of triangles");
                let formed = self.meshed(quadric::disk(height, radius, inner, phi_max), Normals::AsWritten, "disk", parameters)?;
                Ok(formed.map(|formed| Formed { parts: 1, ..formed }))
            }
        }
    }

    fn cylinder(&mut self, parameters: &Parameters) -> Result<Option<Formed>, Error> {
        let radius = size(parameters, "radius", 1.0)?;
        let (z_min, z_max) = (parameters.number_or("zmin", -1.0)?, parameters.number_or("zmax", 1.0)?);
        let (z_min, z_max) = (z_min.min(z_max), z_min.max(z_max));
        let phi_max = parameters.number_or("phimax", 360.0)?;
        match even_scale(self.state.ctm).filter(|_| phi_max >= 360.0 && z_min < z_max) {
            Some(scale) => {
                let area = 2.0 * std::f64::consts::PI * radius * (z_max - z_min) * scale * scale;
                let geometry = Geometry::Cylinder(Cylinder { p0: [0.0, 0.0, z_min], p1: [0.0, 0.0, z_max], radius });
                Ok(Some(Formed { geometry, inner: None, area, parts: 1, flip: self.state.reverse }))
            }
            None => {
                self.note(parameters, "cut or stretched: it is made of triangles");
                let formed = self.meshed(quadric::cylinder(radius, z_min, z_max, phi_max), Normals::AsWritten, "cylinder", parameters)?;
                Ok(formed.map(|formed| Formed { parts: 1, ..formed }))
            }
        }
    }
}

/// A shape of nothing yet.
pub(super) fn bare(geometry: Geometry) -> Shape {
    Shape {
        name: String::new(),
        geometry,
        to_world: Transform(Vec::<Operation>::new()),
        material: None,
        emission: None,
        interior: None,
        exterior: None,
        flip_normals: false,
    }
}

/// Vertices with what they carry.
fn vertices(parameters: &Parameters) -> Result<Mesh, Error> {
    let positions = parameters.vectors::<3>("P")?.unwrap_or_default();
    if positions.is_empty() {
        return Err(parameters.fault_here(ErrorKind::Malformed, "no vertices", "\"point3 P\""));
    }
    if positions.len() > limits::MESH_ELEMENTS {
        let expected = format!("at most {}", limits::MESH_ELEMENTS);
        return Err(parameters.fault_here(ErrorKind::TooLarge, format!("{} vertices", positions.len()), expected));
    }
    let narrow = |vector: &[f64; 3]| Vec3::new(vector[0] as f32, vector[1] as f32, vector[2] as f32);
    let uvs = match parameters.vectors::<2>("uv")? {
        Some(uvs) => Some(uvs),
        None => parameters.vectors::<2>("st")?,
    };
    Ok(Mesh {
        positions: positions.iter().map(narrow).collect(),
        normals: parameters.vectors::<3>("N")?.iter().flatten().map(|normal| narrow(normal).normalize_or_zero()).collect(),
        uvs: uvs.iter().flatten().map(|uv| Vec2::new(uv[0] as f32, uv[1] as f32)).collect(),
        ..Mesh::default()
    })
}

/// A length that must be positive.
fn size(parameters: &Parameters, name: &str, default: f64) -> Result<f64, Error> {
    let found = parameters.number_or(name, default)?;
    if found > 0.0 { Ok(found) } else { Err(parameters.fault_here(ErrorKind::Invalid, format!("{name} {found}"), "a size > 0")) }
}

/// The scale of a transform that turns, moves, mirrors and scales evenly.
fn even_scale(ctm: DMat4) -> Option<f64> {
    let scale = ctm.x_axis.truncate().length();
    let frame = glam::DMat3::from_mat4(ctm) * scale.recip();
    (frame.transpose() * frame).abs_diff_eq(glam::DMat3::IDENTITY, 1e-4).then_some(scale)
}
