//! glTF 2.0, text and binary: meshes, materials with their extensions, punctual lights, cameras, animations.
//!
//! Both worlds are right-handed with +Y up, so positions carry over as they are. A glTF camera looks along −Z with +X to the right of the
//! picture, ours along +Z with +X to its left: half a turn around +Y. Texture coordinates have v = 0 at the first row of an image there and
//! v = 1 here: v becomes 1 − v. Emission and candela carry over as W·sr⁻¹·m⁻² and W·sr⁻¹ by number, lux as W·m⁻².
//!
//! # Source
//! Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, and its registry of extensions.

mod accessor;
mod animation;
mod camera;
mod container;
mod document;
mod extension;
mod form;
mod light;
mod material;
mod mesh;
mod node;
mod skin;
mod stand;
mod texture;

use std::collections::BTreeSet;

use self::container::Buffers;
pub(in crate::scene) use self::container::MAGIC;
use self::document::Document;
use self::extension::KNOWN;
use self::material::Materials;
use self::mesh::Meshes;
use self::node::Walk;
use self::texture::Textures;
use super::Imported;
use crate::scene::assets::Assets;
use crate::scene::description::{Colour, Environment, Integrator, SceneDescription, VERSION};
use crate::scene::error::{Error, ErrorKind};

/// Reads a glTF scene from the bytes of its `.gltf` or `.glb` file; `file` is the name that errors carry, `assets` its folder.
///
/// # Errors
/// Malformed files, extensions that the file requires and nobody here knows, values outside their domain.
pub(in crate::scene) fn import(bytes: &[u8], file: &str, assets: &dyn Assets) -> Result<Imported, Error> {
    let (json, binary) = container::split(bytes, file)?;
    let document = parse(json, file)?;
    let buffers = Buffers::read(&document.buffers, binary, file, assets)?;
    let source = Source { document: &document, buffers, file };
    let mut importer = Importer::default();
    importer.remarks(&source)?;
    let mut walk = Walk::default();
    walk.scene(&source, &mut importer)?;
    let (camera, film) = walk.camera(&source, &mut importer)?;
    let mut environment = None;
    let lit = !walk.lights.is_empty() || walk.shapes.iter().any(|shape| shape.emission.is_some());
    if !lit {
        importer.note("the file holds no light: lit from everywhere with radiance 1");
        environment = Some(Environment::constant(Colour::WHITE));
    }
    let (unseen, boxes) = (walk.cameras.is_empty(), walk.boxes);
    let mut description = SceneDescription {
        version: VERSION,
        about: about(&document, file),
        camera,
        film,
        integrator: Integrator::default(),
        textures: importer.textures.described,
        media: Default::default(),
        materials: importer.materials.described,
        groups: walk.groups,
        shapes: walk.shapes,
        lights: walk.lights,
        environment,
        medium: None,
        animation: walk.stands.animation(),
    };
    description.validate(file)?;
    if unseen && description.is_animated() {
        camera::frame_at_all_times(&mut description, &boxes)?;
    }
    let mut made = importer.meshes.made;
    made.append(&mut importer.textures.made);
    Ok(Imported { description, made, report: importer.report })
}

/// What is read from: the document and its buffers.
struct Source<'a> {
    document: &'a Document,
    buffers: Buffers,
    file: &'a str,
}

impl Source<'_> {
    fn fault(&self, kind: ErrorKind, path: &str, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::new(kind, self.file, path, found, expected)
    }

    /// An entry of one of the document's lists, which `path` refers to.
    fn get<'t, T>(&self, list: &'t [T], index: usize, path: &str, what: &str) -> Result<&'t T, Error> {
        list.get(index).ok_or_else(|| {
            let expected = format!("an index below {}, the number of {what}", list.len());
            self.fault(ErrorKind::UnknownName, path, format!("{what}[{index}]"), expected)
        })
    }
}

/// What was made so far.
#[derive(Default)]
struct Importer {
    materials: Materials,
    textures: Textures,
    meshes: Meshes,
    report: Vec<String>,
    said: BTreeSet<String>,
}

impl Importer {
    /// Adds a sentence to the report, once.
    fn note(&mut self, sentence: impl Into<String>) {
        let sentence = sentence.into();
        if self.said.insert(sentence.clone()) {
            self.report.push(sentence);
        }
    }

    /// Extensions that the file asks for.
    fn remarks(&mut self, source: &Source<'_>) -> Result<(), Error> {
        let document = source.document;
        if let Some(unknown) = document.extensions_required.iter().find(|name| !KNOWN.contains(&name.as_str())) {
            let expected = format!("a file that requires only what is known here: {}", KNOWN.join(", "));
            return Err(source.fault(ErrorKind::Unsupported, "extensionsRequired", format!("{unknown:?}"), expected));
        }
        for name in document.extensions_used.iter().filter(|name| !KNOWN.contains(&name.as_str())) {
            self.note(format!("extensionsUsed: {name} is left out"));
        }
        for name in document.extensions.others.keys() {
            self.note(format!("extensions: {name} is left out"));
        }
        Ok(())
    }
}

/// `materials[3] "Glass"`: the place of a thing with the name that people know it by.
fn titled(list: &str, index: usize, name: &str) -> String {
    if name.is_empty() { format!("{list}[{index}]") } else { format!("{list}[{index}] {name:?}") }
}

fn parse(json: &[u8], file: &str) -> Result<Document, Error> {
    let mut reader = serde_json::Deserializer::from_slice(json);
    let document: Document = serde_path_to_error::deserialize(&mut reader).map_err(|fault| {
        let path = fault.path().to_string();
        let (line, column) = (fault.inner().line(), fault.inner().column());
        let message = fault.inner().to_string();
        let found = message.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&message);
        Error::new(ErrorKind::Malformed, file, if path == "." { "" } else { &path }, found, "a glTF 2.0 document").at(line, column)
    })?;
    let version = document.asset.min_version.as_ref().unwrap_or(&document.asset.version);
    if !version.starts_with("2.") {
        return Err(Error::new(ErrorKind::Unsupported, file, "asset.version", format!("{version:?}"), "\"2.0\""));
    }
    Ok(document)
}

fn about(document: &Document, file: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    match &document.asset.copyright {
        Some(copyright) => format!("Imported from the glTF scene {name}; {}", copyright.chars().take(500).collect::<String>()),
        None => format!("Imported from the glTF scene {name}"),
    }
}

#[cfg(test)]
mod tests;
