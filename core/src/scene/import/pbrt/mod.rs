//! pbrt-v4's text scenes: shapes, materials, textures, lights, homogeneous media, cameras, includes, instances.
//!
//! pbrt's world is left-handed and ours right-handed. Positions are taken over as the numbers they are, which mirrors the world, and the
//! camera is mirrored with it, which mirrors it back: X of its frame points to the left of the picture in both. Fronts of surfaces are said
//! by cross products of numbers and so stay fronts.
//!
//! The film's sensor is taken for `cie1931`, whose imaging ratio is exposure time × ISO / 100: 1 as long as neither is given. Where they
//! are, every light is scaled. `maxdepth` counts bounces there and edges here: one more.
//!
//! # Source
//! Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th edition, 2023; the description of its file format, version 4.

mod camera;
mod directive;
mod light;
mod material;
mod medium;
mod parameters;
mod quadric;
mod shape;
mod sky;
mod spectrum;
mod state;
mod subdivide;
mod texture;
mod token;

use std::collections::{BTreeMap, BTreeSet};

use self::parameters::Parameters;
use self::state::State;
use self::token::Tokens;
use super::Imported;
use super::naming::Naming;
use crate::scene::assets::{Assets, MadeAssets};
use crate::scene::description::{
    Camera, ColourInput, Environment, Film, Integrator, Light, Material, Medium, ScalarInput, SceneDescription, Shape, Texture, VERSION,
};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

/// Deepest nesting of files that include each other.
const INCLUDES: usize = 16;
/// Most files included in all.
const INCLUDED: usize = 1 << 14;
/// Most bytes included in all.
const INCLUDED_BYTES: usize = 1 << 32;

/// Reads a pbrt scene from its text; `file` is the name that errors carry, `assets` the folder of its includes.
///
/// # Errors
/// Malformed text, values outside their domain, names that nothing bears, includes in a circle.
pub(in crate::scene) fn import(text: &str, file: &str, assets: &dyn Assets) -> Result<Imported, Error> {
    let mut importer = Importer::new(assets, file);
    importer.read(text, file, 0)?;
    importer.finish()
}

/// What was read so far.
struct Importer<'a> {
    assets: &'a dyn Assets,
    file: &'a str,
    state: State,
    camera: Option<Camera>,
    film: Film,
    /// Parameters of the camera and the film, which mean something only together.
    pending_camera: Option<(Parameters, String, glam::DMat4)>,
    /// Factor on all light, for exposure.
    exposure: f64,
    integrator: Integrator,
    described: Described,
    /// Materials by the names that the file gives them.
    named_materials: BTreeMap<String, String>,
    float_textures: BTreeMap<String, ScalarInput>,
    spectrum_textures: BTreeMap<String, ColourInput>,
    /// Groups by the names that the file gives them.
    objects: BTreeMap<String, String>,
    /// The object that is being defined, with the place of its start.
    object: Option<(String, Vec<Shape>)>,
    environment: Option<Environment>,
    camera_medium: Option<String>,
    /// Name of a black material, once one is wanted.
    black: Option<String>,
    made: MadeAssets,
    made_bytes: u64,
    names: Names,
    included: (usize, usize),
    report: Vec<String>,
    said: BTreeSet<String>,
}

/// The parts of the description.
#[derive(Default)]
struct Described {
    textures: BTreeMap<String, Texture>,
    media: BTreeMap<String, Medium>,
    materials: BTreeMap<String, Material>,
    groups: BTreeMap<String, Vec<Shape>>,
    shapes: Vec<Shape>,
    lights: Vec<Light>,
    count: usize,
}

/// Names given so far.
#[derive(Default)]
struct Names {
    materials: Naming,
    textures: Naming,
    groups: Naming,
    files: Naming,
}

impl<'a> Importer<'a> {
    fn new(assets: &'a dyn Assets, file: &'a str) -> Importer<'a> {
        Importer {
            assets,
            file,
            state: State::default(),
            camera: None,
            film: camera::default_film(),
            pending_camera: None,
            exposure: 1.0,
            integrator: Integrator { max_depth: 6, ..Integrator::default() },
            described: Described::default(),
            named_materials: BTreeMap::new(),
            float_textures: BTreeMap::new(),
            spectrum_textures: BTreeMap::new(),
            objects: BTreeMap::new(),
            object: None,
            environment: None,
            camera_medium: None,
            black: None,
            made: MadeAssets::new(),
            made_bytes: 0,
            names: Names::default(),
            included: (0, 0),
            report: Vec::new(),
            said: BTreeSet::new(),
        }
    }

    /// Reads a file, `depth` includes deep.
    fn read(&mut self, text: &str, file: &str, depth: usize) -> Result<(), Error> {
        let mut tokens = Tokens::new(text, file);
        while let Some(token) = tokens.next()? {
            self.directive(&mut tokens, &token, depth)?;
        }
        Ok(())
    }

    /// Reads another file in the place of a directive.
    fn include(&mut self, name: &str, parameters: &Parameters, depth: usize) -> Result<(), Error> {
        let fault = |kind, found: String, expected: &str| parameters.fault_here(kind, found, expected);
        if depth >= INCLUDES {
            return Err(fault(ErrorKind::TooLarge, format!("files that include each other {INCLUDES} deep"), "fewer, and no circle"));
        }
        let bytes = self.assets.open(name)?;
        self.included = (self.included.0 + 1, self.included.1.saturating_add(bytes.len()));
        if self.included.0 > INCLUDED || self.included.1 > INCLUDED_BYTES {
            let found = format!("{} files of {} bytes included", self.included.0, self.included.1);
            return Err(fault(ErrorKind::TooLarge, found, "fewer, and no circle"));
        }
        let text = String::from_utf8(bytes).map_err(|_| fault(ErrorKind::Malformed, format!("{name:?}, which is no UTF-8"), "text"))?;
        self.read(&text, name, depth + 1)
    }

    /// Adds a sentence about a directive to the report, once.
    fn note(&mut self, parameters: &Parameters, sentence: impl AsRef<str>) {
        let file = if parameters.file == self.file { String::new() } else { format!("{}, ", parameters.file) };
        let sentence = format!("{file}line {}, {}: {}", parameters.spot.line, parameters.title, sentence.as_ref());
        if self.said.insert(sentence.clone()) {
            self.report.push(sentence);
        }
    }

    /// Notes the parameters that nothing has read.
    fn note_unread(&mut self, parameters: &Parameters) {
        let unread: Vec<String> = parameters.unread().map(|parameter| format!("{} {}", parameter.kind, parameter.name)).collect();
        for name in unread {
            self.note(parameters, format!("the parameter {name:?} is left out"));
        }
    }

    /// Puts a shape into the scene, or into the object that is being defined.
    fn put(&mut self, shape: Shape, parameters: &Parameters) -> Result<(), Error> {
        self.described.count += 1;
        if self.described.count > limits::SHAPES {
            return Err(parameters.fault_here(ErrorKind::TooLarge, "more shapes", format!("at most {}", limits::SHAPES)));
        }
        match &mut self.object {
            Some((_, shapes)) => shapes.push(shape),
            None => self.described.shapes.push(shape),
        }
        Ok(())
    }

    /// Adds a file to those that were made. Returns its name.
    fn make(&mut self, folder: &str, name: &str, extension: &str, bytes: Vec<u8>, at: &Parameters) -> Result<String, Error> {
        self.made_bytes = self.made_bytes.saturating_add(bytes.len() as u64);
        if self.made_bytes > limits::MADE_BYTES {
            let expected = format!("at most {} bytes", limits::MADE_BYTES);
            return Err(at.fault_here(ErrorKind::TooLarge, "meshes and images that add up to more", expected));
        }
        let name = format!("{folder}/{}.{extension}", self.names.files.fresh(name, "file"));
        self.made.insert(name.clone(), bytes);
        Ok(name)
    }

    fn finish(mut self) -> Result<Imported, Error> {
        if let Some((name, _)) = &self.object {
            return Err(Error::new(ErrorKind::Malformed, self.file, "", format!("no end of the object {name:?}"), "ObjectEnd"));
        }
        if self.state.is_inside() {
            return Err(Error::new(ErrorKind::Malformed, self.file, "", "no end of an attribute block", "AttributeEnd"));
        }
        self.place_camera()?;
        let Some(camera) = self.camera else {
            return Err(Error::new(ErrorKind::Malformed, self.file, "", "no Camera", "one"));
        };
        let parts = self.described;
        let name = self.file.rsplit(['/', '\\']).next().unwrap_or(self.file);
        let description = SceneDescription {
            version: VERSION,
            about: format!("Imported from the pbrt scene {name}"),
            camera,
            film: self.film,
            integrator: self.integrator,
            textures: parts.textures,
            media: parts.media,
            materials: parts.materials,
            groups: parts.groups,
            shapes: parts.shapes,
            lights: parts.lights,
            environment: self.environment,
            medium: self.camera_medium,
            animation: None,
        };
        description.validate(self.file)?;
        Ok(Imported { description, made: self.made, report: self.report })
    }
}

#[cfg(test)]
mod tests;
