//! What reading any element needs: the ids of the scene, what was made so far, the report, and the check that nothing was overlooked.

use std::collections::BTreeMap;

use super::super::xml::Element;
use super::prepare::Document;
use crate::scene::assets::{Assets, MadeAssets};
use crate::scene::description::{Animation, Environment, Light, Material, Medium, Shape, Texture};
use crate::scene::error::{Error, ErrorKind};

/// Elements that refer to elements that refer to elements, and so on.
const REFERENCE_DEPTH: usize = 32;

/// State of one import.
pub(super) struct Context<'a> {
    /// Whether the scene is of the generation 0.x.
    pub(super) old: bool,
    /// The name of the scene's file.
    pub(super) file: &'a str,
    /// The files beside the scene.
    pub(super) assets: &'a dyn Assets,
    /// What was changed or left aside, for people.
    pub(super) report: Vec<String>,
    pub(super) textures: BTreeMap<String, Texture>,
    pub(super) materials: BTreeMap<String, Material>,
    pub(super) media: BTreeMap<String, Medium>,
    pub(super) groups: BTreeMap<String, Vec<Shape>>,
    pub(super) lights: Vec<Light>,
    pub(super) environment: Option<Environment>,
    /// What moves.
    pub(super) animation: Animation,
    pub(super) made: MadeAssets,
    /// Name of the medium around the camera.
    pub(super) around: Option<String>,
    /// Where the parts of the description came from, so that faults found by its check can name a line.
    pub(super) origins: BTreeMap<String, &'a Element>,
    /// Folders that files are searched in.
    pub(super) folders: &'a [String],
    ids: BTreeMap<&'a str, &'a Element>,
    aliases: &'a BTreeMap<String, String>,
    /// Names of what is being read just now, the outermost first.
    open: Vec<String>,
}

impl<'a> Context<'a> {
    /// Gathers the ids of a scene.
    ///
    /// # Errors
    /// An id that two elements bear.
    pub(super) fn new(document: &'a Document, file: &'a str, assets: &'a dyn Assets) -> Result<Context<'a>, Error> {
        let mut ids = BTreeMap::new();
        gather(&document.root, &mut ids)?;
        Ok(Context {
            old: document.old,
            file,
            assets,
            report: document.report.clone(),
            textures: BTreeMap::new(),
            materials: BTreeMap::new(),
            media: BTreeMap::new(),
            groups: BTreeMap::new(),
            lights: Vec::new(),
            environment: None,
            animation: Animation::default(),
            made: MadeAssets::new(),
            around: None,
            origins: BTreeMap::new(),
            folders: &document.folders,
            ids,
            aliases: &document.aliases,
            open: Vec::new(),
        })
    }

    /// An element that has no counterpart here.
    pub(super) fn unsupported(&self, element: &Element, expected: &str) -> Error {
        element.fault(ErrorKind::Unsupported, "something that this renderer cannot honour", expected)
    }

    /// Adds a line to the report.
    pub(super) fn note(&mut self, element: &Element, what: impl AsRef<str>) {
        let file = if *element.file == *self.file { String::new() } else { format!("{}, ", element.file) };
        self.report.push(format!("{file}line {}, {}: {}", element.line, element.shown(), what.as_ref()));
    }

    /// An attribute that must be there.
    pub(super) fn required(&self, element: &'a Element, name: &str) -> Result<&'a str, Error> {
        let value = element.attribute(name).map(str::trim);
        value.ok_or_else(|| element.fault(ErrorKind::Malformed, format!("no attribute `{name}`"), format!("{name}=\"…\"")))
    }

    /// The plugin that an element asks for.
    pub(super) fn kind(&self, element: &'a Element) -> Result<&'a str, Error> {
        self.required(element, "type")
    }

    /// The id of an element, or a name made of its kind and place, which no id may be.
    pub(super) fn name(&self, element: &'a Element) -> Result<String, Error> {
        if let Some(id) = element.attribute("id") {
            return Ok(id.to_string());
        }
        let file = if *element.file == *self.file { String::new() } else { format!(" of {}", element.file) };
        let name = format!("{} of line {}:{}{file}", self.kind(element)?, element.line, element.column);
        match self.ids.get(name.as_str()) {
            Some(other) => Err(other.fault(ErrorKind::Invalid, "an id that stands for another element without one", "another id")),
            None => Ok(name),
        }
    }

    /// The element that an id means, of one of the given tags.
    pub(super) fn reference(&self, element: &'a Element, tags: &[&str]) -> Result<&'a Element, Error> {
        let mut id = self.required(element, "id")?;
        // An alias may stand for an alias; a chain longer than there are aliases is a circle.
        for _ in 0..=self.aliases.len() {
            match self.aliases.get(id) {
                Some(of) if !self.ids.contains_key(id) => id = of,
                _ => break,
            }
        }
        if let Some(found) = self.ids.get(id).filter(|found| tags.contains(&found.tag.as_str())) {
            return Ok(found);
        }
        let mut known: Vec<&str> = self.ids.iter().filter(|(_, found)| tags.contains(&found.tag.as_str())).map(|(id, _)| *id).collect();
        known.truncate(12);
        let expected = format!("the id of a {}: {}", tags.join(" or "), known.join(", "));
        Err(element.fault(ErrorKind::UnknownName, format!("{id:?}"), expected))
    }

    /// Whether a child is, or refers to, an element of this tag.
    pub(super) fn is(&self, child: &'a Element, tag: &str) -> bool {
        child.tag == tag || (child.tag == "ref" && self.reference(child, &[tag]).is_ok())
    }

    /// The child itself, or what it refers to; marked as used.
    pub(super) fn resolved(&self, child: &'a Element, tag: &str) -> Result<&'a Element, Error> {
        child.used.set(true);
        if child.tag == "ref" { self.reference(child, &[tag]) } else { Ok(child) }
    }

    /// The children that are, or refer to, elements of this tag, in order and marked as used.
    pub(super) fn nested(&self, element: &'a Element, tag: &str) -> Result<Vec<&'a Element>, Error> {
        let children = element.children.iter().filter(|child| !child.used.get() && self.is(child, tag));
        children.map(|child| self.resolved(child, tag)).collect()
    }

    /// At most one such child.
    pub(super) fn nested_one(&self, element: &'a Element, tag: &str) -> Result<Option<&'a Element>, Error> {
        match self.nested(element, tag)?[..] {
            [] => Ok(None),
            [one] => Ok(Some(one)),
            [_, second, ..] => Err(second.fault(ErrorKind::Invalid, format!("a second {tag}"), format!("one in {}", element.shown()))),
        }
    }

    /// Whether something of this tag and id was made use of.
    pub(super) fn is_made(&self, tag: &str, id: &str) -> bool {
        match tag {
            "bsdf" => self.materials.contains_key(id),
            "texture" => self.textures.contains_key(id),
            "medium" => self.media.contains_key(id),
            _ => false,
        }
    }

    /// The child called `name`, marked as used.
    pub(super) fn parameter(&self, element: &'a Element, name: &str) -> Result<Option<&'a Element>, Error> {
        let mut found = None;
        for child in element.children.iter().filter(|child| child.attribute("name") == Some(name)) {
            if found.is_some() {
                return Err(child.fault(ErrorKind::Malformed, "the parameter twice", "once"));
            }
            child.used.set(true);
            found = Some(child);
        }
        Ok(found)
    }

    /// Notes parameters that say how Mitsuba works and not what the picture is.
    pub(super) fn leave(&mut self, element: &'a Element, names: &[&str], why: &str) -> Result<(), Error> {
        for name in names {
            if let Some(parameter) = self.parameter(element, name)? {
                self.note(parameter, why);
            }
        }
        Ok(())
    }

    /// Refuses children that nothing has read; `expected` lists those that would have been. Mitsuba 0.x itself passes over parameters
    /// that it does not know, so there they are noted.
    pub(super) fn finish(&mut self, element: &'a Element, expected: &str) -> Result<(), Error> {
        for child in element.children.iter().filter(|child| !child.used.get()) {
            if child.tag == "ref" {
                // Most often there is nothing of this id at all.
                self.reference(child, &["bsdf", "texture", "medium", "emitter", "shape", "phase", "spectrum"])?;
            }
            let plain = ["float", "integer", "boolean", "string"].contains(&child.tag.as_str());
            if !(self.old && plain) {
                return Err(self.unsupported(child, &format!("in {}: {expected}", element.shown())));
            }
            child.used.set(true);
            self.note(child, "not known here, left aside");
        }
        Ok(())
    }

    /// Reads something that others may refer to, unless it is being read already.
    pub(super) fn inside<T>(
        &mut self,
        element: &'a Element,
        name: &str,
        read: impl FnOnce(&mut Self) -> Result<T, Error>,
    ) -> Result<T, Error> {
        if self.open.iter().any(|open| open == name) {
            return Err(element.fault(ErrorKind::Invalid, "something made of itself", "references without circles"));
        }
        if self.open.len() >= REFERENCE_DEPTH {
            return Err(element.fault(ErrorKind::TooLarge, "references nested too deep", format!("at most {REFERENCE_DEPTH}")));
        }
        self.open.push(name.to_string());
        let read = read(self);
        self.open.pop();
        read
    }
}

fn gather<'a>(element: &'a Element, ids: &mut BTreeMap<&'a str, &'a Element>) -> Result<(), Error> {
    for child in &element.children {
        if child.tag != "ref"
            && let Some(id) = child.attribute("id")
            && ids.insert(id, child).is_some()
        {
            return Err(child.fault(ErrorKind::Invalid, format!("the id {id:?} twice"), "each id once"));
        }
        gather(child, ids)?;
    }
    Ok(())
}
