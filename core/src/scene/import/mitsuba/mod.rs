//! Mitsuba's XML, of the generations 3 (and 2) and 0.4 to 0.6.
//!
//! Nothing is dropped in silence. What would change the picture and cannot be honoured is an error that names file, line and element; what is
//! approximated, or only says how Mitsuba was to work (samplers, file formats), goes into the report. `docs/formats.md` has the whole table.

mod animation;
mod bsdf;
mod context;
mod cube;
mod emitter;
mod film;
mod integrator;
mod medium;
mod mirror;
mod names;
mod packed;
mod prepare;
mod sensor;
mod shape;
mod sun;
mod texture;
mod transform;
mod values;

use std::collections::BTreeMap;

use self::context::Context;
use self::prepare::Document;
use super::Imported;
use super::xml::Element;
use crate::scene::assets::Assets;
use crate::scene::description::{Camera, Film, Integrator, SceneDescription, Shape, VERSION};
use crate::scene::error::{Error, ErrorKind};

/// Reads a Mitsuba scene from its text; `file` is the name that errors carry, and what it includes or unpacks comes from `assets`.
///
/// # Errors
/// Malformed XML, values outside their domain, and everything that changes the picture but has no counterpart here.
pub(in crate::scene) fn import(text: &str, file: &str, assets: &dyn Assets) -> Result<Imported, Error> {
    let document = prepare::prepare(text, file, assets)?;
    let scene = Scene { context: Context::new(&document, file, assets)?, sensor: None, integrator: None, shapes: Vec::new() };
    scene.read(&document)
}

/// What the scene's elements said so far.
struct Scene<'a> {
    context: Context<'a>,
    sensor: Option<(Camera, Film)>,
    integrator: Option<Integrator>,
    shapes: Vec<Shape>,
}

impl<'a> Scene<'a> {
    fn read(mut self, document: &'a Document) -> Result<Imported, Error> {
        for element in &document.root.children {
            self.child(element)?;
        }
        self.unused(&document.root);
        self.finish(&document.root)
    }

    fn child(&mut self, element: &'a Element) -> Result<(), Error> {
        match element.tag.as_str() {
            "integrator" if self.integrator.is_some() => {
                return Err(element.fault(ErrorKind::Unsupported, "a second one", "one"));
            }
            "integrator" => {
                self.integrator = Some(self.context.integrator(element)?);
                self.context.origins.insert("integrator".to_string(), element);
            }
            "sensor" if self.sensor.is_some() => self.context.note(element, "a second sensor: the first one is rendered"),
            "sensor" => {
                self.sensor = Some(self.context.sensor(element)?);
                self.context.origins.insert("camera".to_string(), element);
                self.context.origins.insert("film".to_string(), element);
            }
            "shape" => {
                if let Some(shape) = self.context.shape(element)? {
                    self.context.origins.insert(format!("shapes[{}]", self.shapes.len()), element);
                    self.shapes.push(shape);
                }
            }
            // An area light out here is one that shapes refer to.
            "emitter" if element.attribute("type") != Some("area") => self.context.emitter(element)?,
            // Read when something refers to them.
            "bsdf" | "texture" | "medium" | "emitter" | "phase" | "spectrum" | "volume" | "rfilter" | "film" => {}
            "sampler" => self.context.note(element, "left aside: samples are chosen for each job"),
            _ => {
                return Err(self
                    .context
                    .unsupported(element, "default, include, integrator, sensor, bsdf, texture, medium, shape or emitter"));
            }
        }
        Ok(())
    }

    /// Reports what stands in the scene and nothing refers to.
    fn unused(&mut self, root: &'a Element) {
        let refers = |element: &Element| element.attribute("id").is_some_and(|id| self.context.is_made(&element.tag, id));
        let idle: Vec<&Element> = root
            .children
            .iter()
            .filter(|element| ["bsdf", "texture", "medium", "emitter"].contains(&element.tag.as_str()))
            .filter(|element| element.tag != "emitter" || element.attribute("type") == Some("area"))
            .filter(|element| !refers(element) && element.children.iter().all(|child| !child.used.get()))
            .collect();
        for element in idle {
            self.context.note(element, "nothing refers to it: left aside");
        }
    }

    fn finish(mut self, root: &'a Element) -> Result<Imported, Error> {
        let file = self.context.file;
        let (camera, film) = self.sensor.ok_or_else(|| root.fault(ErrorKind::Malformed, "no <sensor>", "one"))?;
        let integrator = self.integrator.unwrap_or_else(|| {
            self.context.note(root, format!("no integrator: path with at most {} edges", Integrator::default().max_depth));
            Integrator::default()
        });
        let mut context = self.context;
        context.prune(&self.shapes);
        let description = SceneDescription {
            version: VERSION,
            about: format!("Imported from the Mitsuba scene {}", file.rsplit(['/', '\\']).next().unwrap_or(file)),
            camera,
            film,
            integrator,
            textures: context.textures,
            media: context.media,
            materials: context.materials,
            groups: context.groups,
            shapes: self.shapes,
            lights: context.lights,
            environment: context.environment,
            medium: context.around,
            animation: (!context.animation.nodes.is_empty()).then_some(context.animation),
        };
        description.validate(file).map_err(|fault| locate(fault, &context.origins))?;
        Ok(Imported { description, made: context.made, report: context.report })
    }
}

/// Adds the line of the element that a part of the description came from.
fn locate(fault: Error, origins: &BTreeMap<String, &Element>) -> Error {
    let path = fault.place.path.clone();
    let longest = origins.iter().filter(|(part, _)| path.starts_with(part.as_str())).max_by_key(|(part, _)| part.len());
    match longest {
        Some((_, element)) => {
            let mut fault = fault.at(element.line, element.column);
            fault.place.file = element.file.to_string();
            fault
        }
        None => fault,
    }
}

#[cfg(test)]
mod tests;
