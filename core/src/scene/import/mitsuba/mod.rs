//! Mitsuba 3 XML: perspective and thin-lens cameras, diffuse, conductor and dielectric surfaces, meshes, area and constant lights.
//!
//! Nothing is dropped in silence. What would change the picture and cannot be honoured is an error that names its line; what only says how
//! Mitsuba was to work (samplers, file formats) goes into the report.

mod bsdf;
mod context;
mod sensor;
mod shape;
mod transform;
mod values;

use std::collections::BTreeMap;

use self::context::Context;
use super::Imported;
use super::xml::{self, Element};
use crate::scene::assets::{Assets, MadeAssets};
use crate::scene::description::{Camera, Environment, Film, Integrator, Material, SceneDescription, Shape, VERSION};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

/// Reads a Mitsuba 3 scene from its text; `file` is the name that errors carry. Returns the description and the report.
///
/// # Errors
/// Malformed XML, values outside their domain, and everything that changes the picture but has no counterpart here.
pub(in crate::scene) fn import(text: &str, file: &str, _assets: &dyn Assets) -> Result<Imported, Error> {
    let root = xml::parse(text, file)?;
    if root.tag != "scene" {
        return Err(root.fault(ErrorKind::Malformed, file, format!("the root <{}>", root.tag), "<scene version=\"3.0.0\">"));
    }
    let mut scene = Importer { context: Context::new(file), ..Importer::default() };
    scene.context.check_version(&root)?;
    for child in &root.children {
        scene.child(child)?;
    }
    scene.finish(&root)
}

/// What the scene's elements said so far.
#[derive(Default)]
struct Importer<'a> {
    context: Context<'a>,
    camera: Option<Camera>,
    film: Film,
    integrator: Option<Integrator>,
    materials: BTreeMap<String, Material>,
    shapes: Vec<Shape>,
    environment: Option<Environment>,
    /// Where the parts of the description came from, so that faults found by its check can name a line.
    lines: BTreeMap<String, (usize, usize)>,
}

impl<'a> Importer<'a> {
    fn child(&mut self, element: &'a Element) -> Result<(), Error> {
        let place = (element.line, element.column);
        match element.tag.as_str() {
            "default" => self.context.define(element)?,
            "integrator" => {
                self.once(self.integrator.is_some(), element)?;
                self.integrator = Some(self.integrator(element)?);
                self.lines.insert("integrator".to_string(), place);
            }
            "sensor" => {
                self.once(self.camera.is_some(), element)?;
                let (camera, film) = sensor::read(&mut self.context, element)?;
                (self.camera, self.film) = (Some(camera), film);
                self.lines.insert("camera".to_string(), place);
                self.lines.insert("film".to_string(), place);
            }
            "bsdf" => {
                self.material(element)?;
            }
            "shape" => self.shape(element)?,
            "emitter" => self.emitter(element)?,
            _ => return Err(self.context.unsupported(element, "default, integrator, sensor, bsdf, shape or emitter")),
        }
        Ok(())
    }

    fn once(&self, seen: bool, element: &Element) -> Result<(), Error> {
        if seen { Err(self.context.fault(element, ErrorKind::Unsupported, "a second one", "one")) } else { Ok(()) }
    }

    fn integrator(&mut self, element: &Element) -> Result<Integrator, Error> {
        let context = &mut self.context;
        match context.kind(element)?.as_str() {
            "path" => {}
            other @ ("volpath" | "volpathmis" | "bdpt" | "ptracer" | "prb") => {
                context.note(element, format!("{other} is not here: `path` measures the same picture"));
            }
            _ => return Err(context.unsupported(element, "path")),
        }
        let max_depth = match context.integer(element, "max_depth")?.unwrap_or(-1) {
            -1 => {
                context.note(element, format!("paths of any length: cut at {} edges", limits::PATH_EDGES));
                limits::PATH_EDGES
            }
            depth => u32::try_from(depth).unwrap_or(0),
        };
        let roulette_depth = match context.integer(element, "rr_depth")? {
            Some(depth) => u32::try_from(depth).unwrap_or(0),
            None => Integrator::default().roulette_depth,
        };
        if context.boolean(element, "hide_emitters")?.unwrap_or(false) {
            return Err(context.fault(element, ErrorKind::Unsupported, "hide_emitters", "emitters that the camera sees"));
        }
        context.finish(element, "max_depth and rr_depth")?;
        Ok(Integrator { max_depth, roulette_depth })
    }

    /// Reads a material and stores it under its id, or under a name of its own. Returns that name.
    fn material(&mut self, element: &'a Element) -> Result<String, Error> {
        let material = bsdf::read(&mut self.context, element)?;
        let name = match self.context.id(element)? {
            Some(id) => id,
            // Such a name may stand in the file as well: the line makes it unlikely, the column more so, and the check below certain.
            None => format!("{} of line {}:{}", self.context.kind(element)?, element.line, element.column),
        };
        if self.materials.insert(name.clone(), material).is_some() {
            return Err(self.context.fault(element, ErrorKind::Invalid, format!("the id {name:?} twice"), "each id once"));
        }
        self.lines.insert(format!("materials.{name}"), (element.line, element.column));
        Ok(name)
    }

    fn shape(&mut self, element: &'a Element) -> Result<(), Error> {
        let mut material = None;
        for child in element.children.iter().filter(|child| ["bsdf", "ref"].contains(&child.tag.as_str())) {
            if material.is_some() {
                return Err(self.context.fault(child, ErrorKind::Invalid, "a second material", "one for each shape"));
            }
            child.used.set(true);
            material = Some(if child.tag == "bsdf" { self.material(child)? } else { self.reference(child)? });
        }
        let mut shape = shape::read(&mut self.context, element)?;
        if material.is_none() {
            let plain = "default".to_string();
            self.materials.entry(plain.clone()).or_insert_with(bsdf::default_material);
            material = Some(plain);
        }
        shape.material = material;
        self.lines.insert(format!("shapes[{}]", self.shapes.len()), (element.line, element.column));
        self.shapes.push(shape);
        Ok(())
    }

    fn reference(&self, element: &Element) -> Result<String, Error> {
        let id = self.context.required(element, "id")?;
        if self.materials.contains_key(&id) {
            return Ok(id);
        }
        let known: Vec<&str> = self.materials.keys().map(String::as_str).collect();
        let expected = format!("the id of a bsdf above: {}", known.join(", "));
        Err(self.context.fault(element, ErrorKind::UnknownName, format!("{id:?}"), expected))
    }

    fn emitter(&mut self, element: &Element) -> Result<(), Error> {
        if self.context.kind(element)? != "constant" {
            return Err(self.context.unsupported(element, "constant, or area inside a shape"));
        }
        self.once(self.environment.is_some(), element)?;
        let radiance = self.context.colour(element, "radiance")?.unwrap_or(crate::scene::description::Colour::WHITE);
        self.context.finish(element, "radiance")?;
        self.environment = Some(Environment::constant(radiance));
        self.lines.insert("environment".to_string(), (element.line, element.column));
        Ok(())
    }

    fn finish(mut self, root: &Element) -> Result<Imported, Error> {
        let file = self.context.file;
        let camera = self.camera.ok_or_else(|| root.fault(ErrorKind::Malformed, file, "no <sensor>", "one"))?;
        let integrator = self.integrator.unwrap_or_else(|| {
            self.context.note(root, format!("no integrator: path with at most {} edges", Integrator::default().max_depth));
            Integrator::default()
        });
        let description = SceneDescription {
            version: VERSION,
            about: format!("Imported from the Mitsuba scene {}", file.rsplit(['/', '\\']).next().unwrap_or(file)),
            camera,
            film: self.film,
            integrator,
            textures: BTreeMap::new(),
            media: BTreeMap::new(),
            materials: self.materials,
            groups: BTreeMap::new(),
            shapes: self.shapes,
            lights: Vec::new(),
            environment: self.environment,
            medium: None,
        };
        description.validate(file).map_err(|fault| locate(fault, &self.lines))?;
        Ok(Imported { description, made: MadeAssets::new(), report: self.context.report })
    }
}

/// Adds the line of the element that a part of the description came from.
fn locate(fault: Error, lines: &BTreeMap<String, (usize, usize)>) -> Error {
    let path = fault.place.path.clone();
    let longest = lines.iter().filter(|(part, _)| path.starts_with(part.as_str())).max_by_key(|(part, _)| part.len());
    match longest {
        Some((_, (line, column))) => fault.at(*line, *column),
        None => fault,
    }
}

#[cfg(test)]
mod tests;
