//! Shapes as written: a geometry, where it stands, what it is made of, and whether it glows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::deform::{Morph, Skin};
use super::input::ColourInput;
use super::transform::Transform;

/// One shape in the scene or in a group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    /// What people call it. Not read by the renderer.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Its form, in its own frame.
    pub geometry: Geometry,
    /// From its own frame to the world, or to the group's frame.
    #[serde(default, skip_serializing_if = "Transform::is_identity")]
    pub to_world: Transform,
    /// Name of its material. Needed by everything but an instance, whose group's shapes carry their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Light that leaves its front, where its normal points. Only outside groups.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub emission: Option<Emission>,
    /// Name of the medium behind the surface, where its normal points away from. Needs `exterior` to agree with what lies before it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interior: Option<String>,
    /// Name of the medium before the surface, where its normal points to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exterior: Option<String>,
    /// Turns the surface inside out: back becomes front.
    #[serde(default, skip_serializing_if = "is_no")]
    pub flip_normals: bool,
}

/// The form of a shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// The square [-1, 1]² in the XY plane, normal +Z.
    Rectangle,
    /// The cube [-1, 1]³, normals outwards.
    Cube,
    /// A sphere, normals outwards.
    Sphere(Sphere),
    /// The disk of radius 1 about the origin in the XY plane, normal +Z.
    Disk,
    /// A tube without ends, normals outwards.
    Cylinder(Cylinder),
    /// Triangles written here.
    Mesh(MeshInline),
    /// Triangles from a Wavefront OBJ file.
    Obj(MeshFile),
    /// Triangles from a PLY file, text or binary.
    Ply(MeshFile),
    /// A group, placed here.
    Instance(Instance),
}

impl Geometry {
    /// The file it refers to, if any.
    pub fn file(&self) -> Option<&str> {
        match self {
            Geometry::Obj(mesh) | Geometry::Ply(mesh) => Some(&mesh.file),
            Geometry::Rectangle
            | Geometry::Cube
            | Geometry::Sphere(_)
            | Geometry::Disk
            | Geometry::Cylinder(_)
            | Geometry::Mesh(_)
            | Geometry::Instance(_) => None,
        }
    }
}

/// A sphere in its own frame. Its `to_world` may turn, move and scale it evenly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Centre [m].
    #[serde(default)]
    pub center: [f64; 3],
    /// Radius [m], > 0.
    pub radius: f64,
}

/// A tube in its own frame. Its `to_world` may turn, move and scale it evenly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// One end of its axis [m].
    #[serde(default)]
    pub p0: [f64; 3],
    /// The other end [m].
    #[serde(default = "above")]
    pub p1: [f64; 3],
    /// Radius [m], > 0.
    pub radius: f64,
}

/// Triangles written in the description itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshInline {
    /// Vertices [m].
    pub positions: Vec<[f32; 3]>,
    /// Triangles as three indices into `positions`, counter-clockwise seen from the front.
    pub indices: Vec<[u32; 3]>,
    /// Shading normals, one a vertex; without them the surface is faceted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates, one a vertex.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Colours, one a vertex, linear Rec.709, for the texture `vertex_colour`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colours: Option<Vec<[f32; 3]>>,
    /// Forms that it is blended towards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub morph: Option<Morph>,
    /// Joints that it hangs on, after it is blended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<Skin>,
}

/// Triangles from a file beside the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshFile {
    /// Name relative to the scene's folder, parts joined by `/`, and inside that folder.
    pub file: String,
    /// Where the shading normals come from.
    #[serde(default, skip_serializing_if = "Normals::is_as_written")]
    pub normals: Normals,
}

/// Where the shading normals of a mesh file come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Normals {
    /// From the file; a mesh without any is faceted.
    #[default]
    AsWritten,
    /// From the faces: always faceted, whatever the file says.
    Flat,
    /// From the file, and where it has none, from the faces around each vertex.
    Smooth,
}

impl Normals {
    fn is_as_written(&self) -> bool {
        *self == Normals::AsWritten
    }
}

/// A group, placed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Instance {
    /// Name of the group.
    pub of: String,
}

/// Light from a surface, equal in all directions of its side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Emission {
    /// Radiance [W·sr⁻¹·m⁻²].
    pub radiance: ColourInput,
    /// Whether light leaves the back too.
    #[serde(default, skip_serializing_if = "is_no")]
    pub two_sided: bool,
}

fn above() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn is_no(value: &bool) -> bool {
    !*value
}
