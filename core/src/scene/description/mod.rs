//! The native scene description: exactly what a person wrote, in JSON, before anything is compiled.
//!
//! Units are metres, degrees and W·sr⁻¹·m⁻² per channel; colours are linear Rec.709. World space is right-handed with +Y up by custom.
//! Every choice between kinds is written as `{"kind": {…}}`, so that a fault inside it can be reported with its full path.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::{Error, ErrorKind};
use super::validate;

pub mod animation;
pub mod camera;
pub mod colour;
pub mod deform;
pub mod film;
pub mod input;
pub mod light;
pub mod map;
pub mod material;
pub mod medium;
pub mod metal;
pub mod shape;
pub mod texture;
pub mod transform;

pub use animation::{Animation, Interpolation, Node, Tangents, Track, Value};
pub use camera::{Camera, FovAxis, Orthographic, Perspective};
pub use colour::Colour;
pub use deform::{Influences, Joint, Morph, MorphTarget, Skin};
pub use film::{Crop, Film, Filter};
pub use input::{ColourInput, Input, ScalarInput};
pub use light::{DirectionalLight, Environment, EnvironmentImage, Falloff, Light, PointLight, Sky, SpotLight};
pub use material::{
    Blend, BumpMap, Conductor, Dielectric, Diffuse, Distribution, Mask, Material, NormalMap, Phong, Plastic, Principled, RoughDiffuse,
    TwoSided, Ward,
};
pub use medium::{HenyeyGreenstein, Homogeneous, Medium, Phase};
pub use metal::Metal;
pub use shape::{Cylinder, Emission, Geometry, Instance, MeshFile, MeshInline, Normals, Shape, Sphere};
pub use texture::{Bitmap, Channels, Checkerboard, Encoding, Mix, Product, Texture, TextureFilter, UvTransform, VertexColour, Wrap};
pub use transform::{LookAt, Operation, Rotation, Transform};

/// The version of the description that this code reads and writes.
pub const VERSION: u32 = 1;

/// A whole scene as written: camera, film, what light meets, and where light comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneDescription {
    /// Version of this format; 1.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Who made the scene, from what, under which licence. Not read by the renderer.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// The camera.
    pub camera: Camera,
    /// The film.
    #[serde(default)]
    pub film: Film,
    /// How far light is followed.
    #[serde(default)]
    pub integrator: Integrator,
    /// Textures by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty", deserialize_with = "map::unique_names")]
    pub textures: BTreeMap<String, Texture>,
    /// Participating media by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty", deserialize_with = "map::unique_names")]
    pub media: BTreeMap<String, Medium>,
    /// Materials by name.
    #[serde(default, deserialize_with = "map::unique_names")]
    pub materials: BTreeMap<String, Material>,
    /// Groups of shapes by name, to be placed with `{"instance": {"of": name}}`. A group may place other groups, but not itself.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty", deserialize_with = "map::unique_names")]
    pub groups: BTreeMap<String, Vec<Shape>>,
    /// What stands in the scene.
    #[serde(default)]
    pub shapes: Vec<Shape>,
    /// Lights without a surface.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<Light>,
    /// Light from infinitely far away, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<Environment>,
    /// Name of the medium around the camera, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub medium: Option<String>,
    /// What moves, if anything does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub animation: Option<Animation>,
}

/// How far light is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Integrator {
    /// Longest path in edges: 1 shows emitters only, 2 adds one bounce.
    #[serde(default = "Integrator::default_max_depth")]
    #[schemars(range(min = 1, max = 4096))]
    pub max_depth: u32,
    /// Edges after which Russian roulette may end a path.
    #[serde(default = "Integrator::default_roulette_depth")]
    #[schemars(range(min = 1))]
    pub roulette_depth: u32,
}

impl Integrator {
    fn default_max_depth() -> u32 {
        16
    }

    fn default_roulette_depth() -> u32 {
        5
    }
}

impl Default for Integrator {
    fn default() -> Integrator {
        Integrator { max_depth: Integrator::default_max_depth(), roulette_depth: Integrator::default_roulette_depth() }
    }
}

impl SceneDescription {
    /// Reads and checks a description. `file` is the name that errors carry.
    ///
    /// # Errors
    /// Malformed JSON, unknown or missing fields, values outside their domain, names that nothing bears: each with its JSON path.
    pub fn from_json(text: &str, file: &str) -> Result<SceneDescription, Error> {
        let mut json = serde_json::Deserializer::from_str(text);
        let description: SceneDescription = serde_path_to_error::deserialize(&mut json).map_err(|fault| malformed(&fault, file))?;
        json.end().map_err(|fault| from_serde(&fault, "", file))?;
        description.validate(file)?;
        Ok(description)
    }

    /// Checks everything that types do not: domains, names, limits, circles between groups. `file` is the name that errors carry.
    ///
    /// # Errors
    /// The first fault found, with its JSON path.
    pub fn validate(&self, file: &str) -> Result<(), Error> {
        validate::description(self, file)
    }

    /// The description as indented JSON, ending in a newline; [`SceneDescription::from_json`] reads back an equal one.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// The relative names of all files that the scene refers to, sorted, each once.
    pub fn assets(&self) -> Vec<String> {
        let shapes = self.groups.values().flatten().chain(&self.shapes);
        let meshes = shapes.filter_map(|shape| shape.geometry.file());
        let textures = self.textures.values().filter_map(Texture::file);
        let image = self.environment.iter().filter_map(|environment| environment.image.as_ref()).map(|image| image.file.as_str());
        let mut names: Vec<String> = meshes.chain(textures).chain(image).map(str::to_string).collect();
        names.sort();
        names.dedup();
        names
    }
}

/// The JSON Schema (draft 2020-12) of the description.
pub fn json_schema() -> serde_json::Value {
    let mut schema = schemars::schema_for!(SceneDescription);
    schema.insert("title".to_string(), "gradfarm scene, version 1".into());
    schema.into()
}

fn malformed(fault: &serde_path_to_error::Error<serde_json::Error>, file: &str) -> Error {
    let path = fault.path().to_string();
    from_serde(fault.inner(), if path == "." { "" } else { &path }, file)
}

/// serde says "invalid type: string \"x\", expected f64 at line 3 column 4": split into what was found and what was expected.
fn from_serde(fault: &serde_json::Error, path: &str, file: &str) -> Error {
    let (line, column) = (fault.line(), fault.column());
    let message = fault.to_string();
    let message = message.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&message);
    let (found, expected) = match message.split_once(", expected ") {
        Some((found, expected)) => (found, expected.to_string()),
        None => match message.strip_prefix("expected ") {
            Some(expected) => ("something else", expected.to_string()),
            None if message.contains("out of range") => (message, "a finite number".to_string()),
            None => (message, "a scene description, version 1 (`gradfarm schema` prints its schema)".to_string()),
        },
    };
    Error::new(ErrorKind::Malformed, file, path, found, expected).at(line, column)
}
